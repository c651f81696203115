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
      // What makes labels: parts of the module by how the robot is built around them.
      {"joints", "ai", Opcode::kJoints, false, "self.joints(axis, n)"},
      {"links", "i", Opcode::kLinks, false, "self.links(n)"},
      {"center", "", Opcode::kCenter, true, "self.center"},
      // The convention that the following degrees are counted by.
      {"setJointAxis", "jla", Opcode::kSetJointAxis, false, "self.setJointAxis(joint, link, axis)"},
      {"jointRotateDegrees", "jf", Opcode::kRotate, false,
       "self.jointRotateDegrees(joint, degrees)", Motion::kTurns, "jointMoveMillimetres"},
      {"jointRotateDegreesNonBlocking", "jf", Opcode::kRotateNonBlocking, false,
       "self.jointRotateDegreesNonBlocking(joint, degrees)", Motion::kTurns,
       "jointMoveMillimetresNonBlocking"},
      {"jointSetDegrees", "jf", Opcode::kSetDegrees, false, "self.jointSetDegrees(joint, degrees)",
       Motion::kTurns, "jointSetMillimetres"},
      {"jointSetDegreesNonBlocking", "jf", Opcode::kSetDegreesNonBlocking, false,
       "self.jointSetDegreesNonBlocking(joint, degrees)", Motion::kTurns,
       "jointSetMillimetresNonBlocking"},
      {"jointDegrees", "j", Opcode::kJointDegrees, false, "self.jointDegrees(joint)"},
      {"jointEffort", "j", Opcode::kJointEffort, false, "self.jointEffort(joint)"},
      {"jointVelocity", "j", Opcode::kJointVelocity, false, "self.jointVelocity(joint)"},
      {"turnContinuous", "jf", Opcode::kTurnContinuous, false,
       "self.turnContinuous(joint, degrees_per_second)", Motion::kTurns, "jointMoveMillimetres"},
      // What turns counts in degrees, what slides in millimetres; each names its unit.
      {"jointMoveMillimetres", "jf", Opcode::kMoveMillimetres, false,
       "self.jointMoveMillimetres(joint, millimetres)", Motion::kSlides, "jointRotateDegrees"},
      {"jointMoveMillimetresNonBlocking", "jf", Opcode::kMoveMillimetresNonBlocking, false,
       "self.jointMoveMillimetresNonBlocking(joint, millimetres)", Motion::kSlides,
       "jointRotateDegreesNonBlocking"},
      {"jointSetMillimetres", "jf", Opcode::kSetMillimetres, false,
       "self.jointSetMillimetres(joint, millimetres)", Motion::kSlides, "jointSetDegrees"},
      {"jointSetMillimetresNonBlocking", "jf", Opcode::kSetMillimetresNonBlocking, false,
       "self.jointSetMillimetresNonBlocking(joint, millimetres)", Motion::kSlides,
       "jointSetDegreesNonBlocking"},
      {"jointMillimetres", "j", Opcode::kJointMillimetres, false, "self.jointMillimetres(joint)",
       Motion::kSlides, "jointDegrees"},
      // The paper sleeps in tenths of a second, its later programs in hundredths.
      {"sleepds", "f", Opcode::kSleepDs, false, "self.sleepds(tenths_of_a_second)"},
      {"sleepcs", "f", Opcode::kSleepCs, false, "self.sleepcs(hundredths_of_a_second)"},
      {"time", "", Opcode::kTime, true, "self.time"},
      {"ms", "", Opcode::kMilliseconds, true, "self.ms"},
      {"hops", "", Opcode::kHops, true, "self.hops"},
      // Who the module is, and where.
      {"id", "", Opcode::kId, true, "self.id"},
      {"role", "", Opcode::kOwnRole, true, "self.role"},
      {"place", "a", Opcode::kPlace, false, "self.place(axis)"},
      {"heading", "", Opcode::kHeading, true, "self.heading"},
      // Sensors are asked by where they look, in the world; those of a name are in SensorBuiltins.
      {"distance", "d", Opcode::kDistance, false, "self.distance(direction)"},
      {"contact", "d", Opcode::kContact, false, "self.contact(direction)"},
      {"tilt", "a", Opcode::kTilt, false, "self.tilt(axis)"},
  };
  return kTable;
}

const std::vector<Builtin>& FunctionBuiltins() {
  static const std::vector<Builtin> kTable = {
      // Angles are in degrees, as everywhere in the language.
      {"sin", "f", Opcode::kSin, false, "sin(degrees)"},
      {"cos", "f", Opcode::kCos, false, "cos(degrees)"},
      {"tan", "f", Opcode::kTan, false, "tan(degrees)"},
      {"asin", "f", Opcode::kAsin, false, "asin(x)"},
      {"acos", "f", Opcode::kAcos, false, "acos(x)"},
      {"atan2", "ff", Opcode::kAtan2, false, "atan2(y, x)"},
      {"sqrt", "f", Opcode::kSqrt, false, "sqrt(x)"},
      {"abs", "f", Opcode::kAbs, false, "abs(x)"},
      {"min", "ff", Opcode::kMin, false, "min(x, y)"},
      {"max", "ff", Opcode::kMax, false, "max(x, y)"},
      {"floor", "f", Opcode::kFloor, false, "floor(x)"},
      {"round", "f", Opcode::kRound, false, "round(x)"},
      {"sign", "f", Opcode::kSign, false, "sign(x)"},
      {"exp", "f", Opcode::kExp, false, "exp(x)"},
      {"log", "f", Opcode::kLog, false, "log(x)"},
      {"pow", "ff", Opcode::kPow, false, "pow(x, y)"},
      // The lesser of `most` and the greater of the other two: two instructions, of which this is
      // the last.
      {kClamp, "fff", Opcode::kMin, false, "clamp(x, least, most)"},
      // The numbers follow from the seed of the run.
      {"random", "ff", Opcode::kRandom, false, "random(lowest, highest)"},
      {"axis", "d", Opcode::kAxisOf, false, "axis(direction)"},
  };
  return kTable;
}

const std::vector<Builtin>& NeighbourBuiltins() {
  static const std::vector<Builtin> kTable = {
      {"sum", "", Opcode::kTelling, false, "sum(SET.field)"},
      {"count", "", Opcode::kTelling, false, "count(SET)"},
      {"count", "", Opcode::kTelling, false, "count(SET.field)"},
      {"any", "", Opcode::kTelling, false, "any(SET.field)"},
      {"all", "", Opcode::kTelling, false, "all(SET.field)"},
      {"min", "", Opcode::kTelling, false, "min(SET.field)"},
      {"max", "", Opcode::kTelling, false, "max(SET.field)"},
  };
  return kTable;
}

// The joint before the dot is the first operand of the instruction, and stands in no list of
// arguments here.
const std::vector<Builtin>& JointBuiltins() {
  static const std::vector<Builtin> kTable = {
      // The names in capitals are those of the paper's raw actuators.
      {"AXIS", "", Opcode::kJointAxis, true, "JOINT.AXIS"},
      {"SET_POSITION", "f", Opcode::kSetPosition, false, "JOINT.SET_POSITION(degrees)"},
      {"GET_POSITION", "", Opcode::kGetPosition, false, "JOINT.GET_POSITION()"},
  };
  return kTable;
}

const std::vector<Builtin>& ConnectorBuiltins() {
  static const std::vector<Builtin> kTable = {
      {"CONNECTED", "", Opcode::kDocked, true, "CONNECTOR.CONNECTED"},
  };
  return kTable;
}

const std::vector<Builtin>& SensorBuiltins() {
  // In the order of vm::SensorKind.
  static const std::vector<Builtin> kTable = {
      {"GET_DISTANCE", "", Opcode::kGetDistance, false, "SENSOR.GET_DISTANCE()"},
      {"GET_CONTACT", "", Opcode::kGetContact, false, "SENSOR.GET_CONTACT()"},
      {"GET_TILT", "", Opcode::kGetTilt, false, "SENSOR.GET_TILT()"},
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

std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string UsagesBeginning(const std::vector<Builtin>& builtins, const std::string& name) {
  std::string usages;
  if (name.size() < 3) return usages;
  for (const std::string& whole : NamesOf(builtins)) {
    if (!whole.starts_with(name)) continue;
    usages += (usages.empty() ? "" : "' or '") + UsagesOf(builtins, whole);
  }
  return usages;
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
