#include "compiler/dynarole/statement_parser.h"

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "vm/image/image.h"

namespace morphbus::dynarole {

using source::Span;

namespace {

StmtPtr NewStatement(StmtKind kind) {
  auto statement = std::make_unique<Stmt>();
  statement->kind = kind;
  return statement;
}

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

constexpr ArrayRoom kVariableRoom = {"variable", "function", vm::image::kMaxLocals};

// A word that begins a statement in other languages, and how to say the same here.
struct ForeignStatement {
  std::string_view word;
  const char* hint;
};

constexpr const char* kForType = "types are found, not written: var NAME = value;";
constexpr ForeignStatement kForeignStatements[] = {
    {"switch", "write: switch (x) { case 1: ... case 2: ... default: ... }"},
    {"case", "it stands in the braces of a 'switch'"},
    {"default", "it stands in the braces of a 'switch', with a colon behind it"},
    {"elif", "write: else if (...) { ... }"},
    {"elseif", "write: else if (...) { ... }"},
    {"do", "write: while (...) { ... }"},
    {"foreach", "write: for (n in self.connected($ANY, $Role)) { ... }"},
    {"int", kForType},
    {"float", kForType},
    {"double", kForType},
    {"bool", kForType},
    {"auto", kForType},
    {"let", kForType},
};

}  // namespace

StmtPtr StatementParser::ParseBlock() {
  // Statements up to the brace that closes the block.
  StmtPtr block = NewStatement(StmtKind::kBlock);
  block->span = in_.Take().span;
  const Span opening = block->span;
  if (!in_.EnterLevel()) return block;
  while (!in_.Is(TokenKind::kRightBrace)) {
    // A word that can only begin a member means that this block was not closed.
    if (in_.AtMember() && !in_.Is(TokenKind::kConst) && in_.Peek(1).kind != TokenKind::kAssign) {
      in_.ExpectClosing(TokenKind::kRightBrace, opening);
      break;
    }
    // Nobody reads more errors than these, and broken text could give one for each word.
    if (in_.said_enough()) break;
    // An error ends with its statement; reading goes on at the next.
    in_.Recover();
    block->body.push_back(ParseStatement());
    if (in_.failed()) SkipStatement();
  }
  in_.TakeIf(TokenKind::kRightBrace);
  in_.LeaveLevel();
  block->span = in_.SpanFrom(block->span);
  return block;
}

void StatementParser::SkipStatement() {
  // Stops before a word that begins a statement, behind a semicolon or a block, and before a
  // member. Semicolons and words inside braces belong to statements that are skipped with them.
  int depth = 0;
  while (!in_.Is(TokenKind::kEnd)) {
    if (depth == 0 &&
        (in_.Is(TokenKind::kRightBrace) || in_.Is(TokenKind::kVar) || in_.Is(TokenKind::kIf) ||
         in_.Is(TokenKind::kWhile) || in_.Is(TokenKind::kFor) || in_.Is(TokenKind::kBreak) ||
         in_.Is(TokenKind::kContinue) || in_.Is(TokenKind::kReturn))) {
      return;
    }
    if (in_.AtMember()) return;
    // The end of the statement, of its block, or neither.
    const TokenKind kind = in_.Take().kind;
    if (kind == TokenKind::kSemicolon && depth == 0) return;
    if (kind == TokenKind::kLeftBrace) ++depth;
    if (kind == TokenKind::kRightBrace && --depth == 0) return;
  }
}

StmtPtr StatementParser::ParseStatement() {
  // The first token decides what the statement is.
  StmtPtr failed = NewStatement(StmtKind::kError);
  failed->span = in_.Peek().span;
  // Blocks and branches nest, so each statement counts as a level.
  if (!in_.EnterLevel()) return failed;
  StmtPtr statement;
  const Span begin = in_.Peek().span;
  switch (in_.Peek().kind) {
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
      in_.Take();
      break;
    // Its if may have ended early, such as by a semicolon behind the condition.
    case TokenKind::kElse:
      in_.ErrorAt(in_.Peek().span, "'else' without an 'if' before it");
      in_.Take();
      statement = std::move(failed);
      break;
    case TokenKind::kConst:
      in_.ErrorAt(in_.Peek().span, "a constant stands in a role or outside all, not in code",
                  "for a value that code finds out, write: var NAME = ...;");
      in_.Take();
      statement = std::move(failed);
      break;
    // A name with an assignment sign behind it, or an expression.
    default: {
      // A word that begins a member was used as a name.
      if (IsMemberWord(in_.Peek().kind)) {
        in_.ErrorAt(in_.Peek().span,
                    Describe(in_.Peek().kind) + " is a word of the language, not a name");
        in_.Take();
        statement = std::move(failed);
        break;
      }
      if (AtSwitch()) {
        statement = ParseSwitch();
        break;
      }
      if (!AtAssignment()) {
        statement = ParseExpressionStatement();
        break;
      }
      statement = ParseAssignment();
      in_.ExpectSemicolon("the assignment");
    }
  }
  in_.LeaveLevel();
  statement->span = in_.SpanFrom(begin);
  return statement;
}

StmtPtr StatementParser::ParseVar() {
  // `var NAME = value;`
  StmtPtr statement = NewStatement(StmtKind::kVar);
  in_.Take();
  if (!in_.Is(TokenKind::kName)) {
    in_.Unexpected("the name of the variable");
    return statement;
  }
  statement->name_span = in_.Peek().span;
  statement->name = in_.TextOf(in_.Take());
  if (in_.Is(TokenKind::kLeftBracket)) statement->length = expressions_.ParseLength(kVariableRoom);
  if (in_.failed()) return statement;
  // Types are found, not written, so a variable needs a first value.
  if (!in_.Is(TokenKind::kAssign)) {
    in_.Unexpected("'=' and the variable's first value",
                   "variables have no value before it: var " + statement->name + " = 0;");
    return statement;
  }
  in_.Take();
  // Any expression will do; which type it has is for the checker to find.
  statement->expr = expressions_.Parse();
  in_.ExpectSemicolon("the variable '" + statement->name + "'");
  return statement;
}

ExprPtr StatementParser::ParseCondition(const char* word) {
  // A condition stands in parentheses.
  // A parenthesis that is missing is shown where it was opened.
  const Span opening = in_.Peek().span;
  if (!in_.Expect(TokenKind::kLeftParen, std::string("after '") + word + "'")) return nullptr;
  ExprPtr condition = expressions_.Parse();
  in_.ExpectClosing(TokenKind::kRightParen, opening);
  return condition;
}

StmtPtr StatementParser::ParseIf() {
  // `if (condition) statement else statement`
  StmtPtr statement = NewStatement(StmtKind::kIf);
  in_.Take();
  statement->expr = ParseCondition("if");
  if (in_.failed()) return statement;
  // An 'else' belongs to the nearest 'if', which is the one that is read here.
  statement->body.push_back(ParseStatement());
  if (!in_.failed() && in_.TakeIf(TokenKind::kElse)) statement->body.push_back(ParseStatement());
  return statement;
}

// `switch` is a word only before a condition and a brace, so that programs may use it as a name.
bool StatementParser::AtSwitch() const {
  if (!in_.Is(TokenKind::kName) || in_.TextOf(in_.Peek()) != "switch") return false;
  const size_t behind = in_.Peek(1).kind == TokenKind::kLeftParen ? in_.Behind(1) : 0;
  return behind > 0 && in_.Peek(behind).kind == TokenKind::kLeftBrace;
}

bool StatementParser::AtCase() const {
  // A variable may have such a name.
  const std::string word = in_.Is(TokenKind::kName) ? in_.TextOf(in_.Peek()) : "";
  return (word == "case" && !AtAssignment()) ||
         (word == "default" && in_.Peek(1).kind == TokenKind::kColon);
}

// `switch (value) { case A, B: statements ... default: statements }`
StmtPtr StatementParser::ParseSwitch() {
  StmtPtr statement = NewStatement(StmtKind::kSwitch);
  in_.Take();
  statement->expr = ParseCondition("switch");
  if (in_.failed()) return statement;
  const Span opening = in_.Take().span;
  while (!in_.Is(TokenKind::kRightBrace)) {
    if (in_.Is(TokenKind::kEnd) || (in_.AtMember() && in_.Peek(1).kind != TokenKind::kAssign)) {
      in_.ExpectClosing(TokenKind::kRightBrace, opening);
      return statement;
    }
    if (in_.said_enough()) return statement;
    in_.Recover();
    if (AtCase()) {
      statement->cases.push_back(ParseCase());
      statement->body.push_back(NewStatement(StmtKind::kBlock));
    } else {
      in_.Unexpected("'case' or 'default'", "for example: case 1: ... default: ...");
    }
    if (in_.failed()) {
      SkipToCase();
      continue;
    }
    // A block reaches to the next case; nothing goes on from one into another.
    Stmt& block = *statement->body.back();
    block.span = in_.Peek().span;
    while (!in_.Is(TokenKind::kRightBrace) && !AtCase() && !in_.said_enough() &&
           (!in_.AtMember() || in_.Is(TokenKind::kConst)) && !in_.Is(TokenKind::kEnd)) {
      in_.Recover();
      block.body.push_back(ParseStatement());
      if (in_.failed()) SkipStatement();
    }
    block.span = in_.SpanFrom(block.span);
  }
  // What stands behind the switch has nothing to do with what is wrong in it.
  in_.Recover();
  in_.Take();
  return statement;
}

void StatementParser::SkipToCase() {
  int depth = 0;
  while (!in_.Is(TokenKind::kEnd) && !in_.AtMember()) {
    if (depth == 0 && (in_.Is(TokenKind::kRightBrace) || AtCase())) return;
    const TokenKind kind = in_.Take().kind;
    if (kind == TokenKind::kLeftBrace) ++depth;
    if (kind == TokenKind::kRightBrace) --depth;
  }
}

SwitchCase StatementParser::ParseCase() {
  SwitchCase found;
  found.span = in_.Peek().span;
  if (in_.TextOf(in_.Take()) == "case") {
    do {
      found.values.push_back(expressions_.Parse());
    } while (!in_.failed() && in_.TakeIf(TokenKind::kComma));
  }
  found.span = in_.SpanFrom(found.span);
  if (!in_.failed()) in_.Expect(TokenKind::kColon, "behind the values of the case");
  return found;
}

StmtPtr StatementParser::ParseWhile() {
  // `while (condition) statement`
  StmtPtr statement = NewStatement(StmtKind::kWhile);
  in_.Take();
  statement->expr = ParseCondition("while");
  if (!in_.failed()) statement->body.push_back(ParseStatement());
  return statement;
}

// `for (first; condition; after each round) statement`; each of the three may be missing.
StmtPtr StatementParser::ParseFor() {
  StmtPtr statement = NewStatement(StmtKind::kFor);
  in_.Take();
  const Span opening = in_.Peek().span;
  if (!in_.Expect(TokenKind::kLeftParen, "after 'for'")) return NewStatement(StmtKind::kError);
  if (AtIn(0)) return ParseForEach(opening);
  if (in_.Is(TokenKind::kVar) && AtIn(1)) {
    in_.AddError(in_.Peek().span, "a loop over neighbours makes its variable without 'var'").hint =
        "write: for (" + in_.TextOf(in_.Peek(1)) + " in ...) { ... }";
    in_.Take();
    return ParseForEach(opening);
  }
  // What comes first ends with its semicolon, as any statement does.
  // An empty block stands for a part that is missing, so that the loop has its three parts in any
  // case.
  StmtPtr first = NewStatement(StmtKind::kBlock);
  if (in_.Is(TokenKind::kVar)) {
    first = ParseVar();
  } else if (AtAssignment()) {
    first = ParseAssignment();
    in_.ExpectSemicolon("the first part of 'for'");
  } else {
    in_.Expect(TokenKind::kSemicolon, "or 'var' or an assignment as the first part of 'for'");
  }
  statement->body.push_back(std::move(first));
  if (in_.failed()) return NewStatement(StmtKind::kError);
  // Without a condition the loop goes on until it is left.
  if (!in_.Is(TokenKind::kSemicolon)) statement->expr = expressions_.Parse();
  if (in_.failed() || !in_.Expect(TokenKind::kSemicolon, "after the condition of 'for'"))
    return NewStatement(StmtKind::kError);
  // What is done after each round has no semicolon: the parenthesis ends it.
  StmtPtr after = NewStatement(StmtKind::kBlock);
  const Span begin = in_.Peek().span;
  if (AtAssignment()) {
    after = ParseAssignment();
    after->span = in_.SpanFrom(begin);
  } else if (!in_.Is(TokenKind::kRightParen)) {
    after = NewStatement(StmtKind::kExpr);
    after->expr = expressions_.Parse();
    after->span = in_.SpanFrom(begin);
  }
  statement->body.push_back(std::move(after));
  // The body is the third part, behind what comes first and what comes after each round.
  if (!in_.ExpectClosing(TokenKind::kRightParen, opening)) return NewStatement(StmtKind::kError);
  statement->body.push_back(ParseStatement());
  return statement;
}

// `in` is a word only there, so that programs may use it as a name.
bool StatementParser::AtIn(size_t ahead) const {
  const Token& word = in_.Peek(ahead + 1);
  return in_.Peek(ahead).kind == TokenKind::kName && word.kind == TokenKind::kName &&
         in_.TextOf(word) == "in";
}

StmtPtr StatementParser::ParseForEach(const Span& opening) {
  StmtPtr statement = NewStatement(StmtKind::kForEach);
  statement->name_span = in_.Peek().span;
  statement->name = in_.TextOf(in_.Take());
  in_.Take();
  statement->expr = expressions_.Parse();
  if (in_.failed() || !in_.ExpectClosing(TokenKind::kRightParen, opening)) {
    return NewStatement(StmtKind::kError);
  }
  statement->body.push_back(ParseStatement());
  return statement;
}

StmtPtr StatementParser::ParseLeave() {
  // Whether there is a loop to leave is for the checker to say.
  StmtPtr statement =
      NewStatement(in_.Is(TokenKind::kBreak) ? StmtKind::kBreak : StmtKind::kContinue);
  const std::string word = Describe(in_.Take().kind);
  in_.ExpectSemicolon(word);
  return statement;
}

StmtPtr StatementParser::ParseReturn() {
  // `return value;`, or `return;` without a result.
  StmtPtr statement = NewStatement(StmtKind::kReturn);
  // Before a brace the semicolon is forgotten, which is said below in place of a missing value.
  in_.Take();
  if (!in_.Is(TokenKind::kSemicolon) && !in_.Is(TokenKind::kRightBrace))
    statement->expr = expressions_.Parse();
  in_.ExpectSemicolon("'return'");
  return statement;
}

bool StatementParser::AtAssignment() const {
  if (!in_.Is(TokenKind::kName)) return false;
  // An element of an array has its number between the name and the sign.
  const size_t sign = in_.Peek(1).kind == TokenKind::kLeftBracket ? in_.Behind(1) : 1;
  return sign > 0 && AssigningOperator(in_.Peek(sign).kind).has_value();
}

bool StatementParser::ReportMemberAssignment() {
  // Goes over the members and calls up to what follows them.
  size_t sign = 1;
  bool own = in_.Is(TokenKind::kSelf);
  while (in_.Peek(sign).kind == TokenKind::kDot || in_.Peek(sign).kind == TokenKind::kLeftParen) {
    const bool call = in_.Peek(sign).kind == TokenKind::kLeftParen;
    own = own && !call;
    sign = call ? in_.Behind(sign) : sign + 2;
    if (sign == 0) return false;
  }
  const bool member = sign > 2 && in_.Peek(sign - 2).kind == TokenKind::kDot;
  if (!member || !AssigningOperator(in_.Peek(sign).kind)) return false;
  const std::string name = in_.TextOf(in_.Peek(sign - 1));
  in_.ErrorAt(in_.Peek(sign - 1).span, "'" + name + "' cannot be assigned to",
              own ? "fields are written without 'self.', and parts of the module are set by calls"
                  : "a module sets its own fields only; to have another one set its own, send it a "
                    "command that does");
  return true;
}

StmtPtr StatementParser::ParseAssignment() {
  // `NAME = value`, `NAME[number] += value` and the like.
  StmtPtr statement = NewStatement(StmtKind::kAssign);
  statement->name_span = in_.Peek().span;
  statement->name = in_.TextOf(in_.Take());
  if (in_.Is(TokenKind::kLeftBracket)) {
    const Span opening = in_.Take().span;
    statement->subscript = expressions_.Parse();
    if (!in_.failed()) in_.ExpectClosing(TokenKind::kRightBracket, opening);
    if (in_.failed()) return statement;
  }
  statement->op = *AssigningOperator(in_.Take().kind);
  statement->expr = expressions_.Parse();
  return statement;
}

bool StatementParser::ReportForeignStatement(const Token& first) {
  // Words of other languages are names in this one.
  if (first.kind != TokenKind::kName) return false;
  const std::string word = in_.TextOf(first);
  for (const ForeignStatement& foreign : kForeignStatements) {
    if (foreign.word != word) continue;
    in_.ErrorAt(first.span, "there is no '" + word + "'", foreign.hint);
    return true;
  }
  return false;
}

StmtPtr StatementParser::ParseExpressionStatement() {
  StmtPtr statement = NewStatement(StmtKind::kExpr);
  // A statement that is only an expression is a call, or a word that was misspelt.
  const Token first = in_.Peek();
  // Its head could not be read as arguments of a call.
  if (in_.Peek(1).kind == TokenKind::kLeftParen && AtIn(2) && ReportForeignStatement(first)) {
    return statement;
  }
  if (ReportMemberAssignment()) return statement;
  statement->expr = expressions_.Parse();
  // `retrun;`, `retrun 1;`, `whlie (x) {`: say so if the first name is nearly a word.
  const bool odd = statement->expr->kind == ExprKind::kName || in_.Is(TokenKind::kLeftBrace) ||
                   (!in_.Is(TokenKind::kSemicolon) && !in_.StartsLine(in_.Peek()));
  if (!in_.failed() && odd && !ReportForeignStatement(first) && first.kind == TokenKind::kName) {
    const std::string near = source::NearestName(
        in_.TextOf(first), {"if", "else", "while", "for", "break", "continue", "return", "var"});
    if (!near.empty()) {
      in_.ErrorAt(first.span, "unknown statement '" + in_.TextOf(first) + "'",
                  "did you mean '" + near + "'?");
    }
  }
  in_.ExpectSemicolon("the statement");
  return statement;
}

}  // namespace morphbus::dynarole
