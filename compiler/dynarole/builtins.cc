#include "compiler/dynarole/builtins.h"

namespace morphbus::dynarole {

using vm::Opcode;

const std::vector<Builtin>& SelfBuiltins() {
  // A name and its arguments stand together, so that no two forms of one name may take equally
  // many.
  static const std::vector<Builtin> kTable = {
      {"connected", "", Opcode::kConnected, true, "self.connected"},
      {"connected", "d", Opcode::kConnected, false, "self.connected(direction)"},
      {"connected", "dr", Opcode::kConnectedRole, false, "self.connected(direction, $Role)"},
      {"joints", "ai", Opcode::kJoints, false, "self.joints(axis, n)"},
      {"links", "i", Opcode::kLinks, false, "self.links(n)"},
      {"center", "", Opcode::kCenter, true, "self.center"},
      {"setJointAxis", "jla", Opcode::kSetJointAxis, false, "self.setJointAxis(joint, link, axis)"},
      {"jointRotateDegrees", "jf", Opcode::kRotate, false,
       "self.jointRotateDegrees(joint, degrees)", Motion::kTurns},
      {"jointRotateDegreesNonBlocking", "jf", Opcode::kRotateNonBlocking, false,
       "self.jointRotateDegreesNonBlocking(joint, degrees)", Motion::kTurns},
      {"jointSetDegrees", "jf", Opcode::kSetDegrees, false, "self.jointSetDegrees(joint, degrees)",
       Motion::kTurns},
      {"jointSetDegreesNonBlocking", "jf", Opcode::kSetDegreesNonBlocking, false,
       "self.jointSetDegreesNonBlocking(joint, degrees)", Motion::kTurns},
      {"jointDegrees", "j", Opcode::kJointDegrees, false, "self.jointDegrees(joint)"},
      {"turnContinuous", "jf", Opcode::kTurnContinuous, false,
       "self.turnContinuous(joint, degrees_per_second)", Motion::kTurns},
      {"jointMoveMillimetres", "jf", Opcode::kMoveMillimetres, false,
       "self.jointMoveMillimetres(joint, millimetres)", Motion::kSlides},
      {"sleepds", "f", Opcode::kSleepDs, false, "self.sleepds(tenths_of_a_second)"},
      {"sleepcs", "f", Opcode::kSleepCs, false, "self.sleepcs(hundredths_of_a_second)"},
  };
  return kTable;
}

// The joint before the dot is the first operand of the instruction, and stands in no list of
// arguments here.
const std::vector<Builtin>& JointBuiltins() {
  static const std::vector<Builtin> kTable = {
      {"AXIS", "", Opcode::kJointAxis, true, "JOINT.AXIS"},
      {"SET_POSITION", "f", Opcode::kSetPosition, false, "JOINT.SET_POSITION(degrees)"},
      {"GET_POSITION", "", Opcode::kGetPosition, false, "JOINT.GET_POSITION()"},
  };
  return kTable;
}

const NamedDirection* FindDirection(std::string_view name) {
  for (const NamedDirection& direction : kDirections) {
    if (name == direction.name) return &direction;
  }
  return nullptr;
}

std::vector<std::string> NamesOf(const std::vector<Builtin>& builtins) {
  std::vector<std::string> names;
  for (const Builtin& builtin : builtins) {
    // Forms of one name follow each other.
    if (names.empty() || names.back() != builtin.name) names.push_back(builtin.name);
  }
  return names;
}

std::string UsagesOf(const std::vector<Builtin>& builtins, std::string_view name) {
  std::string usages;
  for (const Builtin& builtin : builtins) {
    // All forms are shown, since the number of arguments was the mistake as often as the name.
    if (name == builtin.name) usages += std::string(usages.empty() ? "" : " or ") + builtin.usage;
  }
  return usages;
}

}  // namespace morphbus::dynarole
