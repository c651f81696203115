#pragma once
// The condition of a connection, specialised to one pair of connectors: what is known of fixed
// attributes is worked out, what is left is a few alternative terms of geometry and states.

#include <string>
#include <vector>

#include "compiler/solver/connection_problem.h"

namespace morphbus::solver {

/// Most alternatives that `or` and `not` over geometry may lead to (docs/m3l.md, connections).
inline constexpr int kMaxTerms = 64;
/// Most settings of state variables that are looked at: far above any hardware's states, low enough
/// that nothing grows without bound.
inline constexpr size_t kMaxStateSets = 256;

/// A geometric condition (coincident, parallel or antiparallel) or its negation. The condition
/// belongs to the ConnectionProblem, which must outlive the literal.
struct Literal {
  const Condition* condition = nullptr;
  bool negated = false;
};

/// One way to satisfy the condition: all literals, with the connectors in any of these settings.
struct Term {
  /// The conditions on points and directions, in source order.
  std::vector<Literal> geometry;
  /// The settings of state variables in which it is satisfied, at least one: an empty one if any
  /// will do. None of them contains another.
  std::vector<model::StateSetting> settings;
};

/// The condition of one pair of connectors as alternatives: it holds where any of the terms does.
/// SpecialiseCondition makes it, and it refers to the condition.
struct Terms {
  /// The alternatives. If there are none, the pair's fixed attributes break the condition.
  std::vector<Term> terms;
  /// True if there were over kMaxTerms of them; `terms` is empty then.
  bool too_many_terms = false;
  /// True if there were over kMaxStateSets settings of states; `terms` is empty then.
  bool too_many_states = false;
  [[nodiscard]] bool too_many() const { return too_many_terms || too_many_states; }
  /// Where there are none: the first part of the condition that cannot hold, and its place in the
  /// order of the source.
  const Condition* broken = nullptr;
  int broken_index = 0;
};

/// Specialises `condition` to connectors `a` and `b`. A sub-point, normal or attribute that a
/// connector lacks makes the condition on it false. Linear in the condition but for the terms.
Terms SpecialiseCondition(const Condition& condition, const model::Connector& a,
                          const model::Connector& b);

/// The points (m, module frame) or, if `direction`, unit directions that `ref` may stand for on
/// `connector`; none if it lacks them.
std::vector<Eigen::Vector3d> FindPoints(const PointRef& ref, bool direction,
                                        const model::Connector& connector);

/// Removes from `settings` those that ask for all that another one asks for and more, or for the
/// same. Those that ask for the least come first, in source order among equals.
void KeepLeastDemanding(std::vector<model::StateSetting>& settings);

/// What there are too many of: "more than 64 alternatives of coincident points".
std::string TooManyText(const Terms& terms);

}  // namespace morphbus::solver
