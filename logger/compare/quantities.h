#pragma once
// What is compared of two runs, quantity by quantity: what each is called, in which messages it
// stands, and by which tolerance it is judged.

#include <array>
#include <optional>
#include <string_view>

#include "bridge/wire/channels.h"
#include "logger/compare/tolerances.h"

namespace morphbus::logger {

/// What is measured. The unit is that of the item's difference.
enum class Quantity {
  kRole,                ///< s: when the role was taken, and what it resolved.
  kPropagatedPosition,  ///< m
  kPropagatedRotation,  ///< rad
  kStaleness,           ///< 1 where only one module says that the root is silent.
  kSimulatedPosition,   ///< m
  kSimulatedRotation,   ///< rad
  kJointAngle,          ///< rad
  kJointTravel,         ///< m
  kJointVelocity,       ///< rad/s or m/s
  kJointEffort,         ///< N m or N
  kDocking,             ///< Count of mates that only one module's sensors see.
  kCommand,             ///< rad, rad/s, m or m/s
  kSpeedLimit,          ///< rad/s or m/s: of a commanded target.
  kConnectorCommand,    ///< Count of connector commands that only one module gave.
  kRestPosition,        ///< m: the links do not lie at the same place at the start values.
  kDuration,            ///< s: one run is longer.
  kEvent,               ///< s: time from one event of a module to its next.
  kDriftPosition,       ///< m: where the robot strayed to in the world.
  kDriftRotation,       ///< rad
  kCycle,               ///< s: how long a cycle of the gait takes.
  kForward,             ///< m a cycle, in the direction in which the robot points.
  kSideways,            ///< m a cycle, to the left.
  kTurn,                ///< rad a cycle, to the left.
  kHeight,              ///< m: lowest height of the trunk over the ground.
  kDuty,                ///< Share of the cycle (0…1) that a foot is on the ground.
  kRange,               ///< rad or m: between a joint's largest and smallest value in a cycle.
  kEnergy,              ///< Share of the larger one: energy a cycle.
  kTransport,           ///< Share of the larger one: cost of transport.
};

/// Quantities that a comparison may leave out together (`--without`), as for runs without a
/// simulator, by these words.
inline constexpr const char* kQuantityGroups[] = {"propagated", "simulated", "sensors", "commands"};

/// A tolerance that is in this unit.
struct UnitTolerance {
  std::string_view unit;
  double Tolerances::*which = nullptr;
};

/// What is known of a quantity.
struct QuantityInfo {
  /// In text and JSON, e.g. "joint angle".
  const char* name;
  /// One of kQuantityGroups; empty for what is always compared.
  std::string_view group;
  /// The message that carries it; none for what is no message's.
  std::optional<bridge::Topic> carrier;
  /// By the unit of its differences; null where none is tolerated whatever the options say.
  std::array<UnitTolerance, 2> tolerances = {};
};

/// The row of a quantity.
const QuantityInfo& InfoOf(Quantity quantity);
inline const char* QuantityName(Quantity quantity) { return InfoOf(quantity).name; }

}  // namespace morphbus::logger
