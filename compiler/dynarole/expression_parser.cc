#include "compiler/dynarole/expression_parser.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

namespace morphbus::dynarole {

using source::Span;

namespace {

// How tightly each operator binds; all of them group from the left.
struct BinaryOperator {
  TokenKind token;
  Operator op;
  int level;  ///< Higher binds tighter.
};

constexpr BinaryOperator kBinaryOperators[] = {
    {TokenKind::kOrOr, Operator::kOr, 1},
    {TokenKind::kAndAnd, Operator::kAnd, 2},
    {TokenKind::kEqual, Operator::kEqual, 3},
    {TokenKind::kNotEqual, Operator::kNotEqual, 3},
    {TokenKind::kLess, Operator::kLess, 4},
    {TokenKind::kLessEqual, Operator::kLessEqual, 4},
    {TokenKind::kGreater, Operator::kGreater, 4},
    {TokenKind::kGreaterEqual, Operator::kGreaterEqual, 4},
    {TokenKind::kPlus, Operator::kAdd, 5},
    {TokenKind::kMinus, Operator::kSub, 5},
    {TokenKind::kStar, Operator::kMul, 6},
    {TokenKind::kSlash, Operator::kDiv, 6},
    {TokenKind::kPercent, Operator::kMod, 6},
};

// Operators that are words in other languages.
struct ForeignOperator {
  std::string_view word;
  const char* hint;
};

constexpr ForeignOperator kForeignOperators[] = {
    {"and", "logical and is '&&'"}, {"or", "logical or is '||'"}, {"not", "logical not is '!'"}};

// Null for tokens that are no binary operators: the expression ends there.
const BinaryOperator* FindBinary(TokenKind token) {
  for (const BinaryOperator& candidate : kBinaryOperators) {
    if (candidate.token == token) return &candidate;
  }
  return nullptr;
}

}  // namespace

ExprPtr ExpressionParser::Node(ExprKind kind, const Span& span) {
  // The name of the node is its whole text unless the caller knows better.
  auto expr = std::make_unique<Expr>();
  expr->kind = kind;
  expr->span = span;
  expr->name_span = span;
  return expr;
}

void ExpressionParser::Adopt(Expr* parent, ExprPtr child) {
  // Recursion over the tree must be bounded, and long sums make deep trees without nested
  // parentheses.
  parent->depth = std::max(parent->depth, child->depth + 1);
  parent->operands.push_back(std::move(child));
  if (parent->depth > kMaxDepth) in_.TooDeep(parent->span);
}

ExprPtr ExpressionParser::Parse(int level) {
  if (!in_.EnterLevel()) return Node(ExprKind::kError, in_.Peek().span);
  // Precedence climbing: the right side takes all operators that bind tighter than this one.
  ExprPtr left = ParseUnary();
  for (;;) {
    const BinaryOperator* op = FindBinary(in_.Peek().kind);
    // What binds less belongs to whoever called.
    if (op == nullptr || op->level < level) break;
    const Span op_span = in_.Take().span;
    // Operators of one level group from the left: the right side holds none of this level.
    ExprPtr right = Parse(op->level + 1);
    ExprPtr expr = Node(ExprKind::kBinary, {in_.file(), left->span.begin, right->span.end});
    expr->op = op->op;
    expr->name_span = op_span;
    Adopt(expr.get(), std::move(left));
    Adopt(expr.get(), std::move(right));
    left = std::move(expr);
  }
  // A choice binds loosest of all, and its second value may be another one.
  if (level == 1 && in_.Is(TokenKind::kQuestion) && !in_.failed()) {
    left = ParseChoice(std::move(left));
  }
  // What follows an expression is no name, unless a semicolon is missing before an assignment.
  if (level == 1 && in_.Peek(1).kind != TokenKind::kAssign) ReportForeignOperator();
  // Outside all operators: `if (a = b)`.
  if (in_.Is(TokenKind::kAssign) && level == 1) {
    in_.ErrorAt(in_.Peek().span, "'=' cannot stand in an expression", "to compare, write '=='");
  }
  in_.LeaveLevel();
  return left;
}

void ExpressionParser::ReportForeignOperator() {
  if (!in_.Is(TokenKind::kName)) return;
  for (const ForeignOperator& foreign : kForeignOperators) {
    const std::string word = in_.TextOf(in_.Peek());
    if (word == foreign.word)
      in_.ErrorAt(in_.Peek().span, "there is no '" + word + "'", foreign.hint);
  }
}

ExprPtr ExpressionParser::ParseChoice(ExprPtr condition) {
  const Span question = in_.Take().span;
  ExprPtr choice = Node(ExprKind::kChoice, condition->span);
  choice->name_span = question;
  Adopt(choice.get(), std::move(condition));
  Adopt(choice.get(), Parse());
  // A choice without its second value is none, so that nobody looks for it.
  if (!in_.failed() && !in_.Is(TokenKind::kColon)) {
    in_.Unexpected("':' and the value where the condition does not hold",
                   "a choice has two values: condition ? this : that");
  }
  if (in_.failed()) {
    choice->kind = ExprKind::kError;
    return choice;
  }
  in_.Take();
  Adopt(choice.get(), Parse());
  choice->span.end = choice->operands.back()->span.end;
  return choice;
}

ExprPtr ExpressionParser::ParseUnary() {
  // `- - x` and `!!x` nest, so levels are counted here too.
  if (!in_.Is(TokenKind::kMinus) && !in_.Is(TokenKind::kNot)) return ParsePostfix();
  if (!in_.EnterLevel()) return Node(ExprKind::kError, in_.Peek().span);
  const Token& sign = in_.Take();
  ExprPtr operand = ParseUnary();
  in_.LeaveLevel();
  ExprPtr expr = Node(ExprKind::kUnary, {in_.file(), sign.span.begin, operand->span.end});
  expr->op = sign.kind == TokenKind::kMinus ? Operator::kNegate : Operator::kNot;
  expr->name_span = sign.span;
  Adopt(expr.get(), std::move(operand));
  return expr;
}

ExprPtr ExpressionParser::ParsePostfix() {
  // Members and calls follow each other as they stand: `self.C1.SET_EXTENDED(true)`.
  ExprPtr expr = ParsePrimary();
  for (;;) {
    if (in_.Is(TokenKind::kDot)) {
      in_.Take();
      ExprPtr member = Node(ExprKind::kMember, expr->span);
      // A module has a role, though the word begins one elsewhere.
      if (!in_.Is(TokenKind::kName) && !in_.Is(TokenKind::kRole)) {
        NoMember();
        member->kind = ExprKind::kError;
        return member;
      }
      // The span of a member reaches from what stands before the dot to its name.
      member->name_span = in_.Peek().span;
      member->name = in_.TextOf(in_.Take());
      member->span.end = member->name_span.end;
      Adopt(member.get(), std::move(expr));
      expr = std::move(member);
    } else if (in_.Is(TokenKind::kLeftParen) &&
               (expr->kind == ExprKind::kName || expr->kind == ExprKind::kMember)) {
      // Only names and members can be called.
      ExprPtr call = Node(ExprKind::kCall, expr->span);
      // Messages about a call show what is called, without its arguments.
      call->name = expr->name;
      call->name_span = expr->name_span;
      Adopt(call.get(), std::move(expr));
      ParseArguments(call.get());
      call->span.end = in_.Previous().span.end;
      expr = std::move(call);
    } else if (in_.Is(TokenKind::kLeftBracket) && expr->kind == ExprKind::kName) {
      // Only what has a name of its own can be an array.
      const Span opening = in_.Take().span;
      ExprPtr element = Node(ExprKind::kIndex, expr->span);
      element->name_span = expr->span;
      Adopt(element.get(), std::move(expr));
      Adopt(element.get(), Parse());
      if (!in_.failed()) in_.ExpectClosing(TokenKind::kRightBracket, opening);
      element->span.end = in_.Previous().span.end;
      expr = std::move(element);
    } else {
      return expr;
    }
    // Behind an error the tokens that follow belong to nothing that is known.
    if (in_.failed()) return expr;
  }
}

ExprPtr ExpressionParser::ParseArray() {
  const Span opening = in_.Take().span;
  ExprPtr array = Node(ExprKind::kArray, opening);
  if (in_.Is(TokenKind::kRightBracket)) {
    in_.Unexpected("the first value of an array", "one of many like values is NAME[8] = 0;");
    array->kind = ExprKind::kError;
    return array;
  }
  do {
    Adopt(array.get(), Parse());
  } while (!in_.failed() && in_.TakeIf(TokenKind::kComma));
  if (!in_.failed()) in_.ExpectClosing(TokenKind::kRightBracket, opening);
  array->span = in_.SpanFrom(array->span);
  return array;
}

int ExpressionParser::ParseLength(const ArrayRoom& room) {
  const Span opening = in_.Take().span;
  if (!in_.Is(TokenKind::kInt)) {
    in_.Unexpected("the number of elements", "it is an int that stands there: [8]");
    return 0;
  }
  const ExprPtr length = ParseInt();
  if (!HasRoom(length->integer, length->span, room)) return 0;
  in_.ExpectClosing(TokenKind::kRightBracket, opening);
  return static_cast<int>(length->integer);
}

bool ExpressionParser::HasRoom(int64_t length, const Span& span, const ArrayRoom& room) {
  if (length >= 1 && length <= room.most) return true;
  const std::string most = std::to_string(room.most), kind = room.element;
  in_.ErrorAt(span, "a " + kind + " that is an array has 1 to " + most + " elements",
              length < 1 ? "how many there are stands here; values are given to all at once: "
                           "NAME = [1, 2];"
                         : "each element counts as a " + kind + ", of which a " + room.holder +
                               " has at most " + most);
  return false;
}

void ExpressionParser::NoMember() {
  in_.Unexpected("a name after '.'");
  // A word that begins a member would end the statement here, although it stands behind a dot.
  if (IsMemberWord(in_.Peek().kind)) in_.Take();
}

bool ExpressionParser::ParseArguments(Expr* call) {
  // Arguments are expressions with commas between them; there may be none.
  const Span opening = in_.Take().span;
  if (in_.TakeIf(TokenKind::kRightParen)) return true;
  do {
    Adopt(call, Parse());
    if (in_.failed()) return false;
  } while (in_.TakeIf(TokenKind::kComma));
  return in_.ExpectClosing(TokenKind::kRightParen, opening);
}

ExprPtr ExpressionParser::ParsePrimary() {
  // What an expression can begin with.
  const Token token = in_.Peek();
  switch (token.kind) {
    case TokenKind::kName: {
      // `not x`: two names in a row.
      const TokenKind next = in_.Peek(1).kind;
      if (next == TokenKind::kName || next == TokenKind::kSelf) ReportForeignOperator();
      ExprPtr expr = Node(ExprKind::kName, token.span);
      expr->name = in_.TextOf(in_.Take());
      return expr;
    }
    case TokenKind::kDollar: {
      ExprPtr expr = Node(ExprKind::kDollar, token.span);
      expr->name = in_.TextOf(in_.Take()).substr(1);
      return expr;
    }
    case TokenKind::kInt:
      return ParseInt();
    case TokenKind::kFloat: {
      ExprPtr expr = Node(ExprKind::kFloat, token.span);
      ParseNumber(expr.get());
      in_.Take();
      return expr;
    }
    case TokenKind::kTrue:
    case TokenKind::kFalse: {
      ExprPtr expr = Node(ExprKind::kBool, token.span);
      expr->integer = token.kind == TokenKind::kTrue ? 1 : 0;
      in_.Take();
      return expr;
    }
    case TokenKind::kSelf:
      in_.Take();
      return Node(ExprKind::kSelf, token.span);
    case TokenKind::kSuper:
      in_.Take();
      return Node(ExprKind::kSuper, token.span);
    case TokenKind::kText: {
      ExprPtr expr = Node(ExprKind::kText, token.span);
      expr->name = TextValue(in_.TextOf(in_.Take()));
      return expr;
    }
    case TokenKind::kLeftParen: {
      in_.Take();
      // Parentheses leave no trace in the tree.
      ExprPtr expr = Parse();
      if (!in_.failed()) in_.ExpectClosing(TokenKind::kRightParen, token.span);
      return expr;
    }
    case TokenKind::kLeftBracket:
      return ParseArray();
    // What stands here begins no expression; it is left for the caller to skip.
    default:
      break;
  }
  in_.Unexpected("an expression");
  return Node(ExprKind::kError, token.span);
}

ExprPtr ExpressionParser::ParseInt() {
  ExprPtr expr = Node(ExprKind::kInt, in_.Peek().span);
  ParseNumber(expr.get());
  in_.Take();
  return expr;
}

// An int may be one larger than the largest int, for the sake of -2147483648; the checker sees to
// that.
void ExpressionParser::ParseNumber(Expr* expr) {
  // The lexer has seen to it that the text is a number.
  const std::string text = in_.TextOf(in_.Peek());
  if (expr->kind == ExprKind::kInt) {
    const auto result = std::from_chars(text.data(), text.data() + text.size(), expr->integer);
    if (result.ec != std::errc() || expr->integer > 2147483648LL) {
      expr->integer = 0;
      in_.AddError(expr->span, "number does not fit an int").hint =
          "ints reach from -2147483648 to 2147483647; write a float as in 3000000000.0";
    }
    return;
  }
  // An infinite number would be refused by the verifier.
  expr->number = std::strtod(text.c_str(), nullptr);
  if (!(expr->number <= 3.4028234e38)) {
    expr->number = 0;
    in_.AddError(expr->span, "number is too large for a float").hint =
        "floats reach to about 3.4e38";
  }
}

}  // namespace morphbus::dynarole
