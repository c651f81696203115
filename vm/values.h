#pragma once
// Values that DynaRole programs compute with. Every value is one 32-bit cell; its static type is
// known to the compiler and proved again by the verifier.

#include <cstdint>
#include <cstring>

namespace morphbus::vm {

/// kSet: module set as a bit mask over own connectors. kJointSet, kLinkSet: masks over own joints
/// and links, what `self.joints` and `self.links` yield before exactly one is demanded.
enum class ValueType : uint8_t {
  kVoid,
  kBool,
  kInt,
  kFloat,
  kDirection,
  kAxis,
  kRole,
  kJoint,
  kLink,
  kSet,
  kConnector,
  kJointSet,
  kLinkSet,
};

/// Directions of the robot frame (NUE: +X north, +Y up, +Z east).
enum class Direction : uint8_t { kAny, kNorth, kSouth, kEast, kWest, kUp, kDown };

/// Axes; as a direction to turn about, the first named: north, up, east.
enum class Axis : uint8_t { kAny, kNorthSouth, kUpDown, kEastWest };

struct Cell {
  uint32_t bits = 0;

  static Cell Int(int32_t v) { return Cell{static_cast<uint32_t>(v)}; }
  static Cell Bool(bool v) { return Cell{v ? 1u : 0u}; }
  static Cell Float(float v) {
    Cell c;
    std::memcpy(&c.bits, &v, 4);
    return c;
  }
  [[nodiscard]] int32_t AsInt() const { return static_cast<int32_t>(bits); }
  [[nodiscard]] bool AsBool() const { return bits != 0; }
  [[nodiscard]] float AsFloat() const {
    float v;
    std::memcpy(&v, &bits, 4);
    return v;
  }
};

/// Why a task ended, or what a VM reports on its status channel.
enum class FaultCode : uint8_t {
  kNone,
  kIntegerOverflow,
  kDivisionByZero,
  kNotFinite,
  kUnresolved,
  kLinkNotOnJoint,
  kAxisNotAligned,
  kTargetClamped,
  kStalled,
  kStalePose,
  kBudget,
  kAmbiguousRole,
  kRoleFlicker,
  kQueueOverflow,
  kTaskOverflow,
  kCapacity,
  kMissingKeyword,
  kStackOverflow,
  kNotContinuous,
  kNotPrismatic,
  kBadState,
};

/// True if the cell is a value of that type: finite, in range, 0 or 1. Only types that can stand in
/// an image or travel with an invocation have such values; joints, links and sets never do.
bool IsValueOf(ValueType type, Cell cell, int num_roles);

/// Short English text of a fault, e.g. "target clamped to the joint's limit".
const char* FaultText(FaultCode code);

}  // namespace morphbus::vm
