#pragma once
// Small robots for the simulator's tests.

#include <memory>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::sim::test {

/// Corners of a box (m).
std::vector<Eigen::Vector3d> BoxCorners(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

/// Robot "box": one module of one link, a cube of 0.1 m and 1 kg round its origin.
std::shared_ptr<const model::Model> MakeBox();

/// Robot "pair": one module of two cubes of 0.1 m and 1 kg at x = ±0.1 m, link "a" turning (or
/// sliding along x) against link "b" with a joint of `type` at the module's origin, axis +z (+x for
/// prismatic), 5 N m (50 N), 2 rad/s (0.2 m/s), limits ±1 rad (±0.05 m), none if continuous.
std::shared_ptr<const model::Model> MakePair(model::JointType type, double start);

}  // namespace morphbus::sim::test
