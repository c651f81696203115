#include "tools/sweep/figure_expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>

#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

using Node = FigureExpression::Node;

/// A unit that may stand behind a number, in SI units.
struct Unit {
  std::string_view name;
  double factor;
  std::string_view si;
};
constexpr std::array<Unit, 10> kUnits = {{{"mm", 1e-3, "m"},
                                          {"cm", 1e-2, "m"},
                                          {"m", 1.0, "m"},
                                          {"km", 1e3, "m"},
                                          {"ms", 1e-3, "s"},
                                          {"s", 1.0, "s"},
                                          {"min", 60.0, "s"},
                                          {"deg", std::numbers::pi / 180, "rad"},
                                          {"rad", 1.0, "rad"},
                                          {"%", 1e-2, "1"}}};

/// A function, and how many numbers it takes.
struct Function {
  std::string_view name;
  size_t least, most;
};
constexpr size_t kAny = 100;
constexpr std::array<Function, 5> kFunctions = {
    {{"abs", 1, 1}, {"sqrt", 1, 1}, {"hypot", 2, 3}, {"min", 1, kAny}, {"max", 1, kAny}}};

bool BeginsName(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool ContinuesName(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Reads one expression by descent, an operator's strength a function. The first error counts.
class ExpressionReader {
 public:
  explicit ExpressionReader(std::string_view text) : text_(text) {}

  std::optional<Node> Read() {
    std::optional<Node> node = ReadOr();
    if (node && at_ < text_.size()) return Wrong("there is something behind the expression");
    return node;
  }
  [[nodiscard]] const ExpressionError& error() const { return error_; }
  std::vector<std::pair<std::string, size_t>> names;

 private:
  /// Keeps the first error.
  std::nullopt_t Wrong(std::string message) {
    if (error_.message.empty()) error_ = {std::min(at_, text_.size()), std::move(message)};
    return std::nullopt;
  }

  void SkipBlanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  /// Takes a sign if it comes next.
  bool Take(std::string_view sign) {
    SkipBlanks();
    if (!text_.substr(at_).starts_with(sign)) return false;
    at_ += sign.size();
    SkipBlanks();
    return true;
  }
  /// The word that comes next, without taking it.
  [[nodiscard]] std::string_view Word() const {
    size_t end = at_;
    if (end >= text_.size() || !BeginsName(text_[end])) return {};
    while (end < text_.size() && ContinuesName(text_[end])) ++end;
    return text_.substr(at_, end - at_);
  }
  bool TakeWord(std::string_view word) {
    SkipBlanks();
    if (Word() != word) return false;
    at_ += word.size();
    SkipBlanks();
    return true;
  }

  /// A chain of parts, of which each is joined to those before it.
  template <typename Part, typename TakeOperator>
  std::optional<Node> ReadChain(Part part, TakeOperator take) {
    std::optional<Node> left = part();
    while (left) {
      const size_t offset = at_;
      const std::string_view word = take();
      if (word.empty()) return left;
      std::optional<Node> right = part();
      if (!right) return std::nullopt;
      // Chains are taken down by recursion, too, as what they are made of.
      if (++size_ > kMostParts) return Wrong("the expression is too long");
      Node both{Node::Kind::kOperator, offset, nullptr, std::string(word), {}};
      both.parts.push_back(std::move(*left));
      both.parts.push_back(std::move(*right));
      left = std::move(both);
    }
    return left;
  }
  /// The first of these signs that comes next; empty if none does.
  std::string_view TakeOneOf(std::initializer_list<std::string_view> signs) {
    const auto found = std::ranges::find_if(signs, [this](auto sign) { return Take(sign); });
    return found == signs.end() ? std::string_view() : *found;
  }

  // From the weakest operator to the strongest, each with the reader of the next one for its parts:
  // or, and, not, comparisons, sums, products, signs.
  std::optional<Node> ReadOr() {
    if (++depth_ > kMostDepth) return Wrong("the expression has too many brackets");
    std::optional<Node> node =
        ReadChain([this] { return ReadAnd(); },
                  [this] { return TakeWord("or") ? std::string_view("or") : std::string_view(); });
    --depth_;
    return node;
  }
  std::optional<Node> ReadAnd() {
    return ReadChain([this] { return ReadNot(); },
                     [this] { return TakeWord("and") ? std::string_view("and") : ""; });
  }
  std::optional<Node> ReadNot() {
    const size_t offset = at_;
    if (TakeWord("not")) return ReadPrefixed("not", offset, [this] { return ReadNot(); });
    return ReadCompared();
  }
  /// What stands behind a sign or a `not`, of which there may be many in a row.
  template <typename Part>
  std::optional<Node> ReadPrefixed(const char* word, size_t offset, Part part) {
    if (++depth_ > kMostDepth) return Wrong("the expression has too many signs");
    std::optional<Node> inner = part();
    --depth_;
    if (!inner) return std::nullopt;
    Node node{Node::Kind::kOperator, offset, nullptr, word, {}};
    node.parts.push_back(std::move(*inner));
    return node;
  }
  std::optional<Node> ReadCompared() {
    // In a < b < c the second comparison would be of a truth: it is left, as something behind the
    // expression.
    bool once = false;
    return ReadChain([this] { return ReadSum(); },
                     [this, &once]() -> std::string_view {
                       if (once) return {};
                       once = true;
                       return TakeOneOf({"==", "!=", "<=", ">=", "<", ">"});
                     });
  }
  std::optional<Node> ReadSum() {
    return ReadChain([this] { return ReadProduct(); }, [this] { return TakeOneOf({"+", "-"}); });
  }
  std::optional<Node> ReadProduct() {
    return ReadChain([this] { return ReadSigned(); }, [this] { return TakeOneOf({"*", "/"}); });
  }
  std::optional<Node> ReadSigned() {
    const size_t offset = at_;
    if (Take("-")) return ReadPrefixed("neg", offset, [this] { return ReadSigned(); });
    return ReadValue();
  }

  /// A number, a text, a truth, a name, a function, or an expression in brackets.
  std::optional<Node> ReadValue() {
    SkipBlanks();
    const size_t offset = at_;
    if (at_ >= text_.size()) return Wrong("a value is missing");
    const char c = text_[at_];
    if (std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.') return ReadNumberHere();
    if (c == '"' || c == '\'') {
      const size_t end = text_.find(c, at_ + 1);
      if (end == std::string_view::npos) return Wrong("the text has no end");
      at_ = end + 1;
      SkipBlanks();
      return Node{Node::Kind::kValue, offset, text_.substr(offset + 1, end - offset - 1), "", {}};
    }
    if (Take("(")) {
      std::optional<Node> inner = ReadOr();
      if (inner && !Take(")")) return Wrong("expected )");
      return inner;
    }
    if (Take("=")) return Wrong("equality is written ==");
    if (!BeginsName(c)) return Wrong("a value is missing");
    if (TakeWord("true")) return Node{Node::Kind::kValue, offset, true, "", {}};
    if (TakeWord("false")) return Node{Node::Kind::kValue, offset, false, "", {}};
    return ReadName();
  }

  /// A number, with its unit if it has one.
  std::optional<Node> ReadNumberHere() {
    const size_t offset = at_;
    double number = 0;
    const auto read = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    if (read.ec != std::errc() || !std::isfinite(number)) return Wrong("this is no number");
    at_ = static_cast<size_t>(read.ptr - text_.data());
    SkipBlanks();
    const std::string_view word = Take("%") ? std::string_view("%") : Word();
    if (word.empty() || word == "and" || word == "or") {
      return Node{Node::Kind::kValue, offset, number, "", {}};
    }
    const auto unit = std::ranges::find(kUnits, word, &Unit::name);
    if (unit == kUnits.end()) {
      return Wrong(fmt::format("there is no unit '{}'; there are {}", word,
                               fmt::join(NamesOf(kUnits), ", ")));
    }
    if (word != "%") at_ += word.size();
    SkipBlanks();
    return Node{Node::Kind::kValue, offset, number * unit->factor, std::string(unit->si), {}};
  }

  /// A figure's name, or a function with what it is given.
  std::optional<Node> ReadName() {
    const size_t offset = at_;
    while (at_ < text_.size() &&
           (ContinuesName(text_[at_]) ||
            (text_[at_] == '.' && at_ + 1 < text_.size() && ContinuesName(text_[at_ + 1])))) {
      ++at_;
    }
    const std::string name(text_.substr(offset, at_ - offset));
    if (!Take("(")) {
      SkipBlanks();
      names.emplace_back(name, offset);
      return Node{Node::Kind::kName, offset, nullptr, name, {}};
    }
    const auto function = std::ranges::find(kFunctions, name, &Function::name);
    if (function == kFunctions.end()) {
      at_ = offset;
      return Wrong(fmt::format("there is no function '{}'; there are {}", name,
                               fmt::join(NamesOf(kFunctions), ", ")));
    }
    Node call{Node::Kind::kFunction, offset, nullptr, name, {}};
    do {
      std::optional<Node> part = ReadOr();
      if (!part) return std::nullopt;
      if (++size_ > kMostParts) return Wrong("the expression is too long");
      call.parts.push_back(std::move(*part));
    } while (Take(","));
    if (!Take(")")) return Wrong("expected )");
    if (call.parts.size() >= function->least && call.parts.size() <= function->most) return call;
    at_ = offset;
    return Wrong(fmt::format("{} does not take {} values", name, call.parts.size()));
  }

  /// Brackets and signs within each other, and parts in all: what is taken apart by recursion.
  static constexpr int kMostDepth = 60;
  static constexpr int kMostParts = 1000;

  std::string_view text_;
  size_t at_ = 0;
  int depth_ = 0;
  int size_ = 0;
  ExpressionError error_;
};

/// Computes one run's value. The first error counts.
class Evaluation {
 public:
  Evaluation(const FigureExpression::Lookup& lookup, ExpressionError* error)
      : lookup_(lookup), error_(error) {}

  Json ValueOf(const Node& node) {
    switch (node.kind) {
      case Node::Kind::kValue:
        return node.value;
      case Node::Kind::kName: {
        const std::optional<Json> value = lookup_(node.word);
        return value ? *value : Wrong(node, fmt::format("there is no figure '{}'", node.word));
      }
      case Node::Kind::kFunction:
        return CallOf(node);
      case Node::Kind::kOperator:
        break;
    }
    if (node.word == "and" || node.word == "or") return LogicOf(node);
    std::vector<Json> values;
    for (const Node& part : node.parts) values.push_back(ValueOf(part));
    // What is not known stays unknown, whatever is done with it.
    if (std::ranges::any_of(values, &Json::is_null)) return nullptr;
    if (node.word == "not") {
      return values[0].is_boolean() ? Json(!values[0].get<bool>())
                                    : Wrong(node, "'not' is for what is true or false");
    }
    if (node.word == "neg" || std::string_view("+-*/").find(node.word) != std::string_view::npos) {
      return NumberOf(node, values);
    }
    return ComparisonOf(node, values[0], values[1]);
  }

 private:
  Json Wrong(const Node& node, std::string message) {
    if (error_->message.empty()) *error_ = {node.offset, std::move(message)};
    return nullptr;
  }

  /// What is no finite number, as the quotient by 0, is not known.
  static Json Known(double number) { return std::isfinite(number) ? Json(number) : Json(nullptr); }

  /// `and` and `or` of three values: true, false and unknown.
  Json LogicOf(const Node& node) {
    // One of this value decides, whatever the other one is.
    const bool decides = node.word == "or";
    bool known = true;
    for (const Node& part : node.parts) {
      const Json value = ValueOf(part);
      if (value.is_null()) {
        known = false;
      } else if (!value.is_boolean()) {
        return Wrong(part, fmt::format("'{}' is for what is true or false", node.word));
      } else if (value.get<bool>() == decides) {
        return decides;
      }
    }
    return known ? Json(!decides) : Json(nullptr);
  }

  Json NumberOf(const Node& node, const std::vector<Json>& values) {
    if (!std::ranges::all_of(values, &Json::is_number)) {
      return Wrong(node, "only numbers can be computed with");
    }
    const double a = values[0].get<double>();
    if (node.word == "neg") return -a;
    const double b = values[1].get<double>();
    if (node.word == "+") return Known(a + b);
    if (node.word == "-") return Known(a - b);
    return Known(node.word == "*" ? a * b : a / b);
  }

  /// Texts and truths can be equal; only numbers have an order.
  Json ComparisonOf(const Node& node, const Json& a, const Json& b) {
    const bool alike = (a.is_number() && b.is_number()) || (a.is_string() && b.is_string()) ||
                       (a.is_boolean() && b.is_boolean());
    if (!alike) return Wrong(node, "values of unlike kinds cannot be compared");
    if (node.word == "==") return a == b;
    if (node.word == "!=") return a != b;
    if (!a.is_number()) return Wrong(node, "only numbers are smaller or larger");
    const double x = a.get<double>(), y = b.get<double>();
    if (node.word == "<") return x < y;
    if (node.word == "<=") return x <= y;
    return node.word == ">" ? x > y : x >= y;
  }

  /// A function, which is unknown where one of its numbers is.
  Json CallOf(const Node& node) {
    std::vector<double> numbers;
    bool known = true;
    for (const Node& part : node.parts) {
      const Json value = ValueOf(part);
      known = known && !value.is_null();
      if (value.is_null()) continue;
      if (!value.is_number()) return Wrong(part, fmt::format("{} is for numbers", node.word));
      numbers.push_back(value.get<double>());
    }
    if (!known) return nullptr;
    if (node.word == "abs") return std::abs(numbers[0]);
    if (node.word == "sqrt") return Known(std::sqrt(numbers[0]));
    if (node.word == "min") return *std::ranges::min_element(numbers);
    if (node.word == "max") return *std::ranges::max_element(numbers);
    double squares = 0;
    for (const double number : numbers) squares += number * number;
    return Known(std::sqrt(squares));
  }

  const FigureExpression::Lookup& lookup_;
  ExpressionError* error_;
};

/// Looks for the first place at which units are mixed.
class UnitCheck {
 public:
  explicit UnitCheck(const FigureExpression::UnitOf& unit_of) : unit_of_(unit_of) {}

  /// The unit of what a part of the expression comes to; empty if it is not known.
  std::string_view UnitOf(const Node& node) {
    if (node.kind == Node::Kind::kValue) return node.word;
    if (node.kind == Node::Kind::kName) return unit_of_(node.word);
    // What comes of these has the unit of their parts. Of products, quotients and roots the unit is
    // not worked out, so that nothing can be said against them.
    static constexpr std::array<std::string_view, 7> kKeep = {"neg",   "+",   "-",  "abs",
                                                              "hypot", "min", "max"};
    const bool keeps = std::ranges::find(kKeep, node.word) != kKeep.end();
    const bool compares = std::string_view("=!<>").find(node.word[0]) != std::string_view::npos;
    // A part without a known unit goes with every other one.
    std::string_view unit;
    for (const Node& part : node.parts) {
      const std::string_view other = UnitOf(part);
      if (unit.empty()) unit = other;
      if ((keeps || compares) && !other.empty() && other != unit) Wrong(node, unit, other);
    }
    return keeps ? unit : std::string_view();
  }
  [[nodiscard]] const std::optional<ExpressionError>& error() const { return error_; }

 private:
  void Wrong(const Node& node, std::string_view a, std::string_view b) {
    const auto words = [](std::string_view unit) {
      return unit == "1" ? "without a unit" : fmt::format("in {}", unit);
    };
    // Parts are looked at before the whole, so that the first error is the innermost.
    if (error_) return;
    error_ = {node.offset,
              fmt::format("values {} and {} cannot be compared or added; expected the same unit",
                          words(a), words(b))};
  }

  const FigureExpression::UnitOf& unit_of_;
  std::optional<ExpressionError> error_;
};

}  // namespace

std::optional<FigureExpression> FigureExpression::Read(std::string_view text,
                                                       ExpressionError* error) {
  ExpressionReader reader(text);
  std::optional<Node> root = reader.Read();
  if (!root) {
    *error = reader.error();
    return std::nullopt;
  }
  FigureExpression expression;
  expression.text_ = text;
  expression.root_ = std::make_shared<const Node>(std::move(*root));
  expression.names_ = std::move(reader.names);
  return expression;
}

Json FigureExpression::Evaluate(const Lookup& lookup, ExpressionError* error) const {
  const Json value = Evaluation(lookup, error).ValueOf(*root_);
  return error->message.empty() ? value : Json(nullptr);
}

std::optional<ExpressionError> FigureExpression::FindMixedUnits(const UnitOf& unit_of) const {
  UnitCheck check(unit_of);
  check.UnitOf(*root_);
  return check.error();
}

}  // namespace morphbus::tools
