#include "vm/run/interpreter.h"

#include <gtest/gtest.h>

#include <climits>
#include <cstring>
#include <memory>

#include "test/compiler/dynarole/fake_host.h"
#include "test/vm/image_builder.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

const Code kReturn = Op(Opcode::kReturn);
Code PushInt(int value) { return Op(Opcode::kPushInt8, {value}); }
Code Const(int index) { return Op16(Opcode::kPushConst, index); }

/// An image, verified, with a host, a role context and one task.
class Machine {
 public:
  explicit Machine(const TestImage& image) : bytes_(image.Build()) {
    const VerifyError error =
        Verifier::Verify(bytes_.data(), static_cast<uint32_t>(bytes_.size()), program_.get());
    EXPECT_EQ(error.message, nullptr) << error.message;
    context_.role = 0;
    context_.fields = fields;
    context_.labels = labels;
    for (int i = 0; i < program_->role(0).num_fields; ++i) fields[i] = program_->role(0).fields[i];
    std::fill(std::begin(labels), std::end(labels), int8_t{-1});
  }

  RunResult Run(int32_t budget = 1000) {
    int32_t left = budget;
    const RunResult result = RunTask(*program_, context_, host, &task, &left);
    used += budget - left;
    return result;
  }
  RunResult Start(int function = 0, std::vector<Cell> arguments = {}) {
    StartTask(*program_, function, arguments.data(), static_cast<int>(arguments.size()), &task);
    return Run();
  }
  RunResult Eval(int function, int32_t budget = 1000) {
    return Evaluate(*program_, function, context_, host, &budget);
  }
  [[nodiscard]] const VerifiedProgram& program() const { return *program_; }

  Cell fields[kMaxFields];
  int8_t labels[kMaxLabels];
  TaskState task;
  int32_t used = 0;

 private:
  std::vector<uint8_t> bytes_;
  std::unique_ptr<VerifiedProgram> program_ = std::make_unique<VerifiedProgram>();
  RoleContext context_;

 public:
  dynarole::FakeHost host{*program_};
};

/// Runs `op` on ints or floats that come from the constant table.
RunResult Apply(Opcode op, ValueType type, std::vector<uint32_t> operands, ValueType result) {
  TestImage image;
  image.functions[0].return_type = result;
  image.roles[0].startups.clear();
  for (const uint32_t bits : operands) {
    image.functions[0].code =
        image.functions[0].code + Const(static_cast<int>(image.constants.size()));
    image.constants.emplace_back(type, bits);
  }
  image.functions[0].code = image.functions[0].code + Op(op) + Op(Opcode::kReturnValue);
  return Machine(image).Start();
}

RunResult OnInts(Opcode op, int a, int b) {
  return Apply(op, ValueType::kInt, {static_cast<uint32_t>(a), static_cast<uint32_t>(b)},
               ValueType::kInt);
}
RunResult OnFloats(Opcode op, float a, float b) {
  return Apply(op, ValueType::kFloat, {Bits(a), Bits(b)}, ValueType::kFloat);
}

TEST(InterpreterTest, IntArithmeticIsExact) {
  EXPECT_EQ(OnInts(Opcode::kAddInt, 2000000000, 147483647).value.AsInt(), INT_MAX);
  EXPECT_EQ(OnInts(Opcode::kSubInt, -2000000000, 147483648).value.AsInt(), INT_MIN);
  EXPECT_EQ(OnInts(Opcode::kMulInt, 46341, -46340).value.AsInt(), -2147441940);
  EXPECT_EQ(OnInts(Opcode::kDivInt, -7, 2).value.AsInt(), -3);
  EXPECT_EQ(OnInts(Opcode::kModInt, -7, 2).value.AsInt(), -1);
  EXPECT_EQ(OnInts(Opcode::kModInt, 7, -2).value.AsInt(), 1);
  EXPECT_EQ(OnInts(Opcode::kModInt, INT_MIN, -1).value.AsInt(), 0);
  EXPECT_EQ(OnInts(Opcode::kDivInt, INT_MAX, -1).value.AsInt(), -INT_MAX);
}

TEST(InterpreterTest, IntOverflowIsAFault) {
  EXPECT_EQ(OnInts(Opcode::kAddInt, INT_MAX, 1).fault, FaultCode::kIntegerOverflow);
  EXPECT_EQ(OnInts(Opcode::kSubInt, INT_MIN, 1).fault, FaultCode::kIntegerOverflow);
  EXPECT_EQ(OnInts(Opcode::kMulInt, 65536, 32768).fault, FaultCode::kIntegerOverflow);
  EXPECT_EQ(OnInts(Opcode::kDivInt, INT_MIN, -1).fault, FaultCode::kIntegerOverflow);
  EXPECT_EQ(Apply(Opcode::kNegInt, ValueType::kInt, {0x80000000u}, ValueType::kInt).fault,
            FaultCode::kIntegerOverflow);
  EXPECT_EQ(OnInts(Opcode::kDivInt, 1, 0).fault, FaultCode::kDivisionByZero);
  EXPECT_EQ(OnInts(Opcode::kModInt, 1, 0).fault, FaultCode::kDivisionByZero);
}

TEST(InterpreterTest, RemaindersBySmallNumbersAreThoseByAnyNumber) {
  const auto by = [](int value, int divisor) {
    TestImage image;
    image.functions[0].return_type = ValueType::kInt;
    image.roles[0].startups.clear();
    image.constants = {{ValueType::kInt, static_cast<uint32_t>(value)}};
    image.functions[0].code =
        Const(0) + Op(Opcode::kModInt8, {divisor & 255}) + Op(Opcode::kReturnValue);
    return Machine(image).Start();
  };
  EXPECT_EQ(by(-7, 2).value.AsInt(), -1);
  EXPECT_EQ(by(7, -2).value.AsInt(), 1);
  EXPECT_EQ(by(INT_MAX, -128).value.AsInt(), 127);
  EXPECT_EQ(by(INT_MIN, -1).value.AsInt(), 0);
  EXPECT_EQ(by(1, 0).fault, FaultCode::kDivisionByZero);
}

TEST(InterpreterTest, FloatsStayFinite) {
  EXPECT_EQ(OnFloats(Opcode::kAddFloat, 3e38F, 3e38F).fault, FaultCode::kNotFinite);
  EXPECT_EQ(OnFloats(Opcode::kMulFloat, 1e30F, -1e30F).fault, FaultCode::kNotFinite);
  EXPECT_EQ(OnFloats(Opcode::kDivFloat, 1e30F, 1e-30F).fault, FaultCode::kNotFinite);
  EXPECT_EQ(OnFloats(Opcode::kDivFloat, 0, -0.0F).fault, FaultCode::kDivisionByZero);
  EXPECT_EQ(OnFloats(Opcode::kModFloat, 1, 0).fault, FaultCode::kDivisionByZero);
  EXPECT_EQ(OnFloats(Opcode::kModFloat, -7.5F, 2).value.AsFloat(), -1.5F);
  EXPECT_EQ(OnFloats(Opcode::kSubFloat, 0.5F, 2).value.AsFloat(), -1.5F);
}

TEST(InterpreterTest, ReadingsThatAreNotFiniteAreAFault) {
  TestImage image(Const(0) + Op(Opcode::kPop) + kReturn);
  image.constants = {{ValueType::kInt, 1}};
  image.functions[0].code =
      Op(Opcode::kKeyword, {0}) + Op(Opcode::kJointDegrees) + Op(Opcode::kPop) + kReturn;
  image.keywords = {{KeywordKind::kJoint, "JOINT_1"}};
  Machine machine(image);
  EXPECT_EQ(machine.Start().status, RunStatus::kFinished);
}

TEST(InterpreterTest, MissingKeywordAndUnresolvedLabelAreFaults) {
  TestImage image(Op(Opcode::kKeyword, {0}) + Op(Opcode::kPop) + kReturn);
  image.keywords = {{KeywordKind::kJoint, "NO_SUCH_JOINT"}};
  EXPECT_EQ(Machine(image).Start().fault, FaultCode::kMissingKeyword);

  TestImage labelled(Op(Opcode::kLoadLabel, {0}) + Op(Opcode::kPop) + kReturn);
  labelled.functions.push_back({"R.knee",
                                0,
                                ValueType::kJoint,
                                0,
                                {},
                                Const(0) + PushInt(1) + Op(Opcode::kJoints) +
                                    Op(Opcode::kOneJoint) + Op(Opcode::kReturnValue),
                                {}});
  labelled.constants = {{ValueType::kAxis, 0}};
  labelled.roles[0].labels = {{ValueType::kJoint, 1}};
  Machine machine(labelled);
  EXPECT_EQ(machine.Start().fault, FaultCode::kUnresolved);
  machine.labels[0] = 1;
  EXPECT_EQ(machine.Start().status, RunStatus::kFinished);
  EXPECT_EQ(machine.Eval(1).value.AsInt(), 0);
}

// Ten rounds of x += 1.5 that sleep after each.
TestImage SleepyLoop() {
  TestImage image(Const(0) + Op(Opcode::kStoreLocal, {0}) + PushInt(0) +
                  Op(Opcode::kStoreLocal, {1}) +
                  // 9:
                  Op(Opcode::kLoadLocal, {1}) + PushInt(10) + Op(Opcode::kLessInt) +
                  Op16(Opcode::kJumpIfFalse, 38) + Op(Opcode::kLoadLocal, {0}) + Const(1) +
                  Op(Opcode::kAddFloat) + Op(Opcode::kStoreLocal, {0}) +
                  Op(Opcode::kLoadLocal, {1}) + PushInt(1) + Op(Opcode::kAddInt) +
                  Op(Opcode::kStoreLocal, {1}) + Const(1) + Op(Opcode::kSleepDs));
  TestFunction& function = image.functions[0];
  function.code = function.code + Op16(Opcode::kJump, 9);
  const int end = static_cast<int>(function.code.size());
  // The jump out of the loop leads to its end.
  function.code[15] = static_cast<uint8_t>(end);
  function.code = function.code + Op(Opcode::kLoadLocal, {0}) + Op(Opcode::kReturnValue);
  function.locals = {ValueType::kFloat, ValueType::kInt};
  function.joins = {{9, 3, {}}, {end, 3, {}}};
  function.return_type = ValueType::kFloat;
  image.roles[0].startups.clear();
  image.constants = {{ValueType::kFloat, Bits(0.5F)}, {ValueType::kFloat, Bits(1.5F)}};
  return image;
}

TEST(InterpreterTest, WaitingTasksGoOnWhereTheyStopped) {
  Machine machine(SleepyLoop());
  RunResult result = machine.Start();
  int waits = 0;
  while (result.status == RunStatus::kWaiting) {
    ++waits;
    result = machine.Run();
  }
  EXPECT_EQ(waits, 10);
  EXPECT_EQ(result.status, RunStatus::kFinished);
  EXPECT_EQ(result.value.AsFloat(), 15.5F);
  EXPECT_EQ(machine.host.log.size(), 10u);
  EXPECT_EQ(machine.host.log[0], "sleep 150000 us");
}

TEST(InterpreterTest, SmallBudgetsOnlyDivideTheWork) {
  Machine whole(SleepyLoop());
  RunResult result = whole.Start();
  while (result.status == RunStatus::kWaiting) result = whole.Run();

  Machine sliced(SleepyLoop());
  StartTask(sliced.program(), 0, nullptr, 0, &sliced.task);
  int out_of_budget = 0;
  do {
    result = sliced.Run(5);
    if (result.status == RunStatus::kOutOfBudget) ++out_of_budget;
  } while (result.status != RunStatus::kFinished);
  EXPECT_GT(out_of_budget, 10);
  EXPECT_EQ(result.value.AsFloat(), 15.5F);
  EXPECT_EQ(sliced.used, whole.used);
  EXPECT_EQ(sliced.host.log, whole.host.log);
}

TEST(InterpreterTest, BudgetIsChargedByTheTable) {
  TestImage image(PushInt(1) + Op(Opcode::kIntToFloat) + Op(Opcode::kSleepCs) + kReturn);
  Machine machine(image);
  machine.Start();
  EXPECT_EQ(machine.used, InfoOf(Opcode::kPushInt8).cost + InfoOf(Opcode::kIntToFloat).cost +
                              InfoOf(Opcode::kSleepCs).cost);
}

TEST(InterpreterTest, ACopiedTaskRunsLikeTheOriginal) {
  Machine machine(SleepyLoop());
  machine.Start();
  machine.Run();
  TaskState copy;
  std::memcpy(&copy, &machine.task, sizeof(copy));
  Machine other(SleepyLoop());
  std::memcpy(&other.task, &copy, sizeof(copy));
  RunResult result = machine.Run(), from_copy = other.Run();
  while (result.status == RunStatus::kWaiting) {
    EXPECT_EQ(std::memcmp(&machine.task, &other.task, sizeof(copy)), 0);
    result = machine.Run();
    from_copy = other.Run();
  }
  EXPECT_EQ(from_copy.status, result.status);
  EXPECT_EQ(from_copy.value.bits, result.value.bits);
}

TEST(InterpreterTest, RunawayLoopEndsWithItsBudget) {
  TestImage image(Op16(Opcode::kJump, 0));
  image.functions[0].joins = {{0, 0, {}}};
  Machine machine(image);
  EXPECT_EQ(machine.Start().status, RunStatus::kOutOfBudget);
  EXPECT_EQ(machine.used, 1000);
}

TEST(InterpreterTest, EvaluationOutOfBudgetIsAFault) {
  TestImage image(Op16(Opcode::kJump, 0));
  image.functions[0].joins = {{0, 0, {}}};
  Machine machine(image);
  const RunResult result = machine.Eval(0, 50);
  EXPECT_EQ(result.status, RunStatus::kFaulted);
  EXPECT_EQ(result.fault, FaultCode::kBudget);
}

// go: return f(30, 12) + 1; f(a, b): c unset; return a - b
TEST(InterpreterTest, CallsPassArgumentsAndReturnValues) {
  TestImage image(PushInt(30) + PushInt(12) + Op(Opcode::kCall, {0}) + PushInt(1) +
                  Op(Opcode::kAddInt) + Op(Opcode::kReturnValue));
  image.functions[0].return_type = ValueType::kInt;
  image.roles[0].startups.clear();
  TestFunction method;
  method.name = "R.f";
  method.return_type = ValueType::kInt;
  method.num_arguments = 2;
  method.locals = {ValueType::kInt, ValueType::kInt, ValueType::kFloat};
  method.code = Op(Opcode::kLoadLocal, {0}) + Op(Opcode::kLoadLocal, {1}) + Op(Opcode::kSubInt) +
                Op(Opcode::kReturnValue);
  image.functions.push_back(method);
  image.roles[0].methods = {1};
  Machine machine(image);
  EXPECT_EQ(machine.Start().value.AsInt(), 19);
  EXPECT_EQ(machine.Start(1, {Cell::Int(5), Cell::Int(9)}).value.AsInt(), -4);
  EXPECT_EQ(machine.task.depth, 0);
}

TEST(InterpreterTest, FaultsOfTheHostEndTheTaskWhereTheyHappen) {
  TestImage image(PushInt(1) + Op(Opcode::kIntToFloat) + Op(Opcode::kSleepDs) + kReturn);
  image.lines = {{0, 7}, {3, 8}};
  Machine machine(image);
  machine.host.next_result.fault = FaultCode::kNoSuchValue;
  const RunResult result = machine.Start();
  EXPECT_EQ(result.status, RunStatus::kFaulted);
  EXPECT_EQ(result.fault, FaultCode::kNoSuchValue);
  EXPECT_EQ(result.pc, 3u);
  EXPECT_EQ(machine.program().LineOf(result.function, result.pc), 8);
  EXPECT_EQ(machine.program().LineOf(0, 2), 7);
  EXPECT_EQ(machine.program().LineOf(0, 100), 0);
  EXPECT_EQ(machine.program().LineOf(5, 0), 0);
}

TEST(InterpreterTest, FieldsAreReadAndWritten) {
  TestImage image(Op(Opcode::kLoadField, {0}) + PushInt(5) + Op(Opcode::kMulInt) +
                  Op(Opcode::kStoreField, {0}) + kReturn);
  image.roles[0].fields = {{ValueType::kInt, 7}};
  Machine machine(image);
  machine.Start();
  EXPECT_EQ(machine.fields[0].AsInt(), 35);
}

TEST(InterpreterTest, AbsurdSleepsAreBounded) {
  TestImage image(Const(0) + Op(Opcode::kSleepDs) + kReturn);
  image.constants = {{ValueType::kFloat, Bits(3e38F)}};
  Machine machine(image);
  machine.Start();
  EXPECT_EQ(machine.host.log[0], "sleep 3200000000000000 us");
}

TEST(InterpreterTest, OnlyFittingArgumentsAreAccepted) {
  TestImage image(kReturn);
  TestFunction command;
  command.num_arguments = 3;
  command.locals = {ValueType::kFloat, ValueType::kBool, ValueType::kRole};
  command.code = kReturn;
  image.functions.push_back(command);
  image.roles[0].commands = {1};
  const Machine machine(image);
  const VerifiedProgram& program = machine.program();
  const Cell good[] = {Cell::Float(1), Cell::Bool(true), Cell::Int(0)};
  EXPECT_TRUE(program.AcceptsArguments(1, good, 3));
  EXPECT_FALSE(program.AcceptsArguments(1, good, 2));
  EXPECT_FALSE(program.AcceptsArguments(9, good, 3));
  const Cell not_finite[] = {Cell{0x7fc00000u}, good[1], good[2]};
  EXPECT_FALSE(program.AcceptsArguments(1, not_finite, 3));
  const Cell odd_bool[] = {good[0], Cell{2}, good[2]};
  EXPECT_FALSE(program.AcceptsArguments(1, odd_bool, 3));
  const Cell no_role[] = {good[0], good[1], Cell::Int(1)};
  EXPECT_FALSE(program.AcceptsArguments(1, no_role, 3));
}

}  // namespace
}  // namespace morphbus::vm
