// Every instruction with every class of operand that it must not have: one that does not exist, one
// of another kind, one cut off or jumped into; too few values on the stack, each value of another
// type, no room for one more; and in a place where it may not be. As a control, each is accepted
// with what it should have.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "test/vm/operand_image.h"
#include "vm/image/opcodes.h"
#include "vm/limits.h"

namespace morphbus::vm {
namespace {

using Operand = std::vector<int>;

/// What an instruction should find: its operand, the values below it, what it leaves.
struct Use {
  Operand operand = {};
  std::vector<ValueType> pops = {};
  int pushes = 0;
};

/// Values of one part of an operand, each with the bytes of the part.
struct PartValues {
  Operand good;
  std::vector<Operand> bad;
};

/// Keywords: good is the one, bad are those of other kinds, but one that does as well.
PartValues KeywordValues(int good, int good_too) {
  PartValues values = {{good}, {{kNumKeywords}, {255}}};
  for (int keyword = 0; keyword < kNumKeywords; ++keyword) {
    if (keyword != good && keyword != good_too) values.bad.push_back({keyword});
  }
  return values;
}

/// What a part may name in the image, and what not.
PartValues ValuesOf(OperandPart part) {
  switch (part) {
    case OperandPart::kNone:
      return {};
    case OperandPart::kSignedByte:
      return {{5}, {}};
    case OperandPart::kConstant:
      return {{kInt, 0}, {{kTextConstant, 0}, {kNoConstant, 0}, {0, 1}, {255, 255}}};
    case OperandPart::kIntConstant:
      return {{kInt, 0}, {{kFloat, 0}, {kTextConstant, 0}, {kNoConstant, 0}, {0, 1}, {255, 255}}};
    case OperandPart::kText:
      return {{kTextConstant, 0}, {{kInt, 0}, {kNoConstant, 0}, {255, 255}}};
    // Reading one that is not set, or arithmetic with one of another type; values that are stored
    // are ints.
    case OperandPart::kLocal:
      return {{kIntLocal}, {{kNumLocals}, {255}, {kUnsetLocal}}};
    case OperandPart::kIntLocal:
      return {{kIntLocal}, {{kNumLocals}, {255}, {kUnsetLocal}, {kFloatLocal}}};
    case OperandPart::kStoredLocal:
      return {{kIntLocal}, {{kNumLocals}, {255}, {kFloatLocal}}};
    case OperandPart::kField:
      return {{0}, {{3}, {255}}};
    // All of them must be there, set, and of one type.
    case OperandPart::kLocalArray:
      return {{kIntLocal, 1},
              {{kIntLocal, 0},
               {kIntLocal, 2},
               {kUnsetLocal, 1},
               {kFloatLocal, 2},
               {kIntLocal, kNumLocals + 1},
               {kNumLocals, 1},
               {255, 255}}};
    case OperandPart::kFieldArray:
      return {{0, 2}, {{0, 0}, {0, 3}, {0, 4}, {3, 1}, {255, 255}}};
    case OperandPart::kLabel:
    case OperandPart::kMethod:
      return {{0}, {{2}, {255}}};
    // What is pushed may be a joint or a connector.
    case OperandPart::kPartKeyword:
      return KeywordValues(kJointKeyword, kConnectorKeyword);
    case OperandPart::kStateKeyword:
      return KeywordValues(kStateKeyword, kStateKeyword);
    case OperandPart::kSensorKeyword:
      return KeywordValues(kSensorKeyword, kSensorKeyword);
    case OperandPart::kSensorKindKeyword:
      return KeywordValues(kSensorKindKeyword, kSensorKindKeyword);
    // This one has neither commands nor fields.
    case OperandPart::kRole:
      return {{kBase}, {{kNumRoles}, {255}, {kOther}}};
    case OperandPart::kCommand:
      return {{0}, {{1}, {255}}};
    case OperandPart::kSharedField:
      return {{0}, {{1}, {2}, {255}}};
    case OperandPart::kSuperFunction:
      return {{kBaseMethod, 0}, {{7, 0}, {255, 255}, {kMethod, 0}, {kUnrelated, 0}}};
    // Which target is good depends on the code (Verdict). Bad ones lead into the instruction
    // itself, to where nothing is said of the state, and outside.
    case OperandPart::kTarget:
      return {{}, {{1, 0}, {0, 0}, {0, 1}, {255, 255}}};
  }
  return {};
}

/// The types that an instruction takes and how many it leaves, in this image: every variable,
/// constant, argument and result that an operand names is an int, and the text has no places.
Use GoodUse(Opcode op) {
  const OpcodeInfo& info = InfoOf(op);
  Use use;
  for (const Term term : info.pops) {
    if (term.letter() == Letter::kPlaces) continue;
    use.pops.push_back(term.type() == ValueType::kVoid ? ValueType::kInt : term.type());
  }
  use.pushes = info.pushes.size();
  for (const OperandPart part : InfoOf(info.operand).parts) {
    for (const int byte : ValuesOf(part).good) use.operand.push_back(byte);
  }
  return use;
}

/// Operands that the instruction must not have: in each one part is bad.
std::vector<Operand> BadOperands(Opcode op) {
  std::vector<Operand> operands;
  const OperandInfo& info = InfoOf(InfoOf(op).operand);
  for (int bad = 0; bad < kMostParts; ++bad) {
    for (const Operand& value : ValuesOf(info.parts[bad]).bad) {
      // A role alone may be any.
      if (InfoOf(op).operand == OperandKind::kOneRole && value == Operand{kOther}) continue;
      Operand operand;
      for (int i = 0; i < kMostParts; ++i) {
        const Operand part = i == bad ? value : ValuesOf(info.parts[i]).good;
        operand.insert(operand.end(), part.begin(), part.end());
      }
      operands.push_back(operand);
    }
  }
  return operands;
}

/// Whether a function ends with it.
bool Returns(Opcode op) { return InfoOf(op).flow == Flow::kReturn; }
/// Whether what it pops has such a term.
bool Pops(Opcode op, Letter wanted) {
  const auto& pops = InfoOf(op).pops;
  return std::any_of(pops.begin(), pops.end(),
                     [wanted](Term term) { return term.letter() == wanted; });
}

/// What the code around an instruction under test is like.
struct Around {
  Place place = Place::kTask;
  int below = 0;  ///< Ints on the stack below what the instruction takes.
  /// If not negative, a join stands so many bytes behind the beginning of the instruction.
  int join_in = -1;
};

/// The verifier's message for an instruction on this stack.
std::string Verdict(Opcode op, const Use& use, const Around& around = {}) {
  // What the instruction takes from the stack.
  Code before;
  for (int i = 0; i < around.below; ++i) before = before + Op(Opcode::kPushInt8, {1});
  for (const ValueType type : use.pops) before = before + Value(type);
  Operand operand = use.operand;
  std::vector<TestJoin> joins;
  if (around.join_in >= 0) {
    joins.push_back({static_cast<int>(before.size()) + around.join_in, 0, use.pops});
  }
  // A target that is left open is behind the instruction. What keeps its bool on the way there
  // finds something to skip, which leaves a bool, too.
  const OpcodeInfo& info = InfoOf(op);
  const bool keeps = info.flow == Flow::kKeep;
  const Code skipped = keeps ? Value(ValueType::kBool) : Code();
  if (operand.size() + 2 == OperandBytes(info.operand)) {
    const size_t behind = before.size() + 1 + OperandBytes(info.operand);
    const int target = static_cast<int>(behind + skipped.size());
    operand.insert(operand.end(), {(target + kBytesBefore) & 255, (target + kBytesBefore) >> 8});
    joins.push_back({target, 0, {}});
    if (keeps) joins.back().stack = {ValueType::kBool};
  }
  // What it leaves is dropped, and the function ends as one in its place does.
  Code code = before + Op(op, operand) + skipped;
  for (int i = 0; i < use.pushes + around.below; ++i) code = code + Op(Opcode::kPop);
  ValueType result = Pops(op, Letter::kOwnResult) ? ValueType::kInt : ValueType::kVoid;
  const bool itself = around.place == Place::kRequirement || around.place == Place::kLabel;
  if (itself) result = ResultIn(around.place);
  if (!Returns(op)) {
    code = code + (itself ? Value(result) + Op(Opcode::kReturnValue) : Op(Opcode::kReturn));
  }
  TestImage image = OperandImage(code, joins, result);
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
    EXPECT_NE(Verdict(op(), bad), "") << name() << " " << operand[0];
  }
  // Each byte of the operand may be the last of the image's code.
  for (size_t size = 0; size < OperandBytes(InfoOf(op()).operand); ++size) {
    Code code;
    for (const ValueType type : good.pops) code = code + Value(type);
    Operand part = good.operand;
    part.resize(size);
    EXPECT_EQ(VerifyMessage(OperandImage(code + Op(op(), part), {}, ValueType::kVoid).Build()),
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
  const bool any = Pops(op(), Letter::kAny);
  const bool same = Pops(op(), Letter::kComparable);
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

/// The verdict for a function that runs an instruction and returns what it has left, after it has
/// stored `above` values from over it in the float local.
std::string ResultVerdict(Opcode op, const Use& use, ValueType result, int above = 0) {
  Code code;
  for (const ValueType type : use.pops) code = code + Value(type);
  code = code + Op(op, use.operand);
  for (int i = 0; i < above; ++i) code = code + Op(Opcode::kStoreLocal, {kFloatLocal});
  return VerifyMessage(OperandImage(code + Op(Opcode::kReturnValue), {}, result).Build());
}

/// That what the instruction leaves is of this type and of no other.
void ExpectLeaves(Opcode op, const Use& use, ValueType type, int above = 0) {
  for (int other = 1; other <= static_cast<int>(ValueType::kLinkSet); ++other) {
    const auto result = static_cast<ValueType>(other);
    if (result == ValueType::kText) continue;
    EXPECT_EQ(ResultVerdict(op, use, result, above),
              result == type ? "" : "operand of the wrong type")
        << kOpcodeTexts[static_cast<int>(op)].mnemonic << " as " << other;
  }
}

TEST_P(OperandTest, LeavesAValueOfItsTypeAndOfNoOther) {
  const OpcodeInfo& info = InfoOf(op());
  if (info.pushes.size() != 1 || info.flow != Flow::kNext) return;
  const Term left = info.pushes[0];
  if (left.type() == ValueType::kVoid) return;  // Below, by what is named.
  ExpectLeaves(op(), GoodUse(op()), left.type());
}

TEST(OperandTypeTest, WhatAnOperandNamesHasTheTypeOfThatThing) {
  const auto i = ValueType::kInt, f = ValueType::kFloat;
  const ValueType constants[] = {
      i, f, ValueType::kBool, ValueType::kDirection, ValueType::kAxis, ValueType::kRole};
  for (int constant = 0; constant < kTextConstant; ++constant) {
    ExpectLeaves(Opcode::kPushConst, {{constant, 0}}, constants[constant]);
  }
  ExpectLeaves(Opcode::kLoadLocal, {{kIntLocal}}, i);
  ExpectLeaves(Opcode::kLoadLocal, {{kFloatLocal}}, f);
  ExpectLeaves(Opcode::kLoadLocals, {{kIntLocal, kFloatLocal}}, i, 1);
  ExpectLeaves(Opcode::kLoadLocals, {{kFloatLocal, kFloatLocal}}, f, 1);
  ExpectLeaves(Opcode::kLoadField, {{0}}, i);
  ExpectLeaves(Opcode::kLoadField, {{2}}, f);
  ExpectLeaves(Opcode::kLoadLocalElement, {{kIntLocal, 1}, {i}}, i);
  ExpectLeaves(Opcode::kLoadLocalElement, {{kFloatLocal, 1}, {i}}, f);
  ExpectLeaves(Opcode::kLoadFieldElement, {{0, 2}, {i}}, i);
  ExpectLeaves(Opcode::kLoadFieldElement, {{2, 1}, {i}}, f);
  ExpectLeaves(Opcode::kLoadLabel, {{0}}, ValueType::kJoint);
  ExpectLeaves(Opcode::kLoadLabel, {{1}}, ValueType::kLink);
  ExpectLeaves(Opcode::kKeyword, {{kJointKeyword}}, ValueType::kJoint);
  ExpectLeaves(Opcode::kKeyword, {{kConnectorKeyword}}, ValueType::kConnector);
  // A neighbour's field is one of the role that is named, whatever the own role has in its place.
  ExpectLeaves(Opcode::kNeighbourField, {{kBase, 0}, {ValueType::kSet}}, i);
  ExpectLeaves(Opcode::kNeighbourField, {{kSharing, 0}, {ValueType::kSet}}, f);
  ExpectLeaves(Opcode::kCall, {{0}, {i}}, i);
  ExpectLeaves(Opcode::kCallSuper, {{kBaseMethod, 0}, {i}}, i);
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
  TestImage image = OperandImage(code, {}, ValueType::kVoid);
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
