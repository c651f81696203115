#pragma once
// How deep two convex hulls lie in each other.
//
// The method is the separating-axis test over face normals and edge-edge cross products, made exact
// and quick by the Gauss map: only edge pairs that build a face of the Minkowski difference are
// measured. It was preferred to an iterative GJK/EPA because a lattice robot's mated faces touch
// exactly: the answer there must be 0 and not an iteration's tolerance, and flat hulls need no
// margin.

#include <Eigen/Core>
#include <vector>

#include "compiler/model/convex_hull.h"
#include "compiler/model/robot_model.h"

namespace morphbus::solver {

/// The length of the least translation that separates A and B (m): 0 when they are apart or touch.
/// Flat hulls, segments and points have no inside of their own but can lie in a solid; two sets
/// whose Minkowski difference is flat (say, coplanar plates) are never in each other.
double PenetrationDepth(const model::ConvexHull& A, const model::Pose& X_WA,
                        const model::ConvexHull& B, const model::Pose& X_WB);

/// The same for hulls whose points are in one frame (m).
double PenetrationDepth(const model::ConvexHull& A, const model::ConvexHull& B_in_A);

/// `hull` in another frame: X is the pose of its frame there. Faces lose their corners, which the
/// depth does not need.
model::ConvexHull Moved(const model::ConvexHull& hull, const model::Pose& X);

/// True if PenetrationDepth exceeds `tolerance` (m); quicker, for it stops at a corner that lies
/// deeper than that. `work` grows by the number of corners, faces and pairs of edges looked at.
bool PenetratesBy(double tolerance, const model::ConvexHull& A, const model::Pose& X_WA,
                  const model::ConvexHull& B, const model::Pose& X_WB, double* work);

/// The same as the first for the hulls of two point sets, each in its own frame (m).
double PenetrationDepth(const std::vector<Eigen::Vector3d>& A, const model::Pose& X_WA,
                        const std::vector<Eigen::Vector3d>& B, const model::Pose& X_WB);

}  // namespace morphbus::solver
