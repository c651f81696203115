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

/// Infers the motions of connector `b` to connector `a` (module frames) that satisfy `term`.
/// `tolerance` (m) is how far coincident points may lie apart; directions may differ by 1e-6 rad.
/// `budget` is the number of point pairs that may still be compared, and is used up; connectors
/// with twelve sub-points take some 20000.
InferredMotions InferMotions(const Term& term, const model::Connector& a, const model::Connector& b,
                             double tolerance, double* budget);

/// True if two motions agree to twice `tolerance` (m) and 1e-6 rad: then they count as one.
bool SameMotion(const model::Pose& X, const model::Pose& Y, double tolerance);

}  // namespace morphbus::solver
