#pragma once
// Why a pair of connectors mates as it does: every rigid motion that the solver looks at, and the
// condition, or the overlap of hulls, that removes it. For `connections --why`.

#include <optional>
#include <string>
#include <vector>

#include "compiler/solver/failures.h"

namespace morphbus::solver {

/// Two link hulls that lie in each other, one of each member's module.
struct Overlap {
  /// Indices of the links in the module types of members a and b.
  int link_a = 0;
  int link_b = 0;
  /// The length of the least translation that separates them (m).
  double depth_m = 0.0;
};

/// A rigid motion that fits enough points to be fixed, and all that speaks against it.
struct ExplainedCandidate {
  /// The pose of b's module frame in a's, with joints at 0 (m).
  model::Pose X_AB = model::Pose::Identity();
  /// The conditions that it breaks.
  std::vector<Failure> failures;
  /// The hulls that lie in each other; they are looked at only if no condition fails.
  std::vector<Overlap> overlaps;

  /// True if the motion is one of the connection's options.
  [[nodiscard]] bool kept() const { return failures.empty() && overlaps.empty(); }
};

/// All that is known about one pair of connectors. ExplainPair makes it for printing.
struct PairExplanation {
  /// What the fixed attributes of the two connectors break, before any motion is looked at.
  std::vector<Failure> failures;
  /// Those kept first, then those with overlaps, then those that break conditions.
  std::vector<ExplainedCandidate> candidates;
  /// Where no motion could be fixed: the condition that found no partner, with distances.
  std::optional<Failure> dead_end;
  /// The motion that is left free in spite of all conditions: "turning about (0, 0, 1)".
  std::optional<std::string> free_motion;
  /// False if there were more motions than are shown.
  bool complete = true;
};

/// Explains connector `connector_a` of member a with `connector_b` of member b, also for a problem
/// whose solving ended with an error.
/// The connectors are indices into those of the members' module types.
PairExplanation ExplainPair(const ConnectionProblem& problem,
                            const std::vector<model::ModuleType>& types, int connector_a,
                            int connector_b);

}  // namespace morphbus::solver
