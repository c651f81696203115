#include "compiler/solver/explain_pair.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/model/convex_hull.h"
#include "compiler/solver/condition_terms.h"
#include "compiler/solver/hull_overlap.h"
#include "compiler/solver/motion_inference.h"

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;
using model::Connector;
using model::ModuleType;
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
        return {{condition.span, "this is never true"}};
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

  [[nodiscard]] std::vector<Failure> FindInComparison(const Condition& condition,
                                                      bool negated) const {
    Condition wanted;
    wanted.kind = negated ? Condition::Kind::kNot : Condition::Kind::kAnd;
    wanted.children = {condition};
    if (!SpecialiseCondition(wanted, a_, b_).terms.empty()) return {};
    std::string text;
    for (const Operand* operand : {&condition.lhs, &condition.rhs}) {
      const auto* ref = std::get_if<AttributeRef>(operand);
      if (ref == nullptr) continue;
      const Connector& connector = ref->side == Side::kA ? a_ : b_;
      text += (text.empty() ? "" : ", ") + DescribeAttribute(connector, ref->name);
    }
    return {{condition.span, text.empty() ? "these differ" : text}};
  }

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

  [[nodiscard]] std::vector<Failure> FindInGeometry(const Condition& condition, bool negated,
                                                    const Pose* X_AB) const {
    const bool directions = condition.kind != Condition::Kind::kCoincident;
    for (const PointRef* ref : {&condition.p, &condition.q}) {
      if (!FindPoints(*ref, directions, On(*ref)).empty()) continue;
      // What is missing makes the condition false, and so its negation true.
      if (negated) return {};
      return {{condition.span, fmt::format("{} has no such {}", On(*ref).name,
                                           directions ? "normal" : "sub-point")}};
    }
    if (X_AB == nullptr) return {};
    const double gap = GapOf(condition, *X_AB);
    const double allowed = directions ? kDirectionTolerance : tolerance_;
    if ((gap <= allowed) != negated) return {};
    if (negated) return {{condition.span, "this holds, but must not"}};
    if (directions) {
      const double degrees = 2.0 * std::asin(std::min(1.0, gap / 2.0)) * 180.0 / M_PI;
      return {{condition.span, fmt::format("{} is {:.6g} degrees off {}", NameOf(condition.p),
                                           degrees, NameOf(condition.q))}};
    }
    // The side that leaves a choice reads better as the second one.
    const bool swap = condition.p.kind == PointRef::Kind::kAnySubpoint;
    return {{condition.span,
             fmt::format("{} is {:.6g} m from {}", NameOf(swap ? condition.q : condition.p), gap,
                         NameOf(swap ? condition.p : condition.q))}};
  }

  /// Distance (m), or length of the difference of unit directions, of the nearest choices.
  [[nodiscard]] double GapOf(const Condition& condition, const Pose& X_AB) const {
    const bool directions = condition.kind != Condition::Kind::kCoincident;
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
        gap = std::min(gap, (opposite ? Vector3d(p + q) : Vector3d(p - q)).norm());
      }
    }
    return gap;
  }

  const Connector& a_;
  const Connector& b_;
  double tolerance_;
};

std::vector<Overlap> OverlapsOf(const ModuleType& type_a, const ModuleType& type_b,
                                const Pose& X_AB, double tolerance) {
  std::vector<Overlap> overlaps;
  for (size_t i = 0; i < type_a.links.size(); ++i) {
    for (size_t j = 0; j < type_b.links.size(); ++j) {
      if (type_a.links[i].hull.empty() || type_b.links[j].hull.empty()) continue;
      const double depth =
          PenetrationDepth(type_a.links[i].hull, Pose::Identity(), type_b.links[j].hull, X_AB);
      if (depth > tolerance) overlaps.push_back({static_cast<int>(i), static_cast<int>(j), depth});
    }
  }
  // The deepest says most.
  std::stable_sort(overlaps.begin(), overlaps.end(),
                   [](const Overlap& l, const Overlap& r) { return l.depth_m > r.depth_m; });
  return overlaps;
}

}  // namespace

PairExplanation ExplainPair(const ConnectionProblem& problem, const std::vector<ModuleType>& types,
                            int connector_a, int connector_b) {
  const ModuleType& type_a = types[static_cast<size_t>(problem.type_a)];
  const ModuleType& type_b = types[static_cast<size_t>(problem.type_b)];
  const Connector& a = type_a.connectors[static_cast<size_t>(connector_a)];
  const Connector& b = type_b.connectors[static_cast<size_t>(connector_b)];
  const double tolerance = MatingTolerance(type_a, type_b);
  const FailureFinder finder(a, b, tolerance);
  PairExplanation result;
  const Terms terms = SpecialiseCondition(problem.condition, a, b);
  if (terms.terms.empty()) {
    result.failures = finder.Find(problem.condition, false, nullptr);
    if (result.failures.empty()) {
      result.failures.push_back(
          {problem.condition.span, "no setting of the state variables satisfies all of this"});
    }
    return result;
  }
  InferenceTrace trace;
  double budget = kMaxInferenceWork;
  for (const Term& term : terms.terms) {
    InferMotions(term, a, b, tolerance, &budget, &trace);
  }
  result.complete = !trace.overflowed && budget > 0.0;
  for (const Pose& X_AB : trace.tried) {
    ExplainedCandidate candidate;
    candidate.X_AB = X_AB;
    candidate.failures = finder.Find(problem.condition, false, &X_AB);
    if (candidate.failures.empty()) {
      candidate.overlaps = OverlapsOf(type_a, type_b, X_AB, tolerance);
    }
    result.candidates.push_back(std::move(candidate));
  }
  const auto rank = [](const ExplainedCandidate& c) {
    return c.kept() ? 0 : c.failures.empty() ? 1 : 2;
  };
  std::stable_sort(result.candidates.begin(), result.candidates.end(),
                   [&](const auto& l, const auto& r) { return rank(l) < rank(r); });
  if (result.candidates.empty() && trace.dead_end != nullptr) {
    result.dead_end = Failure{trace.dead_end->span, trace.dead_end_text};
  }
  return result;
}

}  // namespace morphbus::solver
