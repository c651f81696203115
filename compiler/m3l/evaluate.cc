#include "compiler/m3l/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace morphbus::m3l {
namespace {

/// The value of sqrt, sin or cos.
std::optional<double> Call(const Expr& expr, source::Diagnostics* diagnostics) {
  // The functions that docs/m3l.md names, and no others.
  const std::string& function = expr.path[0].text;
  if (function != "sqrt" && function != "sin" && function != "cos") {
    return diagnostics->Error(expr.path[0].span, "unknown function '" + function + "'")
        .Hint("numbers are computed with + - * / sqrt sin cos and pi");
  }
  if (expr.children.size() != 1) {
    // All three functions take one number.
    return diagnostics->Error(expr.span, "'" + function + "' takes one number");
  }
  const std::optional<double> x = EvaluateNumber(expr.children[0], diagnostics);
  if (!x) return std::nullopt;
  if (function == "sqrt" && *x < 0.0) {
    // The square root is the only one that is not defined for every number.
    return diagnostics->Error(expr.span, "square root of the negative number " + NumberText(*x));
  }
  return function == "sqrt" ? std::sqrt(*x) : function == "sin" ? std::sin(*x) : std::cos(*x);
}

/// A sum or product, worked out from left to right; an operand with an error ends it.
std::optional<double> Chain(const Expr& expr, source::Diagnostics* diagnostics) {
  std::optional<double> value = EvaluateNumber(expr.children[0], diagnostics);
  for (size_t i = 1; i < expr.children.size(); ++i) {
    const std::optional<double> operand = EvaluateNumber(expr.children[i], diagnostics);
    // Each operator stands before its operand.
    if (!operand || !value) return std::nullopt;
    switch (expr.ops[i - 1]) {
      case '+':
        *value += *operand;
        break;
      case '-':
        *value -= *operand;
        break;
      case '*':
        *value *= *operand;
        break;
      default:
        if (*operand == 0.0) {
          // A division by zero is told apart from a result that is too large.
          return diagnostics->Error(expr.children[i].span, "division by zero");
        }
        *value /= *operand;
    }
  }
  return value;
}

/// As EvaluateNumber, but the result may be infinite.
std::optional<double> Evaluate(const Expr& expr, source::Diagnostics* diagnostics) {
  switch (expr.kind) {
    case ExprKind::kNumber:
      return expr.number;
    case ExprKind::kPath:
      if (SingleName(expr) == "pi") return std::numbers::pi;
      if (expr.constant) return expr.number;
      break;
    case ExprKind::kCall:
      return Call(expr, diagnostics);
    case ExprKind::kSum:
    case ExprKind::kProduct:
      return Chain(expr, diagnostics);
    case ExprKind::kNegate: {
      const std::optional<double> x = EvaluateNumber(expr.children[0], diagnostics);
      return x ? std::optional(-*x) : std::nullopt;
    }
    default:
      break;
  }
  // Nothing else is a number: a name, a string, a list or a condition.
  if (expr.kind == ExprKind::kPath) {
    return diagnostics->Error(expr.span, "expected a number, and no constant '" +
                                             PathText(expr.path) + "' is known here");
  }
  return diagnostics->Error(expr.span, "expected a number");
}

}  // namespace

const Expr& Unwrapped(const Expr& expr) {
  // A loop, as parentheses may nest as deep as the parser allows.
  const Expr* inner = &expr;
  while (inner->kind == ExprKind::kTuple && inner->children.size() == 1) {
    inner = &inner->children[0];
  }
  return *inner;
}

std::string SingleName(const Expr& expr) {
  return expr.kind == ExprKind::kPath && expr.path.size() == 1 ? expr.path[0].text : "";
}

std::string PathText(const std::vector<Name>& path) {
  std::string text;
  for (const Name& name : path) text += (text.empty() ? "" : ".") + name.text;
  return text;
}

std::optional<double> EvaluateNumber(const Expr& expr, source::Diagnostics* diagnostics) {
  const Expr& inner = Unwrapped(expr);
  const std::optional<double> value = Evaluate(inner, diagnostics);
  // Both infinities and NaN end here, as sums and products of finite numbers may overflow.
  if (value && !std::isfinite(*value)) return diagnostics->Error(inner.span, "number is too large");
  return value;
}

bool HasAngle(const Expr& expr) {
  if (expr.kind == ExprKind::kCall) return false;  // A sine of an angle is none.
  return expr.angle || std::any_of(expr.children.begin(), expr.children.end(), HasAngle);
}

std::optional<Eigen::Vector3d> EvaluateVector(const Expr& expr, const std::string& what,
                                              source::Diagnostics* diagnostics) {
  // The parentheses are a part of the vector, so they are not unwrapped.
  if (expr.kind != ExprKind::kTuple || expr.children.size() != 3) {
    return diagnostics->Error(expr.span, "'" + what + "' needs three numbers")
        .Hint("write it as in: " + what + "=(0, 0, 1)");
  }
  Eigen::Vector3d vector;
  // All three numbers are read even if the first is wrong, so that all errors are found.
  bool ok = true;
  for (int i = 0; i < 3; ++i) {
    const std::optional<double> x = EvaluateNumber(expr.children[i], diagnostics);
    if (HasAngle(expr.children[i])) {
      diagnostics->Error(expr.children[i].span,
                         "'" + what + "' takes lengths, and this is an angle");
      ok = false;
    }
    ok = ok && x.has_value();
    vector[i] = x.value_or(0.0);
  }
  return ok ? std::optional(vector) : std::nullopt;
}

std::optional<model::AttributeValue> EvaluateAttribute(const Expr& expr,
                                                       source::Diagnostics* diagnostics) {
  const Expr& inner = Unwrapped(expr);
  // The kinds are told apart by their form: a string, the names true and false, a number.
  if (inner.kind == ExprKind::kString) return inner.text;
  const std::string name = SingleName(inner);
  if (name == "true" || name == "false") return name == "true";
  if (inner.kind == ExprKind::kPath && name != "pi" && !inner.constant) {
    // Any other name is most likely a string without its quotes.
    return diagnostics->Error(inner.span, "'" + PathText(inner.path) + "' is no value")
        .Hint("values are numbers, true, false, and strings such as \"" + PathText(inner.path) +
              "\"");
  }
  if (inner.kind == ExprKind::kTuple || inner.kind == ExprKind::kList) {
    // What has several values cannot be one attribute's.
    return diagnostics->Error(inner.span, "expected a number, a string, true or false");
  }
  const std::optional<double> number = EvaluateNumber(inner, diagnostics);
  // Anything else is arithmetic.
  if (!number) return std::nullopt;
  return *number;
}

std::optional<std::vector<model::AttributeValue>> EvaluateStates(const Expr& expr,
                                                                 source::Diagnostics* diagnostics) {
  std::vector<model::AttributeValue> values;
  if (expr.children.size() == 1 && SingleName(expr.children[0]) == "bool") {
    // `[bool]` stands for the two truth values.
    values.emplace_back(false);
    values.emplace_back(true);
    return values;
  }
  std::set<std::string> seen;
  // A list of strings; anything else among them makes it no list of states.
  for (const Expr& child : expr.children) {
    if (child.kind != ExprKind::kString) {
      values.clear();
      break;
    }
    if (!seen.insert(child.text).second) {
      return diagnostics->Error(child.span, "state \"" + child.text + "\" is listed twice");
    }
    values.emplace_back(child.text);
  }
  if (values.empty()) {
    return diagnostics->Error(expr.span, "a state variable lists its values")
        .Hint("write [bool], or strings as in [\"open\",\"closed\"]");
  }
  return values;
}

std::optional<Interval> EvaluateInterval(const Expr& expr, source::Diagnostics* diagnostics) {
  if (expr.kind != ExprKind::kList || expr.children.size() != 2) {
    diagnostics->Error(expr.span, "expected an interval").hint = "write it as in: [-pi/2, pi/2]";
    return std::nullopt;
  }
  // Both ends are read before either is judged, so that the errors of both are found.
  const std::optional<double> lower = EvaluateNumber(expr.children[0], diagnostics);
  const std::optional<double> upper = EvaluateNumber(expr.children[1], diagnostics);
  if (!lower || !upper) return std::nullopt;
  // An empty interval would leave a joint no position at all.
  if (*lower > *upper) {
    return diagnostics->Error(expr.span, "the interval's lower end " + NumberText(*lower) +
                                             " is above its upper end " + NumberText(*upper));
  }
  return Interval{*lower, *upper};
}

AttributeReader::AttributeReader(const Declaration& declaration, std::string what,
                                 const std::vector<std::string>& known,
                                 source::Diagnostics* diagnostics)
    : declaration_(declaration), what_(std::move(what)), known_(known), diagnostics_(*diagnostics) {
  // Keys are told apart first: given twice, or not known here.
  std::map<std::string, const Attribute*> seen;
  for (const Attribute& attribute : declaration.attributes) {
    const auto [it, fresh] = seen.emplace(attribute.key.text, &attribute);
    if (!fresh) {
      source::Diagnostic& d = diagnostics->Error(
          attribute.key.span, "'" + attribute.key.text + "' is given twice for " + what_);
      // A key is either new, known or not; for one that is repeated the first value counts.
      d.notes.push_back({it->second->key.span, "first given here"});
    } else if (!known.empty() &&
               std::find(known.begin(), known.end(), attribute.key.text) == known.end()) {
      had_unknown_ = true;
      source::Diagnostic& d = diagnostics->Error(
          attribute.key.span, what_ + " has no attribute '" + attribute.key.text + "'");
      d.hint = source::NearestHint(attribute.key.text, known,
                                   fmt::format("its attributes are {}", fmt::join(known, ", ")));
    }
  }
}

const Expr* AttributeReader::Optional(const std::string& key) {
  // A value that did not parse was reported then.
  const Attribute* attribute = declaration_.Find(key);
  if (attribute == nullptr || attribute->broken) return nullptr;
  if (attribute->value) return &*attribute->value;
  diagnostics_.Error(attribute->key.span, "'" + key + "' needs a value").hint =
      // A key that stands alone is a flag; here a value is wanted.
      "write it as in: " + key + "=...";
  return nullptr;
}

const Expr* AttributeReader::Required(const std::string& key, const std::string& hint) {
  // Absence is not reported where the key may be what did not parse, or what a slip was reported
  // for.
  if (declaration_.Find(key) != nullptr) return Optional(key);
  if (declaration_.broken) return nullptr;
  std::string near;
  // A key that is nearly the one that is missing was probably meant for it.
  for (const Attribute& attribute : declaration_.attributes) {
    if (source::NearestName(attribute.key.text, {key}).empty()) continue;
    const bool known = std::find(known_.begin(), known_.end(), attribute.key.text) != known_.end();
    if (!known && !known_.empty()) return nullptr;  // The constructor has reported the slip.
    if (!known) near = attribute.key.text;
  }
  diagnostics_.Error(declaration_.name.span, what_ + " has no '" + key + "'")
      .Hint(near.empty() ? hint : "did you mean '" + key + "' by '" + near + "'?");
  return nullptr;
}

bool AttributeReader::Flag(const std::string& key) {
  const Attribute* attribute = declaration_.Find(key);
  if (attribute == nullptr || attribute->broken) return false;
  // `connector` and `connector=true` are the same.
  if (!attribute->value || SingleName(*attribute->value) == "true") return true;
  // Anything but a truth value is no flag.
  if (SingleName(*attribute->value) != "false") {
    diagnostics_.Error(attribute->value->span, "'" + key + "' is a flag, it takes no value");
  }
  return false;
}

}  // namespace morphbus::m3l
