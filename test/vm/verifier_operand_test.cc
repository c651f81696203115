// Every instruction with every class of operand that it must not have: one that does not exist, one
// of another kind, one cut off or jumped into; too few values on the stack, each value of another
// type, no room for one more; and in a place where it may not be. As a control, each is accepted
// with what it should have.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "test/vm/image_builder.h"
#include "vm/image/opcodes.h"
#include "vm/limits.h"

namespace morphbus::vm {
namespace {

// The numbers of things in the image below.
enum Function { kTested, kCommand, kMethod, kBaseMethod, kJointLabel, kLinkLabel, kUnrelated };
enum Constant { kInt, kFloat, kBool, kDirection, kAxis, kRole, kTextConstant, kNumConstants };
enum Keyword {
  kJointKeyword,
  kConnectorKeyword,
  kStateKeyword,
  kSensorKeyword,
  kSensorKindKeyword,
  kNumKeywords
};
enum Local { kIntLocal, kFloatLocal, kUnsetLocal, kNumLocals };
/// What the function under test is, or what calls it.
enum class Place { kTask, kRequirement, kLabel, kCalledByRequirement, kCalledByLabel };
constexpr int kCaller = 7;
constexpr int kBase = 1, kOther = 2, kNumRoles = 3;

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

/// What a function in this place returns, or its caller.
ValueType ResultIn(Place place) {
  if (place == Place::kTask) return ValueType::kVoid;
  const bool label = place == Place::kLabel || place == Place::kCalledByLabel;
  return label ? ValueType::kJoint : ValueType::kBool;
}

/// Puts a requirement or label into role R, the first of the image, that is the function under test
/// or calls it.
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

/// A program in which every instruction has something to refer to; `code` is a startup of role 0.
TestImage Image(const Code& code, const std::vector<TestJoin>& joins, ValueType result) {
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
  if (result == ValueType::kVoid) {
    role.startups = {kTested};
  } else {
    role.methods.push_back(kTested);
  }
  TestRole other;
  other.name = "Other";
  other.methods = {kUnrelated};
  image.roles = {role, base, other};
  return image;
}

using Operand = std::vector<int>;

/// What an instruction should find: its operand, the values below it, what it leaves.
struct Use {
  Operand operand;
  std::vector<ValueType> pops;
  int pushes = 0;
};

/// A keyword of the kind that the instruction takes.
int GoodKeyword(Opcode op) {
  switch (op) {
    case Opcode::kKeyword:
      return kJointKeyword;
    case Opcode::kDistance:
    case Opcode::kContact:
    case Opcode::kTilt:
      return kSensorKindKeyword;
    case Opcode::kGetDistance:
    case Opcode::kGetContact:
    case Opcode::kGetTilt:
      return kSensorKeyword;
    default:
      return kStateKeyword;
  }
}

Use GoodUse(Opcode op) {
  const OpcodeInfo& info = InfoOf(op);
  Use use;
  for (const char* letter = info.pops; *letter != '\0'; ++letter) {
    use.pops.push_back(*letter == '*' ? ValueType::kInt : TypeOfLetter(*letter));
  }
  use.pushes = info.pushes[0] == '\0' ? 0 : 1;
  switch (info.operand) {
    case OperandKind::kNone:
      break;
    case OperandKind::kInt8:
    case OperandKind::kField:
    case OperandKind::kLabel:
    case OperandKind::kMethod:
    case OperandKind::kLocal:
      use.operand = {0};
      break;
    case OperandKind::kKeyword:
      use.operand = {GoodKeyword(op)};
      break;
    case OperandKind::kConstant:
    case OperandKind::kTarget:
    case OperandKind::kLocals:
      use.operand = {0, 0};
      break;
    case OperandKind::kLocalInt8:
      use.operand = {kIntLocal, 5};
      break;
    case OperandKind::kLocalConstantTarget:
      use.operand = {kIntLocal, kInt, 0, 0, 0};
      break;
    case OperandKind::kRoleCommand:
    case OperandKind::kRoleField:
      use.operand = {kBase, 0};
      break;
    case OperandKind::kFunction:
      use.operand = {kBaseMethod, 0};
      break;
    case OperandKind::kText:
      use.operand = {kTextConstant, 0};
      break;
  }
  // What the letters leave open.
  if (op == Opcode::kLoadLocals) use.pushes = 2;
  if (op == Opcode::kInvokeNear) use.pops = {ValueType::kSet, ValueType::kInt};
  if (op == Opcode::kPrint) use.pops = {};
  return use;
}

/// Operands that the instruction must not have.
std::vector<Operand> BadOperands(Opcode op) {
  switch (InfoOf(op).operand) {
    case OperandKind::kLocal: {
      std::vector<Operand> bad = {{kNumLocals}, {255}};
      // Reading one that is not set, or arithmetic with one of another type.
      if (op != Opcode::kStoreLocal) bad.push_back({kUnsetLocal});
      if (op == Opcode::kAddLocalInt || op == Opcode::kStoreLocal) bad.push_back({kFloatLocal});
      return bad;
    }
    case OperandKind::kLocals:
      return {{kNumLocals, 0}, {0, kNumLocals}, {kUnsetLocal, 0}, {0, kUnsetLocal}, {255, 255}};
    case OperandKind::kLocalInt8:
      return {{kNumLocals, 1}, {kUnsetLocal, 1}, {kFloatLocal, 1}, {255, 1}};
    case OperandKind::kConstant: {
      std::vector<Operand> bad = {{kTextConstant, 0}, {kNumConstants + 4, 0}, {0, 1}, {255, 255}};
      if (op == Opcode::kModConst) bad.push_back({kFloat, 0});
      return bad;
    }
    case OperandKind::kField:
      return {{2}, {255}};
    case OperandKind::kLabel:
      return {{2}, {255}};
    case OperandKind::kKeyword: {
      std::vector<Operand> bad = {{kNumKeywords}, {255}};
      // Those of another kind; what is pushed may be a joint or a connector.
      for (int keyword = 0; keyword < kNumKeywords; ++keyword) {
        const bool pushed = op == Opcode::kKeyword && keyword <= kConnectorKeyword;
        if (!pushed && keyword != GoodKeyword(op)) bad.push_back({keyword});
      }
      return bad;
    }
    case OperandKind::kMethod:
      return {{2}, {255}};
    case OperandKind::kRoleCommand:
      return {{kNumRoles, 0}, {255, 0}, {kBase, 1}, {kBase, 255}, {kOther, 0}};
    case OperandKind::kRoleField:
      return {{kNumRoles, 0}, {255, 0}, {kBase, 2}, {kBase, 255}, {kBase, 1}, {kOther, 0}};
    case OperandKind::kFunction:
      return {{7, 0}, {255, 255}, {kMethod, 0}, {kUnrelated, 0}};
    case OperandKind::kText:
      return {{kInt, 0}, {kNumConstants + 4, 0}, {255, 255}};
    case OperandKind::kTarget:
      // Into the instruction itself, to where nothing is said of the state, and outside.
      return {{1, 0}, {0, 0}, {0, 1}, {255, 255}};
    case OperandKind::kLocalConstantTarget:
      // The target is a good one but in the last four.
      return {{kNumLocals, kInt, 0},         {kUnsetLocal, kInt, 0},
              {kFloatLocal, kInt, 0},        {255, kInt, 0},
              {kIntLocal, kFloat, 0},        {kIntLocal, kTextConstant, 0},
              {kIntLocal, 255, 255},         {kIntLocal, kInt, 0, 1, 0},
              {kIntLocal, kInt, 0, 0, 0},    {kIntLocal, kInt, 0, 0, 1},
              {kIntLocal, kInt, 0, 255, 255}};
    default:
      return {};
  }
}

/// Whether a function ends with it.
bool Returns(Opcode op) { return op == Opcode::kReturn || op == Opcode::kReturnValue; }

/// What the code around an instruction under test is like.
struct Around {
  bool good_target = true;  ///< Jumps go to a join behind them.
  Place place = Place::kTask;
  int below = 0;  ///< Ints on the stack below what the instruction takes.
  /// If not negative, a join stands so many bytes behind the beginning of the instruction.
  int join_in = -1;
};

/// The verifier's message for an instruction on this stack.
std::string Verdict(Opcode op, const Use& use, const Around& around = {}) {
  // A target is the last two bytes of an operand; without them a good one is put there.
  const OperandKind kind = InfoOf(op).operand;
  const bool jumps =
      kind == OperandKind::kTarget || (kind == OperandKind::kLocalConstantTarget &&
                                       (around.good_target || use.operand.size() == 3));
  // What the instruction takes from the stack.
  Code before;
  for (int i = 0; i < around.below; ++i) before = before + Op(Opcode::kPushInt8, {1});
  for (const ValueType type : use.pops) before = before + Value(type);
  Operand operand = use.operand;
  std::vector<TestJoin> joins;
  if (around.join_in >= 0) {
    joins.push_back({static_cast<int>(before.size()) + around.join_in, 0, use.pops});
  }
  if (jumps && (around.good_target || kind == OperandKind::kLocalConstantTarget)) {
    // To the instruction behind it, counted from the beginning of the function; Image puts ten
    // bytes before the code.
    const int behind = static_cast<int>(before.size() + 1 + OperandBytes(kind));
    const int target = behind + 10;
    operand.resize(OperandBytes(kind) - 2);
    operand.insert(operand.end(), {target & 255, target >> 8});
    const bool keeps = op == Opcode::kAnd || op == Opcode::kOr;
    // Behind `and` and `or` there is something to skip, as the two ways differ in the stack.
    if (keeps) {
      operand = {(target + 3) & 255, (target + 3) >> 8};
      joins.push_back({behind + 3, 0, {ValueType::kBool}});
    } else {
      joins.push_back({behind, 0, {}});
    }
  }
  // What it leaves is dropped, and the function ends as one in its place does.
  Code code = before + Op(op, operand);
  if (op == Opcode::kAnd || op == Opcode::kOr) {
    code = code + Value(ValueType::kBool) + Op(Opcode::kPop);
  } else {
    for (int i = 0; i < use.pushes; ++i) code = code + Op(Opcode::kPop);
  }
  for (int i = 0; i < around.below; ++i) code = code + Op(Opcode::kPop);
  ValueType result = op == Opcode::kReturnValue ? ValueType::kInt : ValueType::kVoid;
  const bool itself = around.place == Place::kRequirement || around.place == Place::kLabel;
  if (itself) result = ResultIn(around.place);
  if (!Returns(op)) {
    code = code + (itself ? Value(result) + Op(Opcode::kReturnValue) : Op(Opcode::kReturn));
  }
  TestImage image = Image(code, joins, result);
  PutInto(around.place, &image);
  return VerifyMessage(image.Build());
}

class OperandTest : public ::testing::TestWithParam<int> {
 protected:
  [[nodiscard]] static Opcode op() { return static_cast<Opcode>(GetParam()); }
  [[nodiscard]] static std::string name() { return kOpcodeTexts[GetParam()].mnemonic; }
};

TEST_P(OperandTest, IsAcceptedWithWhatItShouldHave) {
  EXPECT_EQ(Verdict(op(), GoodUse(op())), "") << name();
}

TEST_P(OperandTest, IsRefusedWithAnythingElse) {
  const Use good = GoodUse(op());
  for (const Operand& operand : BadOperands(op())) {
    Use bad = good;
    bad.operand = operand;
    EXPECT_NE(Verdict(op(), bad, {.good_target = false}), "") << name() << " " << operand[0];
  }
  // Each byte of the operand may be the last of the image's code.
  for (size_t size = 0; size < good.operand.size(); ++size) {
    Code code;
    for (const ValueType type : good.pops) code = code + Value(type);
    const Operand part(good.operand.begin(), good.operand.begin() + static_cast<long>(size));
    EXPECT_EQ(VerifyMessage(Image(code + Op(op(), part), {}, ValueType::kVoid).Build()),
              "instruction is cut off")
        << name();
  }
}

TEST_P(OperandTest, IsRefusedOnAnyOtherStack) {
  const Use good = GoodUse(op());
  // Too few values.
  for (size_t count = 0; count < good.pops.size(); ++count) {
    Use bad = good;
    bad.pops.resize(count);
    EXPECT_NE(Verdict(op(), bad), "") << name() << " with " << count;
  }
  // Each value of each other type. What takes any value of one type is left with the pairs.
  const bool any = op() == Opcode::kPop;
  const bool same = InfoOf(op()).pops[0] == '*' && InfoOf(op()).pops[1] == '*';
  for (size_t i = 0; i < good.pops.size() && !any; ++i) {
    for (int type = 1; type <= static_cast<int>(ValueType::kLinkSet); ++type) {
      Use bad = good;
      bad.pops[i] = static_cast<ValueType>(type);
      if (bad.pops[i] == good.pops[i]) continue;
      EXPECT_NE(Verdict(op(), bad), "") << name() << " value " << i << " of type " << type;
    }
  }
  // Floats and sets are compared by nothing that compares bits.
  for (const ValueType type : {ValueType::kFloat, ValueType::kSet, ValueType::kJointSet}) {
    if (!same) break;
    Use bad = good;
    bad.pops = {type, type};
    EXPECT_EQ(Verdict(op(), bad), "values cannot be compared") << name();
  }
}

TEST_P(OperandTest, IsRefusedWhereTheStackHasNoRoomForWhatItPushes) {
  const Use good = GoodUse(op());
  if (good.pushes <= static_cast<int>(good.pops.size())) return;
  // The locals of the function take cells, too.
  const int room = kStackCells - kNumLocals - good.pushes;
  EXPECT_EQ(Verdict(op(), good, {.below = room}), "") << name();
  EXPECT_EQ(Verdict(op(), good, {.below = room + 1}), "task needs too many cells") << name();
  EXPECT_EQ(Verdict(op(), good, {.below = room + kNumLocals + 1}), "stack overflow") << name();
  EXPECT_EQ(Verdict(op(), good, {.below = kStackCells}), "stack overflow") << name();
}

TEST_P(OperandTest, IsRefusedInARequirementOrLabelUnlessItOnlyComputes) {
  // What returns without a result, or another one, is no end of a requirement.
  if (Returns(op())) return;
  const std::string wanted =
      InfoOf(op()).effect == Effect::kPure ? "" : "requirement or label acts on the module";
  for (const Place place :
       {Place::kRequirement, Place::kLabel, Place::kCalledByRequirement, Place::kCalledByLabel}) {
    EXPECT_EQ(Verdict(op(), GoodUse(op()), {.place = place}), wanted)
        << name() << " in place " << static_cast<int>(place);
  }
}

TEST_P(OperandTest, IsRefusedWithAJoinInItsOperand) {
  const Use good = GoodUse(op());
  EXPECT_EQ(Verdict(op(), good, {.join_in = 0}), "") << name() << " with a join before it";
  const auto bytes = static_cast<int>(OperandBytes(InfoOf(op()).operand));
  for (int at = 1; at <= bytes; ++at) {
    EXPECT_NE(Verdict(op(), good, {.join_in = at}), "") << name() << " with a join at byte " << at;
  }
}

/// The verdict for a text with these places, printed with values of these types.
std::string PrintVerdict(const std::string& text, const std::vector<ValueType>& values) {
  Code code;
  for (const ValueType type : values) code = code + Value(type);
  code = code + Op16(Opcode::kPrint, kTextConstant) + Op(Opcode::kReturn);
  TestImage image = Image(code, {}, ValueType::kVoid);
  // The text lies where the first keyword's name does.
  image.keywords[kJointKeyword].second = text;
  image.constants[kTextConstant].second = static_cast<uint32_t>(text.size()) << 16;
  return VerifyMessage(image.Build());
}

constexpr struct {
  ValueType type;
  char letter;
} kTypes[] = {
#define VALUE_TYPE(name, letter, word, phrase) {ValueType::name, letter},
#include "vm/image/value_types.def"
#undef VALUE_TYPE
};

TEST(PrintOperandTest, EachPlaceOfATextTakesAValueOfItsTypeAndNoOther) {
  int printable = 0;
  for (const auto& [type, letter] : kTypes) {
    if (type == ValueType::kVoid || type == ValueType::kText) continue;
    const std::string text = std::string("a {") + letter + "}";
    const bool prints = type <= ValueType::kLink || type == ValueType::kConnector;
    printable += prints ? 1 : 0;
    EXPECT_EQ(PrintVerdict(text, {type}), prints ? "" : "bad place of a value in a text") << text;
    EXPECT_NE(PrintVerdict(text, {}), "") << text << " without a value";
    EXPECT_NE(PrintVerdict(text, {type, type}), "") << text << " with one too many";
    for (int other = 1; other <= static_cast<int>(ValueType::kLinkSet); ++other) {
      if (static_cast<ValueType>(other) == type) continue;
      EXPECT_NE(PrintVerdict(text, {static_cast<ValueType>(other)}), "") << text << other;
    }
  }
  EXPECT_EQ(printable, 9);
  for (const char* text : {"{", "{i", "{}", "{v}", "{t}", "{ii}", "i {x}"}) {
    EXPECT_EQ(PrintVerdict(text, {}), "bad place of a value in a text") << text;
  }
}

TEST(PrintOperandTest, PlacesTakeTheirValuesInOrderAndAtMostSix) {
  const ValueType i = ValueType::kInt, f = ValueType::kFloat;
  EXPECT_EQ(PrintVerdict("{i}{f}", {i, f}), "");
  EXPECT_NE(PrintVerdict("{i}{f}", {f, i}), "");
  EXPECT_NE(PrintVerdict("{i}{f}", {f}), "");
  EXPECT_EQ(PrintVerdict("{{i}{i}", {i}), "") << "two braces are one of the text";
  std::string text;
  std::vector<ValueType> values;
  for (int count = 1; count <= kMaxPrintValues + 1; ++count) {
    text += "{i}";
    values.push_back(i);
    EXPECT_EQ(PrintVerdict(text, values),
              count <= kMaxPrintValues ? "" : "bad place of a value in a text");
  }
}

INSTANTIATE_TEST_SUITE_P(Instructions, OperandTest, ::testing::Range(0, kNumOpcodes));

}  // namespace
}  // namespace morphbus::vm
