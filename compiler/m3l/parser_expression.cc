#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "compiler/m3l/parser.h"

namespace morphbus::m3l::internal {
namespace {

/// True if the number that `text` writes is below 1.
bool IsBelowOne(std::string_view text) {
  // The digits before the exponent, and the place of the point among them.
  const size_t e = std::min(text.find_first_of("eE"), text.size());
  const std::string_view digits = text.substr(0, e);
  const size_t point = std::min(digits.find('.'), digits.size());
  const size_t first = digits.find_first_of("123456789");
  if (first == std::string_view::npos) return true;
  // The decimal exponent as the digits have it, then the one that is written; no file is long
  // enough for more than nine digits of it to matter.
  const double shift = first < point ? static_cast<double>(point - first) - 1.0
                                     : static_cast<double>(point) - static_cast<double>(first);
  if (e + 1 >= text.size()) return shift < 0.0;
  const bool negative = text[e + 1] == '-';
  std::string_view power = text.substr(e + 1);
  // The sign and leading zeros of the exponent say nothing here.
  while (!power.empty() && (power[0] < '1' || power[0] > '9')) power.remove_prefix(1);
  double exponent = 0.0;
  for (const char c : power.substr(0, 10)) exponent = 10.0 * exponent + (c - '0');
  return shift + (negative ? -exponent : exponent) < 0.0;
}

/// Value of a number token: infinity where it does not fit, which the evaluator rejects; nothing
/// where the lexer found that it is none.
std::optional<double> NumberValue(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) {
    // Both too large and too small end here; from_chars leaves `value` alone.
    return IsBelowOne(text) ? 0.0 : std::numeric_limits<double>::infinity();
  }
  return value;
}

/// The relations that are words.
const std::vector<std::string> kRelations = {"coincident", "parallel", "antiparallel"};

/// What was read as the name that the last operand binds and is a misspelt relation, as in
/// "p paralel q"; null if there is no such name.
const Name* MisspeltRelation(const Expr& expr) {
  const Expr* last = &expr;
  while (!last->children.empty()) last = &last->children.back();
  return source::NearestName(last->bound.text, kRelations).empty() ? nullptr : &last->bound;
}

}  // namespace

bool Parser::TooDeep() {
  if (depth_ < kMaxNesting) return false;
  // The error stands at the token that is too deep, not at the beginning of the expression.
  Error(Now().span, "nested deeper than " + std::to_string(kMaxNesting) + " levels");
  return true;
}

std::string Parser::RelationAt(size_t i) const {
  // Words and symbols are different kinds of tokens, so that "==" in a string is no relation.
  for (const std::string& word : kRelations) {
    if (IsWord(i, word)) return word;
  }
  for (const std::string_view op : {"==", "!=", "<", "<=", ">", ">="}) {
    if (IsSymbol(i, op)) return std::string(op);
  }
  return "";
}

Expr Parser::Node(ExprKind kind, size_t begin, Expr child) const {
  Expr node;
  node.kind = kind;
  node.children.push_back(std::move(child));
  node.span = SpanSince(begin);
  return node;
}

std::optional<Expr> Parser::ParseChain(ExprKind kind, std::initializer_list<std::string_view> ops,
                                       std::optional<Expr> (Parser::*operand)()) {
  const auto is_operator = [&] {
    return std::ranges::any_of(ops, [&](std::string_view op) { return Is(op) || IsWord(at_, op); });
  };
  const size_t begin = at_;
  std::optional<Expr> first = (this->*operand)();
  // A single operand stays as it is and gets no node around it.
  if (!first || !is_operator()) return first;
  // `a and b and c` is one flat node with three children: a long sum must not become a deep tree.
  Expr chain = Node(kind, begin, std::move(*first));
  while (is_operator()) {
    // Signs are kept, as sums and products have two kinds of them.
    if (IsKind(at_, TokenKind::kSymbol)) chain.ops += Text(at_);
    ++at_;
    std::optional<Expr> next = (this->*operand)();
    if (!next) return std::nullopt;
    chain.children.push_back(std::move(*next));
  }
  chain.span = SpanSince(begin);
  return chain;
}

// Every nested expression passes through here, so that the depth is counted once for each level.
std::optional<Expr> Parser::ParseOr() {
  if (TooDeep()) return std::nullopt;
  ++depth_;
  std::optional<Expr> expr = ParseChain(ExprKind::kOr, {"or"}, &Parser::ParseAnd);
  --depth_;
  return expr;
}

std::optional<Expr> Parser::ParseAnd() {
  return ParseChain(ExprKind::kAnd, {"and"}, &Parser::ParseNot);
}

std::optional<Expr> Parser::ParseNot() {
  if (!IsWord(at_, "not")) return ParseRelation();
  // `not not x` recurses, and so counts as nesting.
  if (TooDeep()) return std::nullopt;
  const size_t begin = at_++;
  ++depth_;
  std::optional<Expr> operand = ParseNot();
  --depth_;
  if (!operand) return operand;
  return Node(ExprKind::kNot, begin, std::move(*operand));
}

std::optional<Expr> Parser::ParseRelation() {
  const size_t begin = at_;
  // Without a relation behind it a sum is a condition of its own: a flag, say.
  std::optional<Expr> left = ParseSum();
  const std::string op = left ? RelationAt(at_) : "";
  if (op.empty()) return left;
  ++at_;
  // The right side is a sum too: relations bind weaker than arithmetic.
  std::optional<Expr> right = ParseSum();
  if (!right) return std::nullopt;
  // `a < b < c` would compare a truth value with a number.
  if (!RelationAt(at_).empty()) {
    return Error(Now().span, "comparisons do not chain").Hint("join two comparisons with 'and'");
  }
  Expr relation = Node(ExprKind::kRelation, begin, std::move(*left));
  relation.text = op;
  relation.children.push_back(std::move(*right));
  return relation;
}

std::optional<Expr> Parser::ParseSum() {
  return ParseChain(ExprKind::kSum, {"+", "-"}, &Parser::ParseProduct);
}

std::optional<Expr> Parser::ParseProduct() {
  return ParseChain(ExprKind::kProduct, {"*", "/"}, &Parser::ParseUnary);
}

std::optional<Expr> Parser::ParseUnary() {
  if (!Is("-") && !Is("+")) return ParsePrimary();
  if (TooDeep()) return std::nullopt;
  // Signs may be repeated: `--x` is x.
  const bool negative = Is("-");
  const size_t begin = at_++;
  ++depth_;
  std::optional<Expr> operand = ParseUnary();
  --depth_;
  // A plus sign changes nothing and leaves no node.
  if (!operand || !negative) return operand;
  return Node(ExprKind::kNegate, begin, std::move(*operand));
}

std::optional<Expr> Parser::ParsePrimary() {
  const size_t begin = at_;
  Expr expr;
  // The first token says what kind of primary expression it is.
  if (IsKind(at_, TokenKind::kNumber)) {
    // The lexer has reported what is no number.
    std::string_view text = Text(at_++);
    const bool degrees = text.ends_with("deg");
    expr.angle = degrees || text.ends_with("rad");
    if (expr.angle) text.remove_suffix(3);
    const std::optional<double> number = NumberValue(text);
    if (!number) return std::nullopt;
    expr.number = degrees ? *number * std::numbers::pi / 180.0 : *number;
  } else if (IsKind(at_, TokenKind::kString)) {
    expr.kind = ExprKind::kString;
    expr.text = StringValue(Text(at_++));
  } else if (Is("(") || Is("[")) {
    // An anonymous axis looks like a tuple until its third token.
    if (IsSymbol(at_, "(") && IsWord(at_ + 1, "axis") && IsSymbol(at_ + 2, ":")) {
      return ParseAnonymousAxis({}, begin);
    }
    // Parentheses make a tuple, also of one; brackets make a list.
    const bool tuple = Is("(");
    expr.kind = tuple ? ExprKind::kTuple : ExprKind::kList;
    ++at_;
    if (!ParseElements(begin, tuple ? ")" : "]", expr)) return std::nullopt;
  } else if (IsKind(at_, TokenKind::kWord) && !IsOperatorWord(Text(at_)) && !StartsStatement(at_)) {
    // No value can be called like a keyword, but an argument can: axis=NAME.
    if (IsKeyword(Text(at_)) && !(brackets_ > 0 && IsSymbol(at_ + 1, "="))) {
      return Error(Now().span,
                   "'" + std::string(Text(at_)) + "' is a keyword, it cannot stand here");
    }
    return ParsePath();
  } else {
    // At a statement the missing value is better shown where it should have stood.
    const bool next = AtEnd() || StartsStatement(at_);
    return Error(next && at_ > 0 ? TokenAt(at_ - 1).span : Now().span,
                 next ? "a value is missing after " + Described(at_ - 1)
                      : "expected a value, found " + Described(at_));
  }
  expr.span = SpanSince(begin);
  return expr;
}

std::optional<Expr> Parser::ParsePath() {
  const size_t begin = at_;
  Expr expr;
  expr.kind = ExprKind::kPath;
  // Names joined by points; an anonymous axis may end the path.
  expr.path.push_back(NameAt(at_++));
  while (Is(".")) {
    ++at_;
    if (IsKind(at_, TokenKind::kWord)) {
      expr.path.push_back(NameAt(at_++));
    } else if (Is("(") && IsWord(at_ + 1, "axis")) {
      return ParseAnonymousAxis(std::move(expr), begin);
    } else {
      return Error(Now().span, "expected a name after '.', found " + Described(at_));
    }
  }
  expr.span = SpanSince(begin);
  // Only a single name can be called; in `a.b (` the bracket begins something else.
  if (Is("(") && expr.path.size() == 1) return ParseCall(std::move(expr));
  // A second name behind a path, within brackets, binds it: `MTRAN m1`.
  const bool bound = brackets_ > 0 && IsKind(at_, TokenKind::kWord) && !IsOperatorWord(Text(at_)) &&
                     !StartsStatement(at_);
  if (bound) {
    expr.kind = ExprKind::kTyped;
    expr.bound = NameAt(at_++);
    expr.span = SpanSince(begin);
  }
  return expr;
}

std::optional<Expr> Parser::ParseCall(Expr function) {
  // `f(a, b)`: the name has been read, the elements follow.
  const size_t open = at_++;
  // The elements become the arguments.
  function.kind = ExprKind::kCall;
  if (!ParseElements(open, ")", function)) return std::nullopt;
  function.span.end = TokenAt(at_ - 1).span.end;
  return function;
}

std::optional<Expr> Parser::ParseAnonymousAxis(Expr path, size_t begin) {
  const size_t open = at_++;
  // The keyword `axis` was seen by the caller.
  ++at_;  // axis
  if (!Accept(":")) return Error(Now().span, "expected ':' after 'axis', found " + Described(at_));
  if (TooDeep()) return std::nullopt;
  // The axis has attributes of its own, whose brackets are counted apart.
  const int brackets = brackets_;
  Declaration axis;
  ++depth_;
  ++axes_;
  ParseBody(axis, {}, true);
  --axes_;
  --depth_;
  brackets_ = brackets;
  // The attribute around the axis is broken where the axis is.
  if (axis.broken) return std::nullopt;
  if (!Accept(")")) {
    if (AtEnd() || StartsStatement(at_)) Error(TokenAt(open).span, "'(' is never closed");
    return std::nullopt;
  }
  path.kind = ExprKind::kAxis;
  // The attributes are kept apart from the children, as they have keys.
  path.axis = std::make_shared<const std::vector<Attribute>>(std::move(axis.attributes));
  path.span = SpanSince(begin);
  return path;
}

bool Parser::ParseElements(size_t open, std::string_view close, Expr& into) {
  ++brackets_;
  bool ok = true;
  // An empty list is allowed; behind a comma an element must follow.
  while (ok && !(Is(close) && into.children.empty())) {
    std::optional<Expr> element = ParseElement();
    ok = element.has_value();
    if (!ok) break;
    into.children.push_back(std::move(*element));
    if (Is(close)) break;
    if (Accept(",")) continue;
    // Neither the closing bracket nor a comma: the hints are for the slips that people make.
    ok = false;
    if (AtEnd() || StartsStatement(at_)) {
      Error(TokenAt(open).span, "'" + std::string(Text(open)) + "' is never closed");
    } else if (const Name* relation = MisspeltRelation(into.children.back())) {
      Error(relation->span, "expected a relation, found '" + relation->text + "'").hint =
          source::NearestHint(relation->text, kRelations);
    } else {
      source::Diagnostic& d = Error(
          Now().span, "expected ',' or '" + std::string(close) + "', found " + Described(at_));
      // A single '=' in a condition was meant as a comparison.
      if (Is("=")) d.hint = "'==' compares";
      const ExprKind last = into.children.back().kind;
      if (Is("=") && last == ExprKind::kOption) {
        d.hint = "write a number after the connection's name, or the turn without a name: rot=180";
      }
      // Two conditions side by side lack the word between them.
      const bool goes_on = IsKind(at_, TokenKind::kWord) || Is(".") || Is("(");
      if (goes_on && (last == ExprKind::kRelation || last == ExprKind::kAnd ||
                      last == ExprKind::kOr || last == ExprKind::kNot)) {
        d.hint = "conditions are joined with 'and' or 'or'";
      }
      d.hint = source::NearestHint(std::string(Text(at_)), kRelations, d.hint);
      d.notes.push_back({TokenAt(open).span, "opened here"});
    }
  }
  --brackets_;
  if (ok) ++at_;
  return ok;
}

std::optional<Expr> Parser::ParseElement() {
  const size_t begin = at_;
  std::optional<Expr> expr = ParseOr();
  // Only a path can be set or numbered; anything else is an element as it stands.
  if (!expr || expr->kind != ExprKind::kPath) return expr;
  if (!Is("=") && !Is(":")) return expr;
  // Within brackets a path may be set to a value, or numbered as an option.
  expr->kind = Is("=") ? ExprKind::kAssign : ExprKind::kOption;
  ++at_;
  std::optional<Expr> value = ParseOr();
  if (!value) return std::nullopt;
  expr->children.push_back(std::move(*value));
  expr->span = SpanSince(begin);
  return expr;
}

}  // namespace morphbus::m3l::internal
