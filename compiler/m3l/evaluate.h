#pragma once
// Values of M3L expressions. All functions report what is wrong and then return nothing.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/model/robot_model.h"

namespace morphbus::m3l {

/// `expr` without the parentheses around it, however many there are. The result is a part of
/// `expr`.
const Expr& Unwrapped(const Expr& expr);

/// The name that a path of one name is, else "" (not reported).
std::string SingleName(const Expr& expr);

/// The path as it is written, for messages: "a.b.c".
std::string PathText(const std::vector<Name>& path);

/// The value of an arithmetic expression over numbers and constants with pi, sqrt, sin and cos. A
/// result that is not finite is an error.
std::optional<double> EvaluateNumber(const Expr& expr, source::Diagnostics* diagnostics);

/// Whether the expression was written as an angle: a number in it, outside of calls, has `deg` or
/// `rad` behind it.
bool HasAngle(const Expr& expr);

/// The value of `(x, y, z)`, which must be three finite numbers. `what` names the value in
/// messages: "coords".
std::optional<Eigen::Vector3d> EvaluateVector(const Expr& expr, const std::string& what,
                                              source::Diagnostics* diagnostics);

/// The value of a fixed attribute: a number, a string, true or false.
std::optional<model::AttributeValue> EvaluateAttribute(const Expr& expr,
                                                       source::Diagnostics* diagnostics);

/// The values that a free state variable may take: `[bool]` or `["a","b"]`.
std::optional<std::vector<model::AttributeValue>> EvaluateStates(const Expr& expr,
                                                                 source::Diagnostics* diagnostics);

/// An interval with lower <= upper.
/// Joint limits are one; the unit is that of the joint (rad, or model units).
struct Interval {
  double lower = 0.0;
  double upper = 0.0;
};
/// The interval of `[lo, hi]`, two finite numbers; an error if they are the wrong way round.
std::optional<Interval> EvaluateInterval(const Expr& expr, source::Diagnostics* diagnostics);

// The texts of numbers and values come from the model, so that messages and files write them alike.
using model::NumberText;
using model::ValueText;

/// The attributes of one declaration, read by key. The constructor reports repeated keys and, with
/// `known` not empty, keys that are not known.
class AttributeReader {
 public:
  /// `what` names the declaration in messages: "link 'bar'".
  AttributeReader(const Declaration& declaration, std::string what,
                  const std::vector<std::string>& known, source::Diagnostics* diagnostics);

  /// The value of `key`; null if it is absent, did not parse, or has no value (reported).
  const Expr* Optional(const std::string& key);
  /// The same, and absence is reported with `hint`, unless the declaration is broken.
  const Expr* Required(const std::string& key, const std::string& hint);
  /// True if `key` stands there as a flag or as true.
  bool Flag(const std::string& key);
  /// The declaration's name for messages.
  [[nodiscard]] const std::string& what() const { return what_; }
  /// True if some key was unknown, which may be a slip for one that is missing.
  [[nodiscard]] bool had_unknown() const { return had_unknown_; }

 private:
  const Declaration& declaration_;
  std::string what_;
  std::vector<std::string> known_;
  bool had_unknown_ = false;
  source::Diagnostics& diagnostics_;
};

}  // namespace morphbus::m3l
