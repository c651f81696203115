#include "test/vm/operand_image.h"

#include <utility>

namespace morphbus::vm {

Code Value(ValueType type) {
  const auto constant = [](int index) { return Op16(Opcode::kPushConst, index); };
  switch (type) {
    case ValueType::kInt:
      return constant(kInt);
    case ValueType::kFloat:
      return constant(kFloat);
    case ValueType::kBool:
      return constant(kBool);
    case ValueType::kDirection:
      return constant(kDirection);
    case ValueType::kAxis:
      return constant(kAxis);
    case ValueType::kRole:
      return constant(kRole);
    case ValueType::kJoint:
      return Op(Opcode::kLoadLabel, {0});
    case ValueType::kLink:
      return Op(Opcode::kLoadLabel, {1});
    case ValueType::kSet:
      return constant(kDirection) + Op(Opcode::kConnected);
    case ValueType::kConnector:
      return Op(Opcode::kKeyword, {kConnectorKeyword});
    case ValueType::kJointSet:
      return constant(kAxis) + constant(kInt) + Op(Opcode::kJoints);
    default:
      return constant(kInt) + Op(Opcode::kLinks);
  }
}

ValueType ResultIn(Place place) {
  if (place == Place::kTask) return ValueType::kVoid;
  const bool label = place == Place::kLabel || place == Place::kCalledByLabel;
  return label ? ValueType::kJoint : ValueType::kBool;
}

void PutInto(Place place, TestImage* image) {
  if (place == Place::kTask) return;
  TestRole& role = image->roles[0];
  role.startups = {};
  role.methods.resize(1);
  int function = kTested;
  if (place == Place::kCalledByRequirement || place == Place::kCalledByLabel) {
    role.methods.push_back(kTested);
    TestFunction caller;
    caller.name = "R.caller";
    caller.return_type = ResultIn(place);
    caller.code = Op(Opcode::kCall, {1}) + Value(caller.return_type) + Op(Opcode::kReturnValue);
    image->functions.push_back(caller);
    function = kCaller;
  }
  if (ResultIn(place) == ValueType::kJoint) {
    role.labels[0] = {ValueType::kJoint, function};
  } else {
    role.requirements = {function};
  }
}

TestImage OperandImage(const Code& code, const std::vector<TestJoin>& joins, ValueType result) {
  TestImage image;
  image.keywords = {{KeywordKind::kJoint, "JOINT_1"},
                    {KeywordKind::kConnector, "C1"},
                    {KeywordKind::kConnectorState, "EXTENDED"},
                    {KeywordKind::kSensor, "EYE"},
                    {KeywordKind::kSensorKind, "DISTANCE_SENSOR"}};
  // A text lies where the first keyword's name does.
  image.constants = {{ValueType::kInt, 1},        {ValueType::kFloat, Bits(1)},
                     {ValueType::kBool, 1},       {ValueType::kDirection, 1},
                     {ValueType::kAxis, 1},       {ValueType::kRole, 0},
                     {ValueType::kText, 7u << 16}};
  const Code end = Op(Opcode::kReturn);
  const Code number = Op(Opcode::kPushInt8, {1}) + Op(Opcode::kReturnValue);
  const auto function = [](int role, ValueType type, int arguments, std::vector<ValueType> locals,
                           Code body) {
    TestFunction made;
    made.name = "R.f";
    made.role = role;
    made.return_type = type;
    made.num_arguments = arguments;
    made.locals = std::move(locals);
    made.code = std::move(body);
    return made;
  };
  // The locals of the function under test: the first two are set, the last is not.
  const Code set = Value(ValueType::kInt) + Op(Opcode::kStoreLocal, {kIntLocal}) +
                   Value(ValueType::kFloat) + Op(Opcode::kStoreLocal, {kFloatLocal});
  TestFunction tested =
      function(0, result, 0, {ValueType::kInt, ValueType::kFloat, ValueType::kInt}, set + code);
  for (TestJoin join : joins) {
    join.offset += static_cast<int>(set.size());
    join.set_locals = 3;
    tested.joins.push_back(join);
  }
  image.functions = {
      tested,
      function(kBase, ValueType::kVoid, 1, {ValueType::kInt}, end),
      function(0, ValueType::kInt, 1, {ValueType::kInt}, number),
      function(kBase, ValueType::kInt, 1, {ValueType::kInt}, number),
      function(kBase, ValueType::kJoint, 0, {},
               Op(Opcode::kKeyword, {kJointKeyword}) + Op(Opcode::kReturnValue)),
      function(kBase, ValueType::kLink, 0, {},
               Value(ValueType::kLinkSet) + Op(Opcode::kOneLink) + Op(Opcode::kReturnValue)),
      function(kOther, ValueType::kInt, 1, {ValueType::kInt}, number)};
  TestRole base;
  base.name = "Base";
  base.abstract_role = true;
  // Field 0 is shared, field 1 is not.
  base.fields = {{static_cast<ValueType>(static_cast<int>(ValueType::kInt) | 0x80), 1},
                 {ValueType::kInt, 1}};
  base.labels = {{ValueType::kJoint, kJointLabel}, {ValueType::kLink, kLinkLabel}};
  base.commands = {kCommand};
  base.methods = {kBaseMethod};
  TestRole role = base;
  role.name = "R";
  role.abstract_role = false;
  role.parent = kBase;
  role.depth = 1;
  role.methods = {kMethod};
  role.fields.push_back({ValueType::kFloat, Bits(1)});
  if (result == ValueType::kVoid) {
    role.startups = {kTested};
  } else {
    role.methods.push_back(kTested);
  }
  TestRole other;
  other.name = "Other";
  other.methods = {kUnrelated};
  // Its shared field is a float where those of the others are ints.
  TestRole sharing;
  sharing.name = "Sharing";
  sharing.fields = {{static_cast<ValueType>(static_cast<int>(ValueType::kFloat) | 0x80), Bits(1)}};
  image.roles = {role, base, other, sharing};
  return image;
}

}  // namespace morphbus::vm
