#pragma once
// Postures to try when links are looked for that meet: the ends of the joints' ranges, then random
// ones.

#include <cstdint>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::solver {

/// The number of the posture of the start values, which are the caller's. The first posture of
/// PostureValues is the one behind it.
inline constexpr int kStartPosture = 0;

/// The values of some joints (rad or m) in a posture, 1 or more. First come all joints at their
/// lower limits, all at their upper ones, and, of at most six joints, the other corners of the
/// ranges; then random postures. In every other of these each joint is at one of its limits with a
/// probability of a half, since links often meet only where some joints are and others are not.
/// Joints without limits have the range of one turn, -pi to pi. The values depend on nothing but
/// `joints`, which must not be fixed ones, `seed` and `posture`.
std::vector<double> PostureValues(const std::vector<const model::Joint*>& joints, uint64_t seed,
                                  int posture);

}  // namespace morphbus::solver
