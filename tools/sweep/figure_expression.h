#pragma once
// Expressions over the figures of a run: "gait.forward_m >= 30 mm and num_faults == 0". What a
// sweep expects of its rows is one, and what is sought for by a search.

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/base/json.h"

namespace morphbus::tools {

/// What is wrong with an expression, and where in it (bytes).
struct ExpressionError {
  size_t offset = 0;
  std::string message;
};

/// An expression that was read. Its values are numbers (doubles, SI units), texts, truths, or null
/// for what is not known of a run, as the cost of transport of a robot that went nowhere. What is
/// computed from null is null; `and`, `or` and `not` go by Kleene's logic, so that `false and null`
/// is false.
///
///     or:       and { "or" and }
///     and:      not { "and" not }
///     not:      "not" not | compared
///     compared: sum [ ("==" | "!=" | "<" | "<=" | ">" | ">=") sum ]
///     sum:      product { ("+" | "-") product }
///     product:  signed { ("*" | "/") signed }
///     signed:   "-" signed | value
///     value:    NUMBER [UNIT] | "TEXT" | 'TEXT' | true | false | NAME | FUNCTION(or, …) | (or)
///
/// Units are mm, cm, m, km, ms, s, min, deg, rad and %; functions abs, sqrt, hypot, min and max. A
/// name is that of a figure, with points in it.
class FigureExpression {
 public:
  /// Reads an expression; `error` says what is wrong if there is none.
  static std::optional<FigureExpression> Read(std::string_view text, ExpressionError* error);

  /// A figure's value by its name; nothing if there is no such figure.
  using Lookup = std::function<std::optional<Json>(const std::string& name)>;
  /// The value for one run. `error` says what cannot be computed, as the sum of a text and a number
  /// or a name without a figure; the result is then null.
  [[nodiscard]] Json Evaluate(const Lookup& lookup, ExpressionError* error) const;

  /// The unit of a figure by its name, in SI symbols ("m/s"): "1" for a plain number, empty if it
  /// is not known.
  using UnitOf = std::function<std::string_view(const std::string& name)>;
  /// The first place at which values of two units are compared, added or subtracted, or are given
  /// to one function; nothing if there is none. What has no unit goes with everything: a number
  /// that is written without one, a product, a quotient and a root.
  [[nodiscard]] std::optional<ExpressionError> FindMixedUnits(const UnitOf& unit_of) const;

  /// The names of figures in it, and where each stands, in the order of the text.
  [[nodiscard]] const std::vector<std::pair<std::string, size_t>>& names() const { return names_; }
  /// As it was written.
  [[nodiscard]] const std::string& text() const { return text_; }

  /// A part of it, with the parts that it is made of.
  struct Node {
    enum class Kind { kValue, kName, kOperator, kFunction };
    Kind kind = Kind::kValue;
    size_t offset = 0;
    /// Of a value that value, and as the word the SI symbol of its unit, if it has one; of the
    /// others the name, the operator ("neg" for a sign), or the function.
    Json value;
    std::string word;
    std::vector<Node> parts;
  };

 private:
  std::string text_;
  std::shared_ptr<const Node> root_;
  std::vector<std::pair<std::string, size_t>> names_;
};

}  // namespace morphbus::tools
