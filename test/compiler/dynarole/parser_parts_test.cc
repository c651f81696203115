// The parts of the parser, each by itself: tokens and what is said of them, expressions,
// statements.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "compiler/dynarole/expression_parser.h"
#include "compiler/dynarole/statement_parser.h"
#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {
namespace {

/// A text as its tokens, and the parsers that go through them.
class Reading {
 public:
  explicit Reading(const std::string& text)
      : file_(sources_.AddText("test.dyn", text)),
        tokens_(Tokenize(sources_, file_, &diagnostics_)),
        in(sources_, file_, tokens_, &diagnostics_),
        expressions(&in),
        statements(&in, &expressions) {}

  /// What was said, in the order in which it was found.
  [[nodiscard]] std::vector<std::string> Said() const {
    std::vector<std::string> said;
    for (const source::Diagnostic& one : diagnostics_.all()) said.push_back(one.message);
    return said;
  }

 private:
  source::SourceSet sources_;
  source::Diagnostics diagnostics_;
  int file_;
  std::vector<Token> tokens_;

 public:
  TokenReader in;
  ExpressionParser expressions;
  StatementParser statements;
};

/// With all parentheses: "(1 + (2 * 3))".
std::string Shown(const Expr& expr) {
  if (expr.kind == ExprKind::kInt) return std::to_string(expr.integer);
  if (expr.kind == ExprKind::kUnary) return NameOf(expr.op) + Shown(*expr.operands[0]);
  if (expr.kind != ExprKind::kBinary) return expr.name;
  return "(" + Shown(*expr.operands[0]) + " " + NameOf(expr.op) + " " + Shown(*expr.operands[1]) +
         ")";
}

TEST(TokenReaderTest, TheEndIsNeverPassed) {
  Reading reading("x ;");
  EXPECT_TRUE(reading.in.TakeIf(TokenKind::kName));
  EXPECT_FALSE(reading.in.TakeIf(TokenKind::kName));
  EXPECT_EQ(reading.in.Take().kind, TokenKind::kSemicolon);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reading.in.Take().kind, TokenKind::kEnd);
  EXPECT_EQ(reading.in.Peek(7).kind, TokenKind::kEnd);
}

TEST(TokenReaderTest, WhatFollowsAnErrorIsNotReportedUntilReadingGoesOn) {
  Reading reading("x y z");
  EXPECT_FALSE(reading.in.Expect(TokenKind::kSemicolon, "first"));
  EXPECT_TRUE(reading.in.failed());
  reading.in.Take();
  EXPECT_FALSE(reading.in.Expect(TokenKind::kSemicolon, "second"));
  reading.in.Recover();
  reading.in.Take();
  EXPECT_FALSE(reading.in.Expect(TokenKind::kSemicolon, "third"));
  EXPECT_EQ(reading.Said(), (std::vector<std::string>{"expected ';' first, found 'x'",
                                                      "expected ';' third, found 'z'"}));
}

TEST(TokenReaderTest, NestingIsBounded) {
  Reading reading("x");
  for (int i = 0; i < kMaxDepth; ++i) EXPECT_TRUE(reading.in.EnterLevel());
  reading.in.LeaveLevel();
  EXPECT_TRUE(reading.in.EnterLevel());
  EXPECT_FALSE(reading.in.EnterLevel());
  EXPECT_EQ(reading.Said(), (std::vector<std::string>{"nested too deeply"}));
  EXPECT_TRUE(reading.in.Is(TokenKind::kEnd)) << "nothing more is read";
}

TEST(ExpressionParserTest, OperatorsBindAsTightlyAsTheTableSays) {
  const auto shown = [](const std::string& text) {
    Reading reading(text);
    const ExprPtr expr = reading.expressions.Parse();
    EXPECT_TRUE(reading.Said().empty()) << text;
    return Shown(*expr);
  };
  EXPECT_EQ(shown("1 + 2 * 3"), "(1 + (2 * 3))");
  EXPECT_EQ(shown("1 - 2 - 3"), "((1 - 2) - 3)");
  EXPECT_EQ(shown("a || b && c == d"), "(a || (b && (c == d)))");
  EXPECT_EQ(shown("-1 * -2"), "(-1 * -2)");
  EXPECT_EQ(shown("(1 + 2) * 3"), "((1 + 2) * 3)");
}

TEST(ExpressionParserTest, LeavesWhatIsNoneForTheCaller) {
  Reading reading("; 1");
  EXPECT_EQ(reading.expressions.Parse()->kind, ExprKind::kError);
  EXPECT_TRUE(reading.in.Is(TokenKind::kSemicolon));
  EXPECT_EQ(reading.Said(), (std::vector<std::string>{"expected an expression, found ';'"}));
}

TEST(StatementParserTest, AnErrorEndsWithItsStatement) {
  Reading reading("{ var = 1; x = 2; return 3; }");
  const StmtPtr block = reading.statements.ParseBlock();
  ASSERT_EQ(block->body.size(), 3U);
  EXPECT_EQ(block->body[1]->kind, StmtKind::kAssign);
  EXPECT_EQ(block->body[2]->kind, StmtKind::kReturn);
  EXPECT_EQ(reading.Said(),
            (std::vector<std::string>{"expected the name of the variable, found '='"}));
  EXPECT_TRUE(reading.in.Is(TokenKind::kEnd));
}

}  // namespace
}  // namespace morphbus::dynarole
