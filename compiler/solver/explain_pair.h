#pragma once
// Why a pair of connectors mates as it does: every rigid motion that the solver looks at, and the
// condition, or the overlap of hulls, that removes it. For `connections --why`.

#include <optional>
#include <string>
#include <vector>

#include "compiler/solver/connection_problem.h"

namespace morphbus::solver {

/// A condition that does not hold, and what was measured: "c1._2 is 0.01 m from every sub-point".
struct Failure {
  source::Span span;
  std::string measured;
};

/// Two link hulls that lie in each other.
struct Overlap {
  int link_a = 0;
  int link_b = 0;
  double depth_m = 0.0;  ///< The least translation that separates them.
};

/// A rigid motion that fits enough points to be fixed.
struct ExplainedCandidate {
  model::Pose X_AB = model::Pose::Identity();  ///< b's module frame in a's, joints at 0 (m).
  std::vector<Failure> failures;               ///< Conditions that it breaks.
  std::vector<Overlap> overlaps;               ///< Hulls in each other; looked at if none fails.

  [[nodiscard]] bool kept() const { return failures.empty() && overlaps.empty(); }
};

struct PairExplanation {
  /// What the fixed attributes of the two connectors break, before any motion is looked at.
  std::vector<Failure> failures;
  /// Those kept first, then those with overlaps, then those that break conditions.
  std::vector<ExplainedCandidate> candidates;
  /// Where no motion could be fixed: the condition that found no partner, with distances.
  std::optional<Failure> dead_end;
  bool complete = true;  ///< False if there were more motions than are shown.
};

/// Explains connector `connector_a` of member a with `connector_b` of member b. The problem has
/// been solved without error before, so that nothing is left free.
PairExplanation ExplainPair(const ConnectionProblem& problem,
                            const std::vector<model::ModuleType>& types, int connector_a,
                            int connector_b);

}  // namespace morphbus::solver
