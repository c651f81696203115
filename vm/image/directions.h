#pragma once
// The named directions and axes of the robot frame R (NUE: +X north, +Y up, +Z east).
// Programs name them ($NORTH, $UP_DOWN); images and messages hold their numbers, so the order of
// the enumerators is fixed.

#include <cstdint>

#include "vm/image/pose.h"

namespace morphbus::vm {

/// A direction along one axis of R, with its sense. kAny stands for all of them, and is also the
/// answer where none fits.
enum class Direction : uint8_t { kAny, kNorth, kSouth, kEast, kWest, kUp, kDown };

/// An axis of R without a sense, or kAny. As a direction to turn about, an axis is the first that
/// its name names: north, up, east.
enum class Axis : uint8_t { kAny, kNorthSouth, kUpDown, kEastWest };

/// How many values each of the two has, kAny included.
inline constexpr int kNumDirections = 7;
inline constexpr int kNumAxes = 4;

/// The names as in programs, by value. The compiler reads them, and messages and listings print
/// them.
inline constexpr const char* kDirectionNames[kNumDirections] = {
    "$ANY", "$NORTH", "$SOUTH", "$EAST", "$WEST", "$UP", "$DOWN"};
inline constexpr const char* kAxisNames[kNumAxes] = {"$ANY", "$NORTH_SOUTH", "$UP_DOWN",
                                                     "$EAST_WEST"};

/// The unit vector of a direction in R; zero for kAny.
constexpr Vec3 UnitOf(Direction d) {
  constexpr Vec3 kUnits[kNumDirections] = {{0, 0, 0},  {1, 0, 0}, {-1, 0, 0}, {0, 0, 1},
                                           {0, 0, -1}, {0, 1, 0}, {0, -1, 0}};
  return kUnits[static_cast<int>(d)];
}

/// The unit vector in R of the direction that an axis is to turn about; zero for kAny.
constexpr Vec3 UnitOf(Axis axis) {
  constexpr Vec3 kUnits[kNumAxes] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  return kUnits[static_cast<int>(axis)];
}

}  // namespace morphbus::vm
