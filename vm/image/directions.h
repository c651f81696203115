#pragma once
// The named directions and axes of the robot frame R (NUE: +X north, +Y up, +Z east), and the
// diagonals between them. Programs name them ($NORTH, $UP_DOWN, $NORTH + $UP); images and messages
// hold their numbers, so the order of the enumerators is fixed.

#include <cstdint>

#include "vm/image/pose.h"

namespace morphbus::vm {

/// A direction with its sense: along one axis of R, or the diagonal of two or three, whose numbers
/// follow those that have names here. kAny stands for all of them, and is also the answer where
/// none fits.
enum class Direction : uint8_t { kAny, kNorth, kSouth, kEast, kWest, kUp, kDown };

/// An axis of R or a diagonal without a sense, or kAny. As a direction to turn about, an axis is
/// the first that its name names: north, up, east.
enum class Axis : uint8_t { kAny, kNorthSouth, kUpDown, kEastWest };

/// How many values each of the two has, kAny and diagonals included.
inline constexpr int kNumDirections = 27;
inline constexpr int kNumAxes = 14;

/// What a direction or axis is made of: 1, 0 or -1 along each of north, up and east.
struct Signs {
  int8_t north, up, east;
  friend constexpr bool operator==(const Signs&, const Signs&) = default;
};

/// A direction or axis as programs write it, and what it is made of.
struct DirectionRow {
  /// As programs write it, with the dollar signs.
  const char* name;
  /// None for kAny.
  Signs signs;
};

/// All directions, by value. The compiler reads the rows, and messages and listings print the
/// names.
inline constexpr DirectionRow kDirectionRows[kNumDirections] = {
    {"$ANY", {0, 0, 0}},
    // One part: the directions that have names of their own.
    {"$NORTH", {1, 0, 0}},
    {"$SOUTH", {-1, 0, 0}},
    {"$EAST", {0, 0, 1}},
    {"$WEST", {0, 0, -1}},
    {"$UP", {0, 1, 0}},
    {"$DOWN", {0, -1, 0}},
    // Two parts, at 45 degrees to each of them.
    {"$NORTH + $UP", {1, 1, 0}},
    {"$NORTH + $DOWN", {1, -1, 0}},
    {"$SOUTH + $UP", {-1, 1, 0}},
    {"$SOUTH + $DOWN", {-1, -1, 0}},
    {"$NORTH + $EAST", {1, 0, 1}},
    {"$NORTH + $WEST", {1, 0, -1}},
    {"$SOUTH + $EAST", {-1, 0, 1}},
    {"$SOUTH + $WEST", {-1, 0, -1}},
    {"$UP + $EAST", {0, 1, 1}},
    {"$UP + $WEST", {0, 1, -1}},
    {"$DOWN + $EAST", {0, -1, 1}},
    {"$DOWN + $WEST", {0, -1, -1}},
    // Three parts, at some 54.7 degrees to each.
    {"$NORTH + $UP + $EAST", {1, 1, 1}},
    {"$NORTH + $UP + $WEST", {1, 1, -1}},
    {"$NORTH + $DOWN + $EAST", {1, -1, 1}},
    {"$NORTH + $DOWN + $WEST", {1, -1, -1}},
    {"$SOUTH + $UP + $EAST", {-1, 1, 1}},
    {"$SOUTH + $UP + $WEST", {-1, 1, -1}},
    {"$SOUTH + $DOWN + $EAST", {-1, -1, 1}},
    {"$SOUTH + $DOWN + $WEST", {-1, -1, -1}},
};

/// All axes, by value. The first of north, up and east that an axis has is positive.
inline constexpr DirectionRow kAxisRows[kNumAxes] = {
    {"$ANY", {0, 0, 0}},
    // One part: the axes that have names of their own.
    {"$NORTH_SOUTH", {1, 0, 0}},
    {"$UP_DOWN", {0, 1, 0}},
    {"$EAST_WEST", {0, 0, 1}},
    // Of each diagonal and its reverse there is one axis: half as many as directions.
    {"axis($NORTH + $UP)", {1, 1, 0}},
    {"axis($NORTH + $DOWN)", {1, -1, 0}},
    {"axis($NORTH + $EAST)", {1, 0, 1}},
    {"axis($NORTH + $WEST)", {1, 0, -1}},
    {"axis($UP + $EAST)", {0, 1, 1}},
    {"axis($UP + $WEST)", {0, 1, -1}},
    {"axis($NORTH + $UP + $EAST)", {1, 1, 1}},
    {"axis($NORTH + $UP + $WEST)", {1, 1, -1}},
    {"axis($NORTH + $DOWN + $EAST)", {1, -1, 1}},
    {"axis($NORTH + $DOWN + $WEST)", {1, -1, -1}},
};

/// The signs alone: names are for people, and a microcontroller need not hold them.
template <int kCount>
struct SignTable {
  /// Copies them at compile time.
  constexpr explicit SignTable(const DirectionRow (&rows)[kCount]) : signs() {
    for (int i = 0; i < kCount; ++i) signs[i] = rows[i].signs;
  }
  /// By value, as the rows are.
  Signs signs[kCount];
};
inline constexpr SignTable<kNumDirections> kDirectionSigns(kDirectionRows);
inline constexpr SignTable<kNumAxes> kAxisSigns(kAxisRows);

/// The unit vector in R of what is made of these; zero for none.
constexpr Vec3 UnitOf(const Signs& signs) {
  // The length of a diagonal is the root of the number of its parts.
  constexpr float kScales[] = {1.0f, 1.0f, 0.70710678f, 0.57735027f};
  const int parts =
      (signs.north != 0 ? 1 : 0) + (signs.up != 0 ? 1 : 0) + (signs.east != 0 ? 1 : 0);
  const float scale = kScales[parts];
  return {scale * static_cast<float>(signs.north), scale * static_cast<float>(signs.up),
          scale * static_cast<float>(signs.east)};
}

/// The unit vector of a direction in R; zero for kAny.
constexpr Vec3 UnitOf(Direction d) { return UnitOf(kDirectionSigns.signs[static_cast<int>(d)]); }

/// The unit vector in R of the direction that an axis is to turn about; zero for kAny.
constexpr Vec3 UnitOf(Axis axis) { return UnitOf(kAxisSigns.signs[static_cast<int>(axis)]); }

/// The diagonal of two directions that are square to each other; kAny if they are not, or if one of
/// them is kAny.
constexpr Direction SumOf(Direction a, Direction b) {
  const Signs& s = kDirectionSigns.signs[static_cast<int>(a)];
  const Signs& t = kDirectionSigns.signs[static_cast<int>(b)];
  // Two directions are square to each other exactly if no axis is in both; north and south would
  // cancel, and north and north-up would weigh north twice.
  const bool overlap =
      (s.north != 0 && t.north != 0) || (s.up != 0 && t.up != 0) || (s.east != 0 && t.east != 0);
  if (a == Direction::kAny || b == Direction::kAny || overlap) return Direction::kAny;
  const Signs sum{static_cast<int8_t>(s.north + t.north), static_cast<int8_t>(s.up + t.up),
                  static_cast<int8_t>(s.east + t.east)};
  for (int i = 1; i < kNumDirections; ++i) {
    if (kDirectionSigns.signs[i] == sum) return static_cast<Direction>(i);
  }
  return Direction::kAny;
}

/// The axis along a direction; kAny for kAny.
constexpr Axis AxisOf(Direction d) {
  const Signs& s = kDirectionSigns.signs[static_cast<int>(d)];
  // An axis has no sense: the direction and its reverse lie along the same one.
  const Signs reverse{static_cast<int8_t>(-s.north), static_cast<int8_t>(-s.up),
                      static_cast<int8_t>(-s.east)};
  for (int i = 1; i < kNumAxes; ++i) {
    if (kAxisSigns.signs[i] == s || kAxisSigns.signs[i] == reverse) return static_cast<Axis>(i);
  }
  return Axis::kAny;
}

}  // namespace morphbus::vm
