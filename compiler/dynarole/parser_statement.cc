#include "compiler/dynarole/parser.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

namespace {

StmtPtr NewStatement(StmtKind kind) {
  auto statement = std::make_unique<Stmt>();
  statement->kind = kind;
  return statement;
}

}  // namespace

StmtPtr Parser::ParseBlock() {
  // Statements up to the brace that closes the block.
  StmtPtr block = NewStatement(StmtKind::kBlock);
  block->span = Take().span;
  const Span opening = block->span;
  if (!EnterLevel()) return block;
  while (!Is(TokenKind::kRightBrace)) {
    // A word that can only begin a member means that this block was not closed.
    if (AtMember() && Peek(1).kind != TokenKind::kAssign) {
      ExpectClosing(TokenKind::kRightBrace, opening);
      break;
    }
    if (diagnostics_.all().size() >= 100) break;
    // An error ends with its statement; reading goes on at the next.
    panic_ = false;
    block->body.push_back(ParseStatement());
    if (panic_) SkipStatement();
  }
  TakeIf(TokenKind::kRightBrace);
  --level_;
  block->span = SpanFrom(block->span);
  return block;
}

void Parser::SkipStatement() {
  // Stops before a word that begins a statement, behind a semicolon or a block, and before a
  // member.
  int depth = 0;
  while (!Is(TokenKind::kEnd)) {
    if (depth == 0 && (Is(TokenKind::kRightBrace) || Is(TokenKind::kVar) || Is(TokenKind::kIf) ||
                       Is(TokenKind::kWhile) || Is(TokenKind::kReturn))) {
      return;
    }
    if (AtMember()) return;
    const TokenKind kind = Take().kind;
    if (kind == TokenKind::kSemicolon && depth == 0) return;
    if (kind == TokenKind::kLeftBrace) ++depth;
    if (kind == TokenKind::kRightBrace && --depth == 0) return;
  }
}

StmtPtr Parser::ParseStatement() {
  // The first token decides what the statement is.
  StmtPtr failed = NewStatement(StmtKind::kError);
  failed->span = Peek().span;
  // Blocks and branches nest, so each statement counts as a level.
  if (!EnterLevel()) return failed;
  StmtPtr statement;
  const Span begin = Peek().span;
  switch (Peek().kind) {
    case TokenKind::kVar:
      statement = ParseVar();
      break;
    case TokenKind::kIf:
      statement = ParseIf();
      break;
    case TokenKind::kWhile:
      statement = ParseWhile();
      break;
    case TokenKind::kReturn:
      statement = ParseReturn();
      break;
    case TokenKind::kLeftBrace:
      statement = ParseBlock();
      break;
    case TokenKind::kSemicolon:
      statement = NewStatement(StmtKind::kBlock);
      Take();
      break;
    // Its if may have ended early, such as by a semicolon behind the condition.
    case TokenKind::kElse:
      ErrorAt(Peek().span, "'else' without an 'if' before it");
      Take();
      statement = std::move(failed);
      break;
    // A name with an assignment sign behind it, or an expression.
    default: {
      if (AtFor()) {
        statement = ParseMissingFor();
        break;
      }
      // A word that begins a member was used as a name.
      if (IsMemberWord(Peek().kind)) {
        ErrorAt(Peek().span, Describe(Peek().kind) + " is a word of the language, not a name");
        Take();
        statement = std::move(failed);
        break;
      }
      const TokenKind next = Peek(1).kind;
      const bool assigns = next == TokenKind::kAssign || next == TokenKind::kPlusAssign ||
                           next == TokenKind::kMinusAssign;
      statement = Is(TokenKind::kName) && assigns ? ParseAssignment() : ParseExpressionStatement();
    }
  }
  --level_;
  statement->span = SpanFrom(begin);
  return statement;
}

StmtPtr Parser::ParseVar() {
  // `var NAME = value;`
  StmtPtr statement = NewStatement(StmtKind::kVar);
  Take();
  if (!Is(TokenKind::kName)) {
    Unexpected("the name of the variable");
    return statement;
  }
  statement->name_span = Peek().span;
  statement->name = TextOf(Take());
  // Types are found, not written, so a variable needs a first value.
  if (!Is(TokenKind::kAssign)) {
    Unexpected("'=' and the variable's first value",
               "variables have no value before it: var " + statement->name + " = 0;");
    return statement;
  }
  Take();
  statement->expr = ParseExpr();
  ExpectSemicolon("the variable '" + statement->name + "'");
  return statement;
}

ExprPtr Parser::ParseCondition(const char* word) {
  // A condition stands in parentheses.
  const Span opening = Peek().span;
  if (!Expect(TokenKind::kLeftParen, std::string("after '") + word + "'")) return nullptr;
  ExprPtr condition = ParseExpr();
  ExpectClosing(TokenKind::kRightParen, opening);
  return condition;
}

StmtPtr Parser::ParseIf() {
  // `if (condition) statement else statement`
  StmtPtr statement = NewStatement(StmtKind::kIf);
  Take();
  statement->expr = ParseCondition("if");
  if (panic_) return statement;
  statement->body.push_back(ParseStatement());
  if (!panic_ && TakeIf(TokenKind::kElse)) statement->body.push_back(ParseStatement());
  return statement;
}

StmtPtr Parser::ParseWhile() {
  // `while (condition) statement`
  StmtPtr statement = NewStatement(StmtKind::kWhile);
  Take();
  statement->expr = ParseCondition("while");
  if (!panic_) statement->body.push_back(ParseStatement());
  return statement;
}

// `for (`, which other languages have, or the name of a function of that name in a role.
bool Parser::AtFor() const {
  return Is(TokenKind::kName) && TextOf(Peek()) == "for" && Peek(1).kind == TokenKind::kLeftParen;
}

// Reports the `for`, skips what stands in its parentheses, and reads its body, so that what is
// wrong there is reported too.
StmtPtr Parser::ParseMissingFor() {
  diagnostics_.Error(Take().span, "DynaRole has no 'for' yet").hint =
      "write: var i = 0; while (i < n) { ...; i += 1; }";
  // The parentheses hold semicolons, at which recovery would stop.
  int depth = 0;
  do {
    if (Is(TokenKind::kLeftParen)) ++depth;
    if (Is(TokenKind::kRightParen)) --depth;
    if (Is(TokenKind::kLeftBrace) || Is(TokenKind::kRightBrace) || Is(TokenKind::kEnd)) break;
    Take();
  } while (depth > 0);
  return ParseStatement();
}

StmtPtr Parser::ParseReturn() {
  // `return value;`, or `return;` without a result.
  StmtPtr statement = NewStatement(StmtKind::kReturn);
  Take();
  if (!Is(TokenKind::kSemicolon) && !Is(TokenKind::kRightBrace)) statement->expr = ParseExpr();
  ExpectSemicolon("'return'");
  return statement;
}

StmtPtr Parser::ParseAssignment() {
  // `NAME = value;`, `NAME += value;`, `NAME -= value;`
  StmtPtr statement = NewStatement(StmtKind::kAssign);
  statement->name_span = Peek().span;
  statement->name = TextOf(Take());
  const TokenKind sign = Take().kind;
  statement->op = sign == TokenKind::kPlusAssign    ? Operator::kAdd
                  : sign == TokenKind::kMinusAssign ? Operator::kSub
                                                    : Operator::kNone;
  statement->expr = ParseExpr();
  ExpectSemicolon("the assignment");
  return statement;
}

StmtPtr Parser::ParseExpressionStatement() {
  StmtPtr statement = NewStatement(StmtKind::kExpr);
  const Token first = Peek();
  statement->expr = ParseExpr();
  // `retrun;`, `retrun 1;`, `whlie (x) {`: say so if the first name is nearly a word.
  const bool odd = statement->expr->kind == ExprKind::kName ||
                   (!Is(TokenKind::kSemicolon) && !StartsLine(Peek()));
  if (!panic_ && odd && first.kind == TokenKind::kName) {
    const std::string near =
        source::NearestName(TextOf(first), {"if", "else", "while", "return", "var"});
    if (!near.empty()) {
      ErrorAt(first.span, "unknown statement '" + TextOf(first) + "'",
              "did you mean '" + near + "'?");
    }
  }
  ExpectSemicolon("the statement");
  return statement;
}

}  // namespace morphbus::dynarole
