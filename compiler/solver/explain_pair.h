#pragma once
// Why a pair of connectors mates as it does: every rigid motion that the solver looks at, and the
// condition, or the overlap of hulls, that removes it. For `connections --why`.

#include <optional>
#include <string>
#include <vector>

#include "compiler/solver/failures.h"

namespace morphbus::solver {

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
  /// The motion that is left free in spite of all conditions: "turning about (0, 0, 1)".
  std::optional<std::string> free_motion;
  bool complete = true;  ///< False if there were more motions than are shown.
};

/// Explains connector `connector_a` of member a with `connector_b` of member b, also for a problem
/// whose solving ended with an error.
PairExplanation ExplainPair(const ConnectionProblem& problem,
                            const std::vector<model::ModuleType>& types, int connector_a,
                            int connector_b);

}  // namespace morphbus::solver
