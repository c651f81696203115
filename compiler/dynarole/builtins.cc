#include "compiler/dynarole/builtins.h"

namespace morphbus::dynarole {

using vm::Opcode;

const std::vector<Builtin>& SelfBuiltins() {
  static const std::vector<Builtin> kTable = {
      {"connected", "", Opcode::kConnected, true, "self.connected"},
      {"connected", "d", Opcode::kConnected, false, "self.connected(direction)"},
      {"connected", "dr", Opcode::kConnectedRole, false, "self.connected(direction, $Role)"},
      {"joints", "ai", Opcode::kJoints, false, "self.joints(axis, n)"},
      {"links", "i", Opcode::kLinks, false, "self.links(n)"},
      {"center", "", Opcode::kCenter, true, "self.center"},
      {"setJointAxis", "jla", Opcode::kSetJointAxis, false, "self.setJointAxis(joint, link, axis)"},
      {"jointRotateDegrees", "jf", Opcode::kRotate, false,
       "self.jointRotateDegrees(joint, degrees)"},
      {"jointRotateDegreesNonBlocking", "jf", Opcode::kRotateNonBlocking, false,
       "self.jointRotateDegreesNonBlocking(joint, degrees)"},
      {"jointSetDegrees", "jf", Opcode::kSetDegrees, false, "self.jointSetDegrees(joint, degrees)"},
      {"jointSetDegreesNonBlocking", "jf", Opcode::kSetDegreesNonBlocking, false,
       "self.jointSetDegreesNonBlocking(joint, degrees)"},
      {"jointDegrees", "j", Opcode::kJointDegrees, false, "self.jointDegrees(joint)"},
      {"turnContinuous", "jf", Opcode::kTurnContinuous, false,
       "self.turnContinuous(joint, degrees_per_second)"},
      {"jointMoveMillimetres", "jf", Opcode::kMoveMillimetres, false,
       "self.jointMoveMillimetres(joint, millimetres)"},
      {"sleepds", "f", Opcode::kSleepDs, false, "self.sleepds(tenths_of_a_second)"},
      {"sleepcs", "f", Opcode::kSleepCs, false, "self.sleepcs(hundredths_of_a_second)"},
  };
  return kTable;
}

const std::vector<Builtin>& JointBuiltins() {
  static const std::vector<Builtin> kTable = {
      {"AXIS", "", Opcode::kJointAxis, true, "JOINT.AXIS"},
      {"SET_POSITION", "f", Opcode::kSetPosition, false, "JOINT.SET_POSITION(degrees)"},
      {"GET_POSITION", "", Opcode::kGetPosition, false, "JOINT.GET_POSITION()"},
  };
  return kTable;
}

std::vector<std::string> NamesOf(const std::vector<Builtin>& builtins) {
  std::vector<std::string> names;
  for (const Builtin& builtin : builtins) {
    if (names.empty() || names.back() != builtin.name) names.push_back(builtin.name);
  }
  return names;
}

}  // namespace morphbus::dynarole
