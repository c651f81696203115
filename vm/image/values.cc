#include "vm/image/values.h"

namespace morphbus::vm {

// Joints, links, connectors and sets mean something in one module only, so they never stand in an
// image nor travel.
bool IsValueOf(ValueType type, Cell cell, int num_roles) {
  // Any int and any finite float will do; of the others there are only so many.
  switch (type) {
    case ValueType::kBool:
      return cell.bits <= 1;
    case ValueType::kInt:
      return true;
    case ValueType::kFloat:
      return IsFinite(cell.AsFloat());
    case ValueType::kDirection:
      return cell.bits < kNumDirections;
    case ValueType::kAxis:
      return cell.bits < kNumAxes;
    case ValueType::kRole:
      return cell.bits < static_cast<uint32_t>(num_roles);
    default:
      return false;
  }
}

}  // namespace morphbus::vm
