#include "compiler/dynarole/constant_parser.h"

#include <memory>
#include <string>
#include <utility>

namespace morphbus::dynarole {

using source::Span;

bool ConstantParser::AtConstant() const {
  return in_.Is(TokenKind::kConst) ||
         (in_.Is(TokenKind::kName) && in_.TextOf(in_.Peek()) == "param" &&
          in_.Peek(1).kind == TokenKind::kName);
}

bool ConstantParser::AtEnumeration() const {
  return in_.Is(TokenKind::kName) && in_.TextOf(in_.Peek()) == "enum" &&
         in_.Peek(1).kind == TokenKind::kName && in_.Peek(2).kind == TokenKind::kLeftBrace;
}

void ConstantParser::Parse(std::vector<ConstantDecl>* constants) {
  if (AtConstant()) {
    ParseConstant(constants);
  } else {
    ParseEnumeration(constants);
  }
}

// A name that is known nowhere yet, and its value, which the checker computes.
void ConstantParser::ParseConstant(std::vector<ConstantDecl>* constants) {
  const bool parameter = in_.Take().kind != TokenKind::kConst;
  if (!in_.Is(TokenKind::kName)) {
    in_.Unexpected("the name of the constant");
    return;
  }
  ConstantDecl constant;
  constant.name_span = in_.Peek().span;
  constant.name = in_.TextOf(in_.Take());
  const std::string what = (parameter ? "the parameter '" : "the constant '") + constant.name + "'";
  if (!in_.Expect(TokenKind::kAssign, "and the value of " + what)) return;
  constant.expr = expressions_.Parse();
  if (parameter) ParseRange(&constant);
  in_.ExpectSemicolon(what);
  // One whose range was not understood counts as a constant, so that its name is known.
  if (constant.most == nullptr) constant.least = nullptr;
  Add(std::move(constant), constants);
}

// `in [least, most]`; `in` is a word in this place only.
void ConstantParser::ParseRange(ConstantDecl* parameter) {
  if (in_.failed()) return;
  if (!in_.Is(TokenKind::kName) || in_.TextOf(in_.Peek()) != "in") {
    in_.Unexpected("'in' and the range of the parameter '" + parameter->name + "'",
                   "for example: param " + parameter->name + " = 30.0 in [10, 60];");
    return;
  }
  in_.Take();
  const Span opening = in_.Peek().span;
  if (!in_.Expect(TokenKind::kLeftBracket, "before the range")) return;
  parameter->least = expressions_.Parse();
  if (in_.failed() || !in_.Expect(TokenKind::kComma, "and the largest value")) return;
  parameter->most = expressions_.Parse();
  in_.ExpectClosing(TokenKind::kRightBracket, opening);
}

void ConstantParser::ParseEnumeration(std::vector<ConstantDecl>* constants) {
  in_.Take();
  const std::string name = in_.TextOf(in_.Peek());
  enumerations_.push_back({name, in_.Take().span});
  const Span opening = in_.Take().span;
  int64_t next = 0;
  // A comma may stand behind the last value.
  do {
    if (!in_.Is(TokenKind::kName)) {
      in_.Unexpected("the name of a value of '" + name + "'",
                     "for example: enum Phase { LIFT, SWING }");
      return;
    }
    ConstantDecl value;
    value.enumeration = static_cast<int>(enumerations_.size()) - 1;
    value.name_span = in_.Peek().span;
    value.name = in_.TextOf(in_.Take());
    if (in_.TakeIf(TokenKind::kAssign) && !ParseNumber(&next)) return;
    // The number stands for an expression that nobody wrote, so that messages show the name.
    value.expr = std::make_unique<Expr>();
    value.expr->kind = ExprKind::kInt;
    value.expr->span = value.expr->name_span = value.name_span;
    value.expr->integer = next++;
    Add(std::move(value), constants);
  } while (in_.TakeIf(TokenKind::kComma) && !in_.Is(TokenKind::kRightBrace));
  in_.ExpectClosing(TokenKind::kRightBrace, opening);
  in_.TakeIf(TokenKind::kSemicolon);
}

bool ConstantParser::ParseNumber(int64_t* number) {
  const bool negative = in_.TakeIf(TokenKind::kMinus);
  if (!in_.Is(TokenKind::kInt)) {
    in_.Unexpected("a number", "the values of an enumeration are ints: enum Phase { LIFT = 1 }");
    return false;
  }
  // The checker refuses what fits an int behind a sign only.
  *number = expressions_.ParseInt()->integer;
  if (negative) *number = -*number;
  return true;
}

void ConstantParser::Add(ConstantDecl constant, std::vector<ConstantDecl>* constants) {
  if (constants->size() < kMaxMembers) return constants->push_back(std::move(constant));
  in_.GiveUp(constant.name_span, "too many constants",
             "at most " + std::to_string(kMaxMembers) + " in one place");
}

}  // namespace morphbus::dynarole
