// The parts of the verifier that look at code, each by itself: states of the stack, joins,
// operands, what instructions take and leave.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "test/vm/image_builder.h"
#include "vm/image/code_state.h"
#include "vm/image/join_table.h"
#include "vm/image/operand_checker.h"
#include "vm/image/role_tree.h"
#include "vm/image/stack_effect.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

/// "" for nothing wrong.
std::string Said(const char* problem) { return problem == nullptr ? "" : problem; }

/// An image that has been verified, with its bytes.
class Verified {
 public:
  explicit Verified(const TestImage& image) : bytes_(image.Build()) {
    const VerifyError error =
        Verifier::Verify(bytes_.data(), static_cast<uint32_t>(bytes_.size()), program_.get());
    EXPECT_EQ(Said(error.message), "");
    tree_.Plant(*program_);
  }
  [[nodiscard]] const VerifiedProgram& program() const { return *program_; }
  [[nodiscard]] const RoleTree& tree() const { return tree_; }

 private:
  std::vector<uint8_t> bytes_;
  std::unique_ptr<VerifiedProgram> program_ = std::make_unique<VerifiedProgram>();
  RoleTree tree_;
};

TEST(CodeStateTest, BeginsWithItsArgumentsOnly) {
  const CodeState state = CodeState::AtBegin(3);
  EXPECT_EQ(state.set_locals, 0b111);
  EXPECT_EQ(state.depth, 0);
}

TEST(CodeStateTest, TheStackHasABottomATopAndTypes) {
  CodeState state;
  EXPECT_EQ(Said(state.Pop(ValueType::kInt)), "stack underflow");
  for (int i = 0; i < kStackCells; ++i) EXPECT_EQ(Said(state.Push(ValueType::kInt)), "");
  EXPECT_EQ(Said(state.Push(ValueType::kInt)), "stack overflow");
  EXPECT_EQ(Said(state.Pop(ValueType::kBool)), "operand of the wrong type");
  ValueType type{};
  EXPECT_EQ(Said(state.PopAny(&type)), "");
  EXPECT_EQ(type, ValueType::kInt);
  EXPECT_EQ(state.depth, kStackCells - 2);
}

/// A loop without end: a bool lies on the stack at its target, local 0 is set.
TestImage Loop() {
  TestImage image(Op(Opcode::kPushInt8, {1}) + Op(Opcode::kStoreLocal, {0}) +
                  Op(Opcode::kLoadLocal, {0}) + Op16(Opcode::kJump, 6));
  image.functions[0].locals = {ValueType::kInt};
  image.functions[0].joins = {{6, 1, {ValueType::kInt}}};
  return image;
}

TEST(JoinTableTest, FindsTheTargetsInTheCode) {
  const Verified image(Loop());
  const JoinTable joins(image.program().bytes());
  const uint32_t begin = image.program().function(0).code_begin;
  ASSERT_EQ(joins.count(), 1U);
  EXPECT_EQ(joins.target(0), begin + 6);
  EXPECT_EQ(joins.FirstFrom(begin), 0U);
  EXPECT_EQ(joins.FirstFrom(begin + 6), 0U);
  EXPECT_EQ(joins.FirstFrom(begin + 7), 1U);
}

TEST(JoinTableTest, WhatArrivesMayKnowMoreAndNeverLess) {
  const Verified image(Loop());
  const JoinTable joins(image.program().bytes());
  CodeState state = joins.StateAt(0);
  EXPECT_EQ(state.depth, 1);
  EXPECT_EQ(state.types[0], ValueType::kInt);
  EXPECT_EQ(state.set_locals, 1);
  EXPECT_EQ(Said(joins.ProblemOf(0, state)), "");
  state.set_locals = 3;
  EXPECT_EQ(Said(joins.ProblemOf(0, state)), "");
  state.set_locals = 2;
  EXPECT_EQ(Said(joins.ProblemOf(0, state)), "local is not set on every way to a join");
  state = joins.StateAt(0);
  state.types[0] = ValueType::kBool;
  EXPECT_EQ(Said(joins.ProblemOf(0, state)), "stack differs at a join");
  state.depth = image::kMaxJoinDepth + 1;
  EXPECT_EQ(Said(joins.ProblemOf(0, state)), "stack too deep at a join");
}

/// A role with a keyword and a method, and one that extends it and replaces the method.
TestImage TwoRoles() {
  TestImage image(kLeave);
  image.keywords = {{KeywordKind::kJoint, "JOINT_1"}, {KeywordKind::kConnectorState, "EXTENDED"}};
  TestFunction method;
  method.code = kLeave;
  method.num_arguments = 1;
  method.locals = {ValueType::kInt, ValueType::kBool};
  image.functions.push_back(method);
  method.role = 1;
  image.functions.push_back(method);
  image.roles[0].methods = {1};
  TestRole sub;
  sub.name = "S";
  sub.parent = 0;
  sub.depth = 1;
  sub.startups = {0};
  sub.methods = {2};
  image.roles.push_back(sub);
  return image;
}

class OperandCheckerTest : public testing::Test {
 protected:
  /// What is said of an operand of the method in the second role.
  std::string Check(OperandKind kind, const std::vector<uint8_t>& bytes) {
    const FunctionInfo function = image_.program().function(2);
    const JoinTable joins(image_.program().bytes());
    OperandChecker operands(image_.program(), image_.tree(), joins, function, &facts_);
    return Said(operands.Check(kind, bytes.data(), &state_, &named_));
  }

  Verified image_{TwoRoles()};
  CodeFacts facts_;
  CodeState state_ = CodeState::AtBegin(1);
  NamedOperand named_;
};

TEST_F(OperandCheckerTest, NotesTheKeywordsThatAreNamed) {
  EXPECT_EQ(Check(OperandKind::kPartKeyword, {0}), "");
  EXPECT_EQ(named_.types[0], ValueType::kJoint);
  EXPECT_EQ(facts_.keywords, 1U);
  EXPECT_EQ(Check(OperandKind::kStateKeyword, {1}), "");
  EXPECT_EQ(facts_.keywords, 3U);
  EXPECT_EQ(Check(OperandKind::kStateKeyword, {0}), "keyword names no state variable");
  EXPECT_EQ(Check(OperandKind::kSensorKeyword, {1}), "keyword names no sensor");
  EXPECT_EQ(Check(OperandKind::kPartKeyword, {1}), "keyword names no part");
  EXPECT_EQ(Check(OperandKind::kPartKeyword, {2}), "no such keyword");
}

TEST_F(OperandCheckerTest, NotesTheSlotsThatAreCalled) {
  EXPECT_EQ(Check(OperandKind::kMethod, {0}), "");
  EXPECT_EQ(named_.number, 2U) << "the own role's, whose types all subroles keep";
  EXPECT_EQ(facts_.methods_called, 1);
  EXPECT_EQ(Check(OperandKind::kMethod, {1}), "no such function");
}

TEST_F(OperandCheckerTest, OneFunctionOfARoleAboveMayBeCalledAsTheOneReplaced) {
  EXPECT_EQ(Check(OperandKind::kSuperFunction, {2, 0}),
            "function of a role that the own one does not extend");
  EXPECT_EQ(facts_.super_called, 0);
  EXPECT_EQ(Check(OperandKind::kSuperFunction, {1, 0}), "");
  EXPECT_EQ(facts_.super_called, 2);
  EXPECT_EQ(Check(OperandKind::kSuperFunction, {1, 0}), "");
  EXPECT_EQ(Check(OperandKind::kSuperFunction, {0, 0}), "function calls two that it replaces");
  EXPECT_EQ(Check(OperandKind::kSuperFunction, {3, 0}), "no such function");
}

TEST_F(OperandCheckerTest, LocalsAreReadOnceTheyHaveBeenWritten) {
  EXPECT_EQ(Check(OperandKind::kLocals, {0, 1}), "local is read before it is set");
  EXPECT_EQ(Check(OperandKind::kStoredLocal, {1}), "");
  EXPECT_EQ(Check(OperandKind::kLocals, {0, 1}), "");
  EXPECT_EQ(named_.types[0], ValueType::kInt);
  EXPECT_EQ(named_.types[1], ValueType::kBool);
  EXPECT_EQ(Check(OperandKind::kIntLocal, {1}), "operand of the wrong type");
}

class StackEffectTest : public OperandCheckerTest {
 protected:
  /// What is said of an instruction's effect on the stack.
  std::string Apply(Opcode op) {
    const FunctionInfo function = image_.program().function(2);
    StackEffect effect(image_.program(), function, InfoOf(op), named_);
    const char* problem = effect.Take(&state_);
    return Said(problem != nullptr ? problem : effect.Leave(&state_));
  }
};

TEST_F(StackEffectTest, TakesAndLeavesWhatTheLettersSay) {
  ASSERT_EQ(Said(state_.Push(ValueType::kInt)), "");
  EXPECT_EQ(Apply(Opcode::kAddInt), "stack underflow");
  ASSERT_EQ(Said(state_.Push(ValueType::kInt)), "");
  ASSERT_EQ(Said(state_.Push(ValueType::kInt)), "");
  EXPECT_EQ(Apply(Opcode::kAddInt), "");
  EXPECT_EQ(state_.depth, 1);
  EXPECT_EQ(state_.types[0], ValueType::kInt);
}

TEST_F(StackEffectTest, ComparesValuesOfOneTypeThatHasBits) {
  const auto compared = [this](ValueType left, ValueType right) {
    state_.depth = 0;
    EXPECT_EQ(Said(state_.Push(left)), "");
    EXPECT_EQ(Said(state_.Push(right)), "");
    return Apply(Opcode::kEqual);
  };
  EXPECT_EQ(compared(ValueType::kInt, ValueType::kInt), "");
  EXPECT_EQ(state_.types[0], ValueType::kBool);
  EXPECT_EQ(compared(ValueType::kInt, ValueType::kBool), "values cannot be compared");
  EXPECT_EQ(compared(ValueType::kFloat, ValueType::kFloat), "values cannot be compared");
  EXPECT_EQ(compared(ValueType::kSet, ValueType::kSet), "values cannot be compared");
}

TEST_F(StackEffectTest, ACallTakesTheArgumentsOfWhatIsNamed) {
  ASSERT_EQ(Check(OperandKind::kMethod, {0}), "");
  ASSERT_EQ(Said(state_.Push(ValueType::kFloat)), "");
  EXPECT_EQ(Apply(Opcode::kCall), "operand of the wrong type");
  state_.depth = 0;
  ASSERT_EQ(Said(state_.Push(ValueType::kInt)), "");
  EXPECT_EQ(Apply(Opcode::kCall), "");
  EXPECT_EQ(state_.depth, 0) << "it has no result";
}

}  // namespace
}  // namespace morphbus::vm
