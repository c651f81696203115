#include "vm/image/verifier.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "test/vm/image_builder.h"
#include "vm/image/image.h"

namespace morphbus::vm {
namespace {

const Code kReturn = Op(Opcode::kReturn);
Code PushInt(int value) { return Op(Opcode::kPushInt8, {value}); }

std::string Verdict(const TestImage& image) { return VerifyMessage(image.Build()); }
std::string VerdictOnCode(const Code& code) { return Verdict(TestImage(code)); }

TEST(VerifierTest, SmallestProgramIsAccepted) {
  const std::vector<uint8_t> image = TestImage(kReturn).Build();
  const auto program = std::make_unique<VerifiedProgram>();
  const VerifyError error =
      Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), program.get());
  ASSERT_EQ(error.message, nullptr) << error.message;
  EXPECT_EQ(program->num_roles(), 1);
  EXPECT_EQ(program->num_functions(), 1);
  EXPECT_EQ(program->settle_ticks(), 10);
  EXPECT_EQ(program->size(), image.size());
  EXPECT_EQ(std::string(program->source_name().data, program->source_name().size), "test.dyn");
}

// ---- Frame ----

TEST(VerifierTest, EveryTruncationIsRefused) {
  const std::vector<uint8_t> image = TestImage(PushInt(1) + Op(Opcode::kPop) + kReturn).Build();
  const size_t run = image::ReadU32(image.data() + image::kSizeAt);
  for (size_t size = 0; size < image.size(); ++size) {
    // Without any notes it is what a module runs.
    std::vector<uint8_t> cut(image.begin(), image.begin() + static_cast<long>(size));
    if (size == run) {
      EXPECT_EQ(VerifyMessage(cut), "");
      continue;
    }
    EXPECT_NE(VerifyMessage(cut), "") << size;
    if (size < image::kHeaderBytes) continue;
    // The same with a header that admits the smaller size.
    for (size_t i = 0; i < 4; ++i) cut[8 + i] = static_cast<uint8_t>(size >> (8 * i));
    Rehash(&cut);
    EXPECT_NE(VerifyMessage(cut), "") << size;
  }
}

TEST(VerifierTest, RefusedProgramIsLeftEmpty) {
  const std::vector<uint8_t> good = TestImage(kReturn).Build();
  const std::vector<uint8_t> bad = TestImage(PushInt(1)).Build();
  const auto program = std::make_unique<VerifiedProgram>();
  Verifier::Verify(good.data(), static_cast<uint32_t>(good.size()), program.get());
  Verifier::Verify(bad.data(), static_cast<uint32_t>(bad.size()), program.get());
  EXPECT_EQ(program->size(), 0u);
  EXPECT_EQ(program->num_roles(), 0);
  EXPECT_EQ(program->num_functions(), 0);
}

TEST(VerifierTest, AnyFlippedBitBreaksTheHash) {
  std::vector<uint8_t> image = TestImage(kReturn).Build();
  for (size_t i = 0; i < image.size(); ++i) {
    image[i] ^= 1;
    EXPECT_NE(VerifyMessage(image), "") << i;
    image[i] ^= 1;
  }
}

TEST(VerifierTest, ForeignBytesAreNoImage) {
  std::vector<uint8_t> image = TestImage(kReturn).Build();
  image[0] = 'X';
  Rehash(&image);
  EXPECT_EQ(VerifyMessage(image), "not a program image");
  image = TestImage(kReturn).Build();
  image[image::kVersionAt] = 1;
  Rehash(&image);
  EXPECT_EQ(VerifyMessage(image), "image version is not known");
  EXPECT_EQ(VerifyMessage(std::vector<uint8_t>(kMaxImageBytes + 1)),
            "larger than any image may be");
}

TEST(VerifierTest, BudgetMustLetProgramsRun) {
  TestImage image(kReturn);
  image.budget = 1;
  EXPECT_EQ(Verdict(image), "instruction budget is out of range");
  image.budget = 0x80000000u;
  EXPECT_EQ(Verdict(image), "instruction budget is out of range");
}

TEST(VerifierTest, TextsHoldNoControlCharacters) {
  TestImage image(kReturn);
  image.source_name = "a\033[2J";
  EXPECT_EQ(Verdict(image), "control character in a text");
}

TEST(VerifierTest, ConstantsAreValuesOfTheirTypes) {
  const std::pair<ValueType, uint32_t> bad[] = {
      {ValueType::kFloat, Bits(std::numeric_limits<float>::infinity())},
      {ValueType::kFloat, Bits(std::nanf(""))},
      {ValueType::kBool, 2},
      {ValueType::kDirection, kNumDirections},
      {ValueType::kAxis, kNumAxes},
      {ValueType::kRole, 1},
      {ValueType::kJoint, 0},
      {ValueType::kSet, 0},
      {static_cast<ValueType>(99), 0}};
  for (const auto& constant : bad) {
    TestImage image(kReturn);
    image.constants = {constant};
    EXPECT_EQ(Verdict(image), "constant is not a value of its type")
        << static_cast<int>(constant.first);
  }
}

// ---- Code ----

TEST(VerifierTest, CodeMustEnd) {
  EXPECT_EQ(VerdictOnCode(PushInt(1) + Op(Opcode::kPop)), "function runs past its end");
  EXPECT_EQ(VerdictOnCode({}), "function runs past its end");
}

TEST(VerifierTest, UnknownAndCutOffInstructionsAreRejected) {
  EXPECT_EQ(VerdictOnCode({kNumOpcodes}), "unknown instruction");
  EXPECT_EQ(VerdictOnCode({255}), "unknown instruction");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kPushInt8)), "instruction is cut off");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kJump, {0})), "instruction is cut off");
}

TEST(VerifierTest, StackNeverRunsBelowOrAbove) {
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kPop) + kReturn), "stack underflow");
  EXPECT_EQ(VerdictOnCode(PushInt(1) + Op(Opcode::kAddInt) + kReturn), "stack underflow");
  Code code;
  for (int i = 0; i <= kStackCells; ++i) code = code + PushInt(1);
  EXPECT_EQ(VerdictOnCode(code + kReturn), "stack overflow");
}

TEST(VerifierTest, OperandsHaveTheRightTypes) {
  EXPECT_EQ(VerdictOnCode(PushInt(1) + Op(Opcode::kNot) + Op(Opcode::kPop) + kReturn),
            "operand of the wrong type");
  EXPECT_EQ(VerdictOnCode(PushInt(1) + Op(Opcode::kSleepDs) + kReturn),
            "operand of the wrong type");
  EXPECT_EQ(VerdictOnCode(PushInt(1) + Op(Opcode::kIntToFloat) + PushInt(1) + Op(Opcode::kEqual) +
                          Op(Opcode::kPop) + kReturn),
            "values cannot be compared");
}

TEST(VerifierTest, NothingIsLeftOnTheStackAtReturn) {
  EXPECT_EQ(VerdictOnCode(PushInt(1) + kReturn), "values left on the stack at return");
}

TEST(VerifierTest, ReturnFitsTheFunction) {
  EXPECT_EQ(VerdictOnCode(PushInt(1) + Op(Opcode::kReturnValue)), "return does not fit");
  TestImage image(kReturn);
  image.functions.push_back({"R.f", 0, ValueType::kInt, 0, {}, kReturn, {}});
  EXPECT_EQ(Verdict(image), "return does not fit");
}

TEST(VerifierTest, UnreachableInstructionsAreRejected) {
  EXPECT_EQ(VerdictOnCode(kReturn + kReturn), "unreachable instruction");
}

TEST(VerifierTest, JumpIntoOperandIsRejected) {
  // 0: push 5; 2: pop; 3: jump 1, which is the operand of the push.
  TestImage image(PushInt(5) + Op(Opcode::kPop) + Op16(Opcode::kJump, 1));
  image.functions[0].joins = {{1, 0, {}}};
  EXPECT_EQ(Verdict(image), "jump into an instruction");
}

TEST(VerifierTest, JumpOutsideTheFunctionIsRejected) {
  TestImage image(Op16(Opcode::kJump, 3));
  image.functions[0].joins = {{3, 0, {}}};
  EXPECT_EQ(Verdict(image), "target of a jump is not among the joins");
}

TEST(VerifierTest, JumpWithoutJoinIsRejected) {
  EXPECT_EQ(VerdictOnCode(Op16(Opcode::kJump, 0)), "target of a jump is not among the joins");
}

TEST(VerifierTest, EndlessLoopIsAccepted) {
  TestImage image(Op16(Opcode::kJump, 0));
  image.functions[0].joins = {{0, 0, {}}};
  EXPECT_EQ(Verdict(image), "");
}

TEST(VerifierTest, LoopThatGrowsTheStackIsRejected) {
  TestImage image(PushInt(1) + Op16(Opcode::kJump, 0));
  image.functions[0].joins = {{0, 0, {}}};
  EXPECT_EQ(Verdict(image), "stack differs at a join");
}

// if (true) push 1 else push 1.0; pop; return
TEST(VerifierTest, TypesDifferingAtAJoinAreRejected) {
  TestImage image(Op16(Opcode::kPushConst, 0) + Op16(Opcode::kJumpIfFalse, 11) + PushInt(1) +
                  Op16(Opcode::kJump, 14) + Op16(Opcode::kPushConst, 1) + Op(Opcode::kPop) +
                  kReturn);
  image.constants = {{ValueType::kBool, 1}, {ValueType::kFloat, Bits(1)}};
  image.functions[0].joins = {{11, 0, {}}, {14, 0, {ValueType::kInt}}};
  EXPECT_EQ(Verdict(image), "stack differs at a join");
  image.constants[1] = {ValueType::kInt, 7};
  EXPECT_EQ(Verdict(image), "");
}

TEST(VerifierTest, LocalsAreSetBeforeTheyAreRead) {
  TestImage image(Op(Opcode::kLoadLocal, {0}) + Op(Opcode::kPop) + kReturn);
  image.functions[0].locals = {ValueType::kInt};
  EXPECT_EQ(Verdict(image), "local is read before it is set");
  image.functions[0].code = PushInt(1) + Op(Opcode::kStoreLocal, {0}) + image.functions[0].code;
  EXPECT_EQ(Verdict(image), "");
  image.functions[0].code = Op(Opcode::kLoadLocal, {1}) + Op(Opcode::kPop) + kReturn;
  EXPECT_EQ(Verdict(image), "no such local");
}

// if (true) x = 1; read x
TEST(VerifierTest, LocalSetOnOneWayOnlyIsRejected) {
  TestImage image(Op16(Opcode::kPushConst, 0) + Op16(Opcode::kJumpIfFalse, 10) + PushInt(1) +
                  Op(Opcode::kStoreLocal, {0}) + Op(Opcode::kLoadLocal, {0}) + Op(Opcode::kPop) +
                  kReturn);
  image.constants = {{ValueType::kBool, 1}};
  image.functions[0].locals = {ValueType::kInt};
  image.functions[0].joins = {{10, 1, {}}};
  EXPECT_EQ(Verdict(image), "local is not set on every way to a join");
  image.functions[0].joins = {{10, 0, {}}};
  EXPECT_EQ(Verdict(image), "local is read before it is set");
}

TEST(VerifierTest, JoinsAreSorted) {
  TestImage image(Op16(Opcode::kJump, 3) + Op16(Opcode::kJump, 0));
  image.functions[0].joins = {{3, 0, {}}, {0, 0, {}}};
  EXPECT_EQ(Verdict(image), "joins are not sorted");
}

TEST(VerifierTest, LinesAreSortedAndPointIntoTheCode) {
  TestImage image(PushInt(1) + Op(Opcode::kPop) + kReturn);
  image.lines = {{2, 5}, {0, 4}};
  EXPECT_EQ(Verdict(image), "lines are not sorted");
  image.lines = {{4, 5}};
  EXPECT_EQ(Verdict(image), "line of no instruction");
}

TEST(VerifierTest, EveryLocalHasANameInTheNotes) {
  TestImage image(PushInt(1) + Op(Opcode::kStoreLocal, {1}) + kReturn);
  image.functions[0].locals = {ValueType::kInt, ValueType::kInt};
  std::vector<uint8_t> bytes = image.Build();
  const auto program = std::make_unique<VerifiedProgram>();
  ASSERT_EQ(
      Verifier::Verify(bytes.data(), static_cast<uint32_t>(bytes.size()), program.get()).message,
      nullptr);
  const Text name = program->local_name(0, 1);
  EXPECT_EQ(std::string(name.data, name.size), "local_1");
  // The notes say how many there are, behind their magic and two counts.
  const size_t count_at = program->run_size() + 8;
  EXPECT_EQ(bytes[count_at], 2);
  const std::vector<uint8_t> sound = bytes;
  // With one less the size does not fit.
  bytes[count_at] = 1;
  Rehash(&bytes);
  EXPECT_EQ(VerifyMessage(bytes), "notes have another size");
  // Without the name's record the size fits, and the names do not.
  bytes.resize(bytes.size() - 3);
  Rehash(&bytes);
  EXPECT_EQ(VerifyMessage(bytes), "notes name other locals");
  // A name that lies outside the strings.
  bytes = sound;
  bytes[bytes.size() - 3] = 0xff;
  Rehash(&bytes);
  EXPECT_NE(VerifyMessage(bytes), "");
  // Without notes there are no names.
  bytes.assign(sound.begin(), sound.begin() + static_cast<std::ptrdiff_t>(count_at - 8));
  ASSERT_EQ(
      Verifier::Verify(bytes.data(), static_cast<uint32_t>(bytes.size()), program.get()).message,
      nullptr);
  EXPECT_EQ(program->local_name(0, 1).size, 0);
}

TEST(VerifierTest, AnImageOfTheVersionBeforeIsRefused) {
  std::vector<uint8_t> bytes = TestImage(kReturn).Build();
  bytes[4] = 2;
  Rehash(&bytes);
  EXPECT_EQ(VerifyMessage(bytes), "image version is not known");
}

TEST(VerifierTest, SlotsMustExist) {
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kLoadField, {0}) + Op(Opcode::kPop) + kReturn),
            "no such field");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kLoadLabel, {0}) + Op(Opcode::kPop) + kReturn),
            "no such label");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kKeyword, {0}) + Op(Opcode::kPop) + kReturn),
            "no such keyword");
  EXPECT_EQ(VerdictOnCode(Op16(Opcode::kPushConst, 0) + Op(Opcode::kPop) + kReturn),
            "no such constant");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kCall, {0}) + kReturn), "no such function");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kInvoke, {1, 0}) + kReturn), "no such role");
  EXPECT_EQ(VerdictOnCode(Op(Opcode::kInvoke, {0, 0}) + kReturn), "no such command");
}

TEST(VerifierTest, KeywordsAreUsedAsWhatTheyName) {
  TestImage image(Op(Opcode::kKeyword, {0}) + Op(Opcode::kPop) + kReturn);
  image.keywords = {{KeywordKind::kConnectorState, "EXTENDED"}};
  EXPECT_EQ(Verdict(image), "keyword names no part");
  image.functions[0].code = Op(Opcode::kKeyword, {0}) + Op16(Opcode::kPushConst, 0) +
                            Op(Opcode::kSetStateBool, {0}) + kReturn;
  image.constants = {{ValueType::kBool, 1}};
  image.keywords = {{KeywordKind::kConnector, "C1"}};
  EXPECT_EQ(Verdict(image), "keyword names no state variable");
}

// ---- Calls ----

TEST(VerifierTest, ArityAndTypesOfCallsAreChecked) {
  TestFunction takes_int;
  takes_int.num_arguments = 1;
  takes_int.locals = {ValueType::kInt};
  takes_int.code = kReturn;
  EXPECT_EQ(Verdict(WithMethod(Op(Opcode::kCall, {0}) + kReturn, takes_int)), "stack underflow");
  EXPECT_EQ(Verdict(WithMethod(PushInt(3) + Op(Opcode::kCall, {0}) + kReturn, takes_int)), "");
  EXPECT_EQ(
      Verdict(WithMethod(PushInt(3) + Op(Opcode::kIntToFloat) + Op(Opcode::kCall, {0}) + kReturn,
                         takes_int)),
      "operand of the wrong type");
}

TEST(VerifierTest, ArityOfInvocationsIsChecked) {
  TestImage image(Op(Opcode::kInvoke, {0, 0}) + kReturn);
  TestFunction command;
  command.num_arguments = 1;
  command.locals = {ValueType::kFloat};
  command.code = kReturn;
  image.functions.push_back(command);
  image.roles[0].commands = {1};
  EXPECT_EQ(Verdict(image), "stack underflow");
}

TEST(VerifierTest, ArgumentsThatCannotTravelAreRejected) {
  TestImage image(kReturn);
  TestFunction command;
  command.num_arguments = 1;
  command.locals = {ValueType::kJoint};
  command.code = kReturn;
  image.functions.push_back(command);
  image.roles[0].commands = {1};
  EXPECT_EQ(Verdict(image), "argument of a command cannot travel");
}

TEST(VerifierTest, RecursionIsRejected) {
  TestFunction itself;
  itself.code = Op(Opcode::kCall, {0}) + kReturn;
  EXPECT_EQ(Verdict(WithMethod(Op(Opcode::kCall, {0}) + kReturn, itself)),
            "functions call each other in a circle");
}

// R.f is harmless, but its override in S calls slot 1, whose function calls slot 0 again.
TEST(VerifierTest, RecursionThroughASubroleIsRejected) {
  TestImage image(Op(Opcode::kCall, {0}) + kReturn);
  TestFunction harmless, calls_first, calls_second;
  harmless.code = kReturn;
  calls_first.code = Op(Opcode::kCall, {0}) + kReturn;
  calls_second.code = Op(Opcode::kCall, {1}) + kReturn;
  image.functions.push_back(harmless);
  image.functions.push_back(calls_first);
  image.roles[0].methods = {1, 2};
  EXPECT_EQ(Verdict(image), "");
  TestRole sub;
  sub.name = "S";
  sub.parent = 0;
  sub.depth = 1;
  sub.startups = {0};
  calls_second.role = 1;
  image.functions.push_back(calls_second);
  sub.methods = {3, 2};
  image.roles.push_back(sub);
  EXPECT_EQ(Verdict(image), "functions call each other in a circle");
}

TEST(VerifierTest, CallDepthIsBounded) {
  for (const int length : {kMaxCallDepth - 1, kMaxCallDepth}) {
    TestImage image(Op(Opcode::kCall, {0}) + kReturn);
    image.roles[0].methods.clear();
    for (int i = 0; i < length; ++i) {
      TestFunction function;
      function.code = i + 1 < length ? Op(Opcode::kCall, {i + 1}) + kReturn : kReturn;
      image.functions.push_back(function);
      image.roles[0].methods.push_back(i + 1);
    }
    EXPECT_EQ(Verdict(image), length < kMaxCallDepth ? "" : "calls nest too deep") << length;
  }
}

TEST(VerifierTest, CellsOfNestedCallsAreBounded) {
  Code deep;
  for (int i = 0; i < 25; ++i) deep = deep + PushInt(1);
  for (int i = 0; i < 25; ++i) deep = deep + Op(Opcode::kPop);
  TestFunction method;
  method.code = deep + kReturn;
  EXPECT_EQ(Verdict(WithMethod(kReturn, method)), "");
  EXPECT_EQ(Verdict(WithMethod(deep + Op(Opcode::kCall, {0}) + kReturn, method)),
            "task needs too many cells");
}

}  // namespace
}  // namespace morphbus::vm
