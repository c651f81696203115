#include "vm/values.h"

#include <cmath>

namespace morphbus::vm {

const char* FaultText(FaultCode code) {
  switch (code) {
    case FaultCode::kNone:
      return "no fault";
    case FaultCode::kIntegerOverflow:
      return "integer overflow";
    case FaultCode::kDivisionByZero:
      return "division by zero";
    case FaultCode::kNotFinite:
      return "result is not a finite number";
    case FaultCode::kUnresolved:
      return "no joint or link, or more than one, fits";
    case FaultCode::kLinkNotOnJoint:
      return "the joint does not touch that link";
    case FaultCode::kAxisNotAligned:
      return "joint axis is more than 45 degrees off the given axis";
    case FaultCode::kTargetClamped:
      return "target clamped to the joint's limit";
    case FaultCode::kStalled:
      return "joint stalled before its target";
    case FaultCode::kStalePose:
      return "pose is stale";
    case FaultCode::kBudget:
      return "instruction budget used up";
    case FaultCode::kAmbiguousRole:
      return "several unrelated roles fit this module";
    case FaultCode::kRoleFlicker:
      return "role changed too often and is frozen";
    case FaultCode::kQueueOverflow:
      return "too many invocations wait for this command";
    case FaultCode::kTaskOverflow:
      return "too many tasks";
    case FaultCode::kCapacity:
      return "a fixed capacity of the VM is exceeded";
    case FaultCode::kMissingKeyword:
      return "the module type lacks this keyword";
    case FaultCode::kStackOverflow:
      return "stack overflow";
    case FaultCode::kNotContinuous:
      return "joint cannot turn endlessly";
    case FaultCode::kNotPrismatic:
      return "joint is not prismatic";
    case FaultCode::kBadState:
      return "connector has no such state or value";
  }
  return "unknown fault";
}

bool IsValueOf(ValueType type, Cell cell, int num_roles) {
  switch (type) {
    case ValueType::kBool:
      return cell.bits <= 1;
    case ValueType::kInt:
      return true;
    case ValueType::kFloat:
      return std::isfinite(cell.AsFloat());
    case ValueType::kDirection:
      return cell.bits <= static_cast<uint32_t>(Direction::kDown);
    case ValueType::kAxis:
      return cell.bits <= static_cast<uint32_t>(Axis::kEastWest);
    case ValueType::kRole:
      return cell.bits < static_cast<uint32_t>(num_roles);
    default:
      return false;
  }
}

}  // namespace morphbus::vm
