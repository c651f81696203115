// The parts of the checker, each by itself: messages and settled types of a pass, names in scope,
// conversions, operators, parts of the module, ends of statements, calls of a whole program.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "compiler/dynarole/check_pass.h"
#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/conversions.h"
#include "compiler/dynarole/operator_checker.h"
#include "compiler/dynarole/parser.h"
#include "compiler/dynarole/part_checker.h"
#include "compiler/dynarole/program_checks.h"
#include "compiler/dynarole/scope.h"
#include "compiler/dynarole/statement_flow.h"
#include "test/compiler/dynarole/fake_host.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {
namespace {

/// An expression without operands that has a type already.
ExprPtr Typed(Type type) {
  auto expr = std::make_unique<Expr>();
  expr->kind = ExprKind::kName;
  expr->type = type;
  return expr;
}

/// The model of a program, of whose code nothing is known yet.
class CheckerPartsTest : public testing::Test {
 protected:
  void Make(const std::string& text) {
    const int file = sources_.AddText("test.dyn", text);
    const std::vector<Token> tokens = Tokenize(sources_, file, &diagnostics_);
    program_ = Parse(sources_, file, tokens, &diagnostics_);
    model_ = BuildModel(&program_, &diagnostics_);
    ASSERT_FALSE(diagnostics_.had_errors()) << Render(diagnostics_, sources_, false);
  }
  /// What was said last; "" if nothing was.
  [[nodiscard]] std::string Said() const {
    return diagnostics_.all().empty() ? "" : diagnostics_.all().back().message;
  }

  source::SourceSet sources_;
  source::Diagnostics diagnostics_;
  Program program_;
  ProgramModel model_;
  CheckPass pass_{&diagnostics_};
  Scope scope_{&model_, &pass_};
  Conversions conversions_{&scope_, &pass_};
};

TEST_F(CheckerPartsTest, MessagesAreRecordedInTheFinalPassOnly) {
  pass_.Begin(Phase::kCalls);
  EXPECT_EQ(pass_.Wrong({}, "too early", "a hint"), Type::kError);
  EXPECT_TRUE(diagnostics_.all().empty());
  pass_.Begin(Phase::kFinal);
  pass_.Wrong({}, "in time", "a hint");
  ASSERT_EQ(diagnostics_.all().size(), 1U);
  EXPECT_EQ(diagnostics_.all()[0].hint, "a hint");
  for (int i = 0; i < 200; ++i) pass_.Warning({}, "again");
  EXPECT_EQ(diagnostics_.all().size(), 101U) << "of warnings a hundred are enough";
}

TEST_F(CheckerPartsTest, ATypeIsSettledOnceAndBeforeTheFinalPass) {
  Type type = Type::kUnknown;
  EXPECT_FALSE(pass_.Settle(&type, Type::kInt)) << "this is the final pass";
  pass_.Begin(Phase::kBodies);
  EXPECT_FALSE(pass_.Settle(&type, Type::kError));
  EXPECT_FALSE(pass_.changed());
  EXPECT_TRUE(pass_.Settle(&type, Type::kInt));
  EXPECT_FALSE(pass_.Settle(&type, Type::kFloat));
  EXPECT_EQ(type, Type::kInt);
  EXPECT_TRUE(pass_.changed());
  pass_.Begin(Phase::kCalls);
  EXPECT_FALSE(pass_.changed());
}

TEST_F(CheckerPartsTest, NamesAreThoseOfTheRoutine) {
  Make("role R extends Module { near = 1; function f(a) { return a; } startup s() {} }");
  const int f = model_.roles[0].methods[0].routine;
  scope_.EnterRoutine(f);
  EXPECT_EQ(scope_.AddLocal("a", {}, Type::kInt, true), 0);
  EXPECT_EQ(scope_.AddLocal("b", {}, Type::kFloat, false), 1);
  ASSERT_NE(scope_.FindLocal("b"), nullptr);
  EXPECT_EQ(scope_.FindLocal("b")->slot, 1);
  EXPECT_EQ(scope_.Names(), (std::vector<std::string>{"a", "b", "near"}));
  scope_.Close(1);
  EXPECT_EQ(Said(), "variable 'b' is never used");
  EXPECT_EQ(scope_.FindLocal("b"), nullptr);
  EXPECT_EQ(scope_.AddLocal("b", {}, Type::kInt, false), 2) << "no slot is used again";
  scope_.AddLocal("b", {}, Type::kInt, false);
  EXPECT_EQ(Said(), "'b' is declared twice");
  while (model_.routines[f].locals.size() < vm::image::kMaxLocals) {
    scope_.AddLocal("v" + std::to_string(model_.routines[f].locals.size()), {}, Type::kInt, false);
  }
  scope_.AddLocal("over", {}, Type::kInt, false);
  EXPECT_EQ(Said(), "too many variables and parameters");
  // A value sees no variables.
  scope_.EnterValue(0);
  EXPECT_EQ(scope_.FindLocal("a"), nullptr);
  EXPECT_FALSE(scope_.InTask());
}

TEST_F(CheckerPartsTest, WhatIsWantedConvertsOrIsReported) {
  const ExprPtr whole = Typed(Type::kInt);
  conversions_.Want(whole.get(), Type::kFloat, "this");
  EXPECT_EQ(whole->wanted, Type::kFloat);
  EXPECT_EQ(Said(), "");
  const ExprPtr number = Typed(Type::kFloat);
  conversions_.Want(number.get(), Type::kInt, "this");
  EXPECT_EQ(Said(), "this must be an int, but this is a float");
  EXPECT_EQ(number->type, Type::kError) << "one message is enough";
  conversions_.Want(number.get(), Type::kBool, "this");
  EXPECT_EQ(diagnostics_.all().size(), 1U);
}

TEST_F(CheckerPartsTest, WhatIsWantedTellsTheTypeOfAParameter) {
  Make("role R extends Module { function f(a) { return a; } startup s() {} }");
  scope_.EnterRoutine(model_.roles[0].methods[0].routine);
  scope_.AddLocal("a", {}, Type::kUnknown, true);
  const ExprPtr parameter = Typed(Type::kUnknown);
  parameter->meaning = Meaning::kLocal;
  parameter->index = 0;
  pass_.Begin(Phase::kBodies);
  conversions_.Want(parameter.get(), Type::kAxis, "this");
  EXPECT_EQ(scope_.signature().parameters[0], Type::kAxis);
  EXPECT_EQ(scope_.routine()->locals[0], Type::kAxis);
}

TEST_F(CheckerPartsTest, OperatorsHaveTheTypesOfTheirOperands) {
  OperatorChecker operators(&scope_, &conversions_, &pass_);
  const auto type_of = [&](Operator op, Type left, Type right) {
    Expr expr;
    expr.kind = ExprKind::kBinary;
    expr.op = op;
    expr.operands.push_back(Typed(left));
    expr.operands.push_back(Typed(right));
    return operators.InferBinary(&expr);
  };
  EXPECT_EQ(type_of(Operator::kAdd, Type::kInt, Type::kInt), Type::kInt);
  EXPECT_EQ(type_of(Operator::kAdd, Type::kInt, Type::kFloat), Type::kFloat);
  EXPECT_EQ(type_of(Operator::kSub, Type::kSet, Type::kInt), Type::kInt) << "a set by its size";
  EXPECT_EQ(type_of(Operator::kLess, Type::kFloat, Type::kInt), Type::kBool);
  EXPECT_EQ(type_of(Operator::kEqual, Type::kAny, Type::kAxis), Type::kBool);
  EXPECT_EQ(type_of(Operator::kAnd, Type::kBool, Type::kBool), Type::kBool);
  EXPECT_EQ(Said(), "");
  EXPECT_EQ(type_of(Operator::kMul, Type::kBool, Type::kInt), Type::kError);
  EXPECT_EQ(Said(), "the operands of '*' must be numbers, but this is a bool");
  EXPECT_EQ(type_of(Operator::kLess, Type::kDirection, Type::kDirection), Type::kBool);
  EXPECT_EQ(Said(), "cannot compare a direction with a direction by '<'");
}

TEST_F(CheckerPartsTest, AKeywordIsUsedOnce) {
  const keywords::KeywordTable keywords = TestKeywords();
  PartChecker parts(keywords, &model_, &scope_, &conversions_, &pass_);
  const int joint = keywords.Find(vm::KeywordKind::kJoint, "JOINT_1");
  const int connector = keywords.Find(vm::KeywordKind::kConnector, "C1");
  ASSERT_GE(joint, 0);
  ASSERT_GE(connector, 0);
  const ExprPtr expr = Typed(Type::kUnknown);
  EXPECT_EQ(parts.UseKeyword(expr.get(), joint), Type::kJoint);
  EXPECT_EQ(parts.UseKeyword(expr.get(), connector), Type::kConnector);
  EXPECT_EQ(expr->index, 1);
  EXPECT_EQ(parts.UseKeyword(expr.get(), joint), Type::kJoint);
  EXPECT_EQ(expr->index, 0);
  EXPECT_EQ(model_.keywords, (std::vector<int>{joint, connector}));
}

TEST_F(CheckerPartsTest, StatementsThatNeverEndReturn) {
  const auto returns = [this](const std::string& body) {
    Make("role R extends Module { function f(a) {" + body + "} startup s() {} }");
    const int f = model_.roles[0].methods[0].routine;
    return AlwaysReturns(*model_.routines[f].member->body);
  };
  EXPECT_TRUE(returns("return a;"));
  EXPECT_FALSE(returns("if (a) { return 1; }"));
  EXPECT_TRUE(returns("if (a) { return 1; } else { return 2; }"));
  EXPECT_TRUE(returns("for (;;) { a = 1; }"));
  EXPECT_FALSE(returns("for (;;) { if (a) { break; } }"));
  EXPECT_TRUE(returns("for (;;) { while (a) { break; } }"));
}

TEST_F(CheckerPartsTest, ANoteShowsTheElementThatToldTheTypeOfAnArray) {
  Make("role A extends Module { x = [1, 2.5, true]; }");
  Check(TestKeywords(), &model_, &diagnostics_);
  EXPECT_EQ(Said(), "field 'x[2]' is a float, but this is a bool");
  ASSERT_EQ(diagnostics_.all().back().notes.size(), 1U);
  EXPECT_EQ(sources_.text(diagnostics_.all().back().notes[0].span), "2.5");
}

TEST_F(CheckerPartsTest, CallsEndAndFitTheStackOfFrames) {
  std::string text = "role R extends Module { startup s() {} ";
  const int most = vm::kMaxCallDepth;
  for (int i = 0; i <= most; ++i) text += "function f" + std::to_string(i) + "() {} ";
  Make(text + "}");
  const auto call = [this](int from, int slot) {
    model_.routines[model_.roles[0].methods[from].routine].calls.push_back(
        {.slot = slot, .span = {}});
  };
  for (int i = 0; i + 1 < most; ++i) call(i, i + 1);
  CheckCalls(&model_, &pass_);
  EXPECT_EQ(Said(), "");
  call(most - 1, most);
  CheckCalls(&model_, &pass_);
  EXPECT_EQ(Said(), "calls nest too deep");
  call(1, 0);
  CheckCalls(&model_, &pass_);
  EXPECT_EQ(Said(), "function 'f0' calls itself");
}

}  // namespace
}  // namespace morphbus::dynarole
