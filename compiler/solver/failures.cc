#include "compiler/solver/failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "compiler/model/robot_model.h"
#include "compiler/solver/condition_terms.h"
#include "compiler/solver/motion_inference.h"

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;
using model::Connector;
using model::Pose;

/// Finds the conditions that one pair of connectors, in one pose or in none, breaks.
class FailureFinder {
 public:
  FailureFinder(const Connector& a, const Connector& b, double tolerance)
      : a_(a), b_(b), tolerance_(tolerance) {}

  /// What breaks `condition` (or its negation). Without a pose, geometry is taken to hold unless
  /// a point that it names is missing.
  [[nodiscard]] std::vector<Failure> Find(const Condition& condition, bool negated,
                                          const Pose* X_AB) const {
    switch (condition.kind) {
      case Condition::Kind::kNot:
        return Find(condition.children[0], !negated, X_AB);
      case Condition::Kind::kAnd:
      case Condition::Kind::kOr:
        return FindInList(condition, negated, X_AB);
      case Condition::Kind::kTrue:
        if (!negated) return {};
        return {{condition.span, "this is never true", &condition}};
      case Condition::Kind::kCompare:
        return FindInComparison(condition, negated);
      default:
        return FindInGeometry(condition, negated, X_AB);
    }
  }

 private:
  [[nodiscard]] const Connector& On(const PointRef& ref) const {
    return ref.side == Side::kA ? a_ : b_;
  }

  /// All must hold: every failure. One must hold: the first failure of each, if all fail.
  [[nodiscard]] std::vector<Failure> FindInList(const Condition& condition, bool negated,
                                                const Pose* X_AB) const {
    // De Morgan: a negated `or` is an `and` of negations, and the other way round.
    const bool all = (condition.kind == Condition::Kind::kAnd) != negated;
    std::vector<Failure> failures;
    for (const Condition& child : condition.children) {
      std::vector<Failure> part = Find(child, negated, X_AB);
      if (all) {
        failures.insert(failures.end(), part.begin(), part.end());
      } else if (part.empty()) {
        return {};
      } else {
        failures.push_back(std::move(part.front()));
      }
    }
    return failures;
  }

  /// A comparison fails if no setting of the two connectors' states makes it hold. What each side
  /// has is told.
  [[nodiscard]] std::vector<Failure> FindInComparison(const Condition& condition,
                                                      bool negated) const {
    // The comparison is specialised as a condition of its own, which knows about states.
    Condition wanted;
    wanted.kind = negated ? Condition::Kind::kNot : Condition::Kind::kAnd;
    wanted.children = {condition};
    if (!SpecialiseCondition(wanted, a_, b_).terms.empty()) return {};
    std::string text;
    for (const Operand* operand : {&condition.lhs, &condition.rhs}) {
      const auto* ref = std::get_if<AttributeRef>(operand);
      if (ref == nullptr) continue;
      text += (text.empty() ? "" : ", ") + DescribeAttribute(*ref);
    }
    return {{condition.span, text.empty() ? "these differ" : text, &condition}};
  }

  /// The connector's name; with its member where the other is called the same.
  [[nodiscard]] std::string NameOn(Side side) const {
    const std::string& name = side == Side::kA ? a_.name : b_.name;
    if (a_.name != b_.name) return name;
    return (side == Side::kA ? "a's " : "b's ") + name;
  }

  /// What a connector has as attribute or state: `c1.gender is "male"`.
  [[nodiscard]] std::string DescribeAttribute(const AttributeRef& ref) const {
    const Connector& connector = ref.side == Side::kA ? a_ : b_;
    if (!ref.connector.empty() && ref.connector != connector.name) {
      return fmt::format("{} is not {}", NameOn(ref.side), ref.connector);
    }
    const auto fixed = connector.attributes.find(ref.name);
    if (fixed != connector.attributes.end()) {
      return fmt::format("{}.{} is {}", NameOn(ref.side), ref.name,
                         model::ValueText(fixed->second));
    }
    for (const model::StateVariable& state : connector.states) {
      if (state.name == ref.name) return fmt::format("{}.{} is free", NameOn(ref.side), ref.name);
    }
    return fmt::format("{} has no {}", NameOn(ref.side), ref.name);
  }

  /// The point or direction for a message, with its member: `a.c1._2`.
  [[nodiscard]] std::string NameOf(const PointRef& ref) const {
    const std::string member = ref.side == Side::kA ? "a" : "b";
    switch (ref.kind) {
      case PointRef::Kind::kSubpoint:
        return fmt::format("{}.{}.{}", member, On(ref).name, ref.subpoint);
      case PointRef::Kind::kAnySubpoint:
        return fmt::format("the nearest sub-point of {}.{}", member, On(ref).name);
      case PointRef::Kind::kAxis:
        return fmt::format("axis {}.{}", member, ref.subpoint);
      default:
        return fmt::format("{}.{}", member, On(ref).name);
    }
  }

  /// A geometric condition fails if a point of it is missing or, with a pose, if the gap is too
  /// wide. The text tells the gap.
  [[nodiscard]] std::vector<Failure> FindInGeometry(const Condition& condition, bool negated,
                                                    const Pose* X_AB) const {
    const bool directions = condition.kind != Condition::Kind::kCoincident;
    for (const PointRef* ref : {&condition.p, &condition.q}) {
      if (!FindPoints(*ref, directions, On(*ref)).empty()) continue;
      // What is missing makes the condition false, and so its negation true.
      if (negated) return {};
      if (!ref->connector.empty() && ref->connector != On(*ref).name) {
        return {{condition.span, fmt::format("{} is not {}", NameOn(ref->side), ref->connector),
                 &condition}};
      }
      return {
          {condition.span,
           fmt::format("{} has no such {}", NameOn(ref->side), directions ? "normal" : "sub-point"),
           &condition}};
    }
    // Without a pose there is nothing to measure.
    if (X_AB == nullptr) return {};
    const double gap = GapOf(condition, *X_AB);
    const double allowed = directions ? kDirectionTolerance : tolerance_;
    if ((gap <= allowed) != negated) return {};
    if (negated) return {{condition.span, "this holds, but must not", &condition}};
    if (directions) {
      // The gap is the chord between two unit vectors.
      const double degrees = 2.0 * std::asin(std::min(1.0, gap / 2.0)) * 180.0 / std::numbers::pi;
      return {{condition.span,
               fmt::format("{} is {:.6g} degrees off {}", NameOf(condition.p), degrees,
                           NameOf(condition.q)),
               &condition}};
    }
    // The side that leaves a choice reads better as the second one.
    const bool swap = condition.p.kind == PointRef::Kind::kAnySubpoint;
    return {{condition.span,
             fmt::format("{} is {:.6g} m from {}", NameOf(swap ? condition.q : condition.p), gap,
                         NameOf(swap ? condition.p : condition.q)),
             &condition}};
  }

  /// Distance (m), or length of the difference of unit directions, of the nearest choices.
  [[nodiscard]] double GapOf(const Condition& condition, const Pose& X_AB) const {
    const bool directions = condition.kind != Condition::Kind::kCoincident;
    // All points are brought into a's module frame; of several choices the nearest two count.
    const auto in_a = [&](const PointRef& ref) {
      std::vector<Vector3d> points = FindPoints(ref, directions, On(ref));
      for (Vector3d& p : points) {
        if (ref.side == Side::kB) p = directions ? Vector3d(X_AB.linear() * p) : Vector3d(X_AB * p);
      }
      return points;
    };
    double gap = std::numeric_limits<double>::infinity();
    const std::vector<Vector3d> others = in_a(condition.q);
    for (const Vector3d& p : in_a(condition.p)) {
      for (const Vector3d& q : others) {
        const bool opposite = condition.kind == Condition::Kind::kAntiparallel;
        // Opposite directions have the sum 0, equal ones the difference 0.
        gap = std::min(gap, (opposite ? Vector3d(p + q) : Vector3d(p - q)).norm());
      }
    }
    return gap;
  }

  const Connector& a_;
  const Connector& b_;
  double tolerance_;
};

}  // namespace

std::vector<Failure> FindFailures(const Condition& condition, const Connector& a,
                                  const Connector& b, double tolerance, const Pose* X_AB) {
  return FailureFinder(a, b, tolerance).Find(condition, false, X_AB);
}

std::string ExplainBrokenAttributes(const Condition& broken, const Connector& a,
                                    const Connector& b) {
  // The words that the broken comparisons found: two of one kind, one on each side, say it best.
  std::set<std::pair<std::string, std::string>> words[2];  // of a and b: attribute, word
  std::vector<std::string> told;
  for (const Failure& failure : FindFailures(broken, a, b, 0.0, nullptr)) {
    if (std::find(told.begin(), told.end(), failure.measured) == told.end()) {
      told.push_back(failure.measured);
    }
    if (failure.condition == nullptr) continue;
    for (const Operand* operand : {&failure.condition->lhs, &failure.condition->rhs}) {
      const auto* ref = std::get_if<AttributeRef>(operand);
      // Numbers and flags read well as they are; what follows looks for words such as "male".
      if (ref == nullptr) continue;
      const Connector& connector = ref->side == Side::kA ? a : b;
      const auto found = connector.attributes.find(ref->name);
      if (found == connector.attributes.end()) continue;
      const auto* word = std::get_if<std::string>(&found->second);
      if (word != nullptr) words[ref->side == Side::kA ? 0 : 1].emplace(ref->name, *word);
    }
  }
  // The same word on both sides is why connectors of one gender refuse each other.
  for (const auto& word : words[0]) {
    if (words[1].count(word) == 0) continue;
    return fmt::format("{} and {} are both {}", a.name, b.name, word.second);
  }
  if (told.empty()) return "no setting of the state variables satisfies the condition";
  return fmt::format("{}", fmt::join(told, ", "));
}

}  // namespace morphbus::solver
