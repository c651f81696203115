#pragma once
// Rigid motions that satisfy one term of a connection's condition, by inference: correspondences
// are taken up one by one until three points (or a point and two directions) fix the motion, the
// rest is checked. Permutations of sub-points are never enumerated.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "compiler/solver/condition_terms.h"

namespace morphbus::solver {

/// What InferMotions finds for one term and one pair of connectors.
struct InferredMotions {
  /// X_AB (m), distinct, in the order found. Every positive literal holds to the tolerance, no
  /// negated one does.
  std::vector<model::Pose> motions;
  /// The motion left free, if correspondences that fit do not fix it: "turning about (0, 0, 1)".
  std::optional<std::string> free_motion;
  /// With no motion: the condition that the last hypothesis broke, and its place in the term.
  const Condition* broken = nullptr;
  int broken_index = -1;
  /// True if the search gave up because the budget was spent.
  bool gave_up = false;
};

/// How far directions that agree may differ (rad).
inline constexpr double kDirectionTolerance = 1e-6;
/// Point pairs that may be compared for one connection: a second or two, far above real modules.
inline constexpr double kMaxInferenceWork = 5e7;

/// What an inference looked at, for explanations.
struct InferenceTrace {
  static constexpr size_t kMaxTried = 500;
  std::vector<model::Pose> tried;  ///< X_AB (m): fixed by some correspondences, then checked.
  bool overflowed = false;         ///< There were more.
  /// The condition furthest along for which no partner fits what is matched already.
  const Condition* dead_end = nullptr;
  std::string dead_end_text;
  int dead_end_depth = -1;
};

/// How far apart coincident points of two modules may lie, and how deep hulls in each other (m):
/// 1e-6 of the larger extent.
double MatingTolerance(const model::ModuleType& a, const model::ModuleType& b);

/// Infers the motions of connector `b` to connector `a` (module frames) that satisfy `term`.
/// `tolerance` (m) is how far coincident points may lie apart; directions may differ by 1e-6 rad.
/// `budget` is the number of point pairs that may still be compared, and is used up; connectors
/// with twelve sub-points take some 20000.
InferredMotions InferMotions(const Term& term, const model::Connector& a, const model::Connector& b,
                             double tolerance, double* budget, InferenceTrace* trace = nullptr);

/// True if two motions agree to twice `tolerance` (m) and 1e-6 rad: then they count as one.
bool SameMotion(const model::Pose& X, const model::Pose& Y, double tolerance);

}  // namespace morphbus::solver
