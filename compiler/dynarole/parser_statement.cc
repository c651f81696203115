#include <optional>

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
    if (AtMember() && !Is(TokenKind::kConst) && Peek(1).kind != TokenKind::kAssign) {
      ExpectClosing(TokenKind::kRightBrace, opening);
      break;
    }
    // Nobody reads more errors than these, and broken text could give one for each word.
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
  // member. Semicolons and words inside braces belong to statements that are skipped with them.
  int depth = 0;
  while (!Is(TokenKind::kEnd)) {
    if (depth == 0 && (Is(TokenKind::kRightBrace) || Is(TokenKind::kVar) || Is(TokenKind::kIf) ||
                       Is(TokenKind::kWhile) || Is(TokenKind::kFor) || Is(TokenKind::kBreak) ||
                       Is(TokenKind::kContinue) || Is(TokenKind::kReturn))) {
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
    case TokenKind::kFor:
      statement = ParseFor();
      break;
    case TokenKind::kBreak:
    case TokenKind::kContinue:
      statement = ParseLeave();
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
    case TokenKind::kConst:
      ErrorAt(Peek().span, "a constant stands in a role or outside all, not in code",
              "for a value that code finds out, write: var NAME = ...;");
      Take();
      statement = std::move(failed);
      break;
    // A name with an assignment sign behind it, or an expression.
    default: {
      // A word that begins a member was used as a name.
      if (IsMemberWord(Peek().kind)) {
        ErrorAt(Peek().span, Describe(Peek().kind) + " is a word of the language, not a name");
        Take();
        statement = std::move(failed);
        break;
      }
      if (!AtAssignment()) {
        statement = ParseExpressionStatement();
        break;
      }
      statement = ParseAssignment();
      ExpectSemicolon("the assignment");
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
  // An 'else' belongs to the nearest 'if', which is the one that is read here.
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

// `for (first; condition; after each round) statement`; each of the three may be missing.
StmtPtr Parser::ParseFor() {
  StmtPtr statement = NewStatement(StmtKind::kFor);
  Take();
  const Span opening = Peek().span;
  if (!Expect(TokenKind::kLeftParen, "after 'for'")) return NewStatement(StmtKind::kError);
  // What comes first ends with its semicolon, as any statement does.
  StmtPtr first = NewStatement(StmtKind::kBlock);
  if (Is(TokenKind::kVar)) {
    first = ParseVar();
  } else if (AtAssignment()) {
    first = ParseAssignment();
    ExpectSemicolon("the first part of 'for'");
  } else {
    Expect(TokenKind::kSemicolon, "or 'var' or an assignment as the first part of 'for'");
  }
  statement->body.push_back(std::move(first));
  if (panic_) return NewStatement(StmtKind::kError);
  // Without a condition the loop goes on until it is left.
  if (!Is(TokenKind::kSemicolon)) statement->expr = ParseExpr();
  if (panic_ || !Expect(TokenKind::kSemicolon, "after the condition of 'for'"))
    return NewStatement(StmtKind::kError);
  // What is done after each round has no semicolon: the parenthesis ends it.
  StmtPtr after = NewStatement(StmtKind::kBlock);
  const Span begin = Peek().span;
  if (AtAssignment()) {
    after = ParseAssignment();
    after->span = SpanFrom(begin);
  } else if (!Is(TokenKind::kRightParen)) {
    after = NewStatement(StmtKind::kExpr);
    after->expr = ParseExpr();
    after->span = SpanFrom(begin);
  }
  statement->body.push_back(std::move(after));
  // The body is the third part, behind what comes first and what comes after each round.
  if (!ExpectClosing(TokenKind::kRightParen, opening)) return NewStatement(StmtKind::kError);
  statement->body.push_back(ParseStatement());
  return statement;
}

StmtPtr Parser::ParseLeave() {
  // Whether there is a loop to leave is for the checker to say.
  StmtPtr statement = NewStatement(Is(TokenKind::kBreak) ? StmtKind::kBreak : StmtKind::kContinue);
  const std::string word = Describe(Take().kind);
  ExpectSemicolon(word);
  return statement;
}

StmtPtr Parser::ParseReturn() {
  // `return value;`, or `return;` without a result.
  StmtPtr statement = NewStatement(StmtKind::kReturn);
  // Before a brace the semicolon is forgotten, which is said below in place of a missing value.
  Take();
  if (!Is(TokenKind::kSemicolon) && !Is(TokenKind::kRightBrace)) statement->expr = ParseExpr();
  ExpectSemicolon("'return'");
  return statement;
}

namespace {

// The operator of an assigning sign; kNone for `=`, nothing for what does not assign.
std::optional<Operator> AssigningOperator(TokenKind sign) {
  switch (sign) {
    case TokenKind::kAssign:
      return Operator::kNone;
    case TokenKind::kPlusAssign:
      return Operator::kAdd;
    case TokenKind::kMinusAssign:
      return Operator::kSub;
    case TokenKind::kStarAssign:
      return Operator::kMul;
    case TokenKind::kSlashAssign:
      return Operator::kDiv;
    case TokenKind::kPercentAssign:
      return Operator::kMod;
    default:
      return std::nullopt;
  }
}

}  // namespace

bool Parser::AtAssignment() const {
  return Is(TokenKind::kName) && AssigningOperator(Peek(1).kind).has_value();
}

StmtPtr Parser::ParseAssignment() {
  // `NAME = value`, `NAME += value` and the like.
  StmtPtr statement = NewStatement(StmtKind::kAssign);
  statement->name_span = Peek().span;
  statement->name = TextOf(Take());
  statement->op = *AssigningOperator(Take().kind);
  statement->expr = ParseExpr();
  return statement;
}

namespace {

// A word that begins a statement in other languages, and how to say the same here.
struct ForeignStatement {
  std::string_view word;
  const char* hint;
};

constexpr const char* kForType = "types are found, not written: var NAME = value;";
constexpr ForeignStatement kForeignStatements[] = {
    {"switch", "write: if (x == 1) { ... } else if (x == 2) { ... }"},
    {"elif", "write: else if (...) { ... }"},
    {"elseif", "write: else if (...) { ... }"},
    {"do", "write: while (...) { ... }"},
    {"foreach", "write: for (var i = 0; i < 3; i += 1) { ... }"},
    {"int", kForType},
    {"float", kForType},
    {"double", kForType},
    {"bool", kForType},
    {"auto", kForType},
    {"let", kForType},
};

}  // namespace

bool Parser::ReportForeignStatement(const Token& first) {
  if (first.kind != TokenKind::kName) return false;
  const std::string word = TextOf(first);
  for (const ForeignStatement& foreign : kForeignStatements) {
    if (foreign.word != word) continue;
    ErrorAt(first.span, "there is no '" + word + "'", foreign.hint);
    return true;
  }
  return false;
}

StmtPtr Parser::ParseExpressionStatement() {
  StmtPtr statement = NewStatement(StmtKind::kExpr);
  const Token first = Peek();
  statement->expr = ParseExpr();
  // `retrun;`, `retrun 1;`, `whlie (x) {`: say so if the first name is nearly a word.
  const bool odd = statement->expr->kind == ExprKind::kName || Is(TokenKind::kLeftBrace) ||
                   (!Is(TokenKind::kSemicolon) && !StartsLine(Peek()));
  if (!panic_ && odd && !ReportForeignStatement(first) && first.kind == TokenKind::kName) {
    const std::string near = source::NearestName(
        TextOf(first), {"if", "else", "while", "for", "break", "continue", "return", "var"});
    if (!near.empty()) {
      ErrorAt(first.span, "unknown statement '" + TextOf(first) + "'",
              "did you mean '" + near + "'?");
    }
  }
  ExpectSemicolon("the statement");
  return statement;
}

}  // namespace morphbus::dynarole
