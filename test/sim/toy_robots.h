#pragma once
// Small robots for the simulator's tests.

#include <memory>
#include <morphbus/actuator_t.hpp>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::sim::test {

/// The simulator's own (m/s²).
constexpr double kGravity = 9.81;

/// Corners of a box (m).
std::vector<Eigen::Vector3d> BoxCorners(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

/// Robot "box": one module of one link, a cube of 0.1 m and 1 kg round its origin.
std::shared_ptr<const model::Model> MakeBox();

/// Robot "pair": one module of two cubes of 0.1 m and 1 kg at x = ±0.1 m, link "a" turning (or
/// sliding along x) against link "b" with a joint of `type` at the module's origin, axis +z (+x for
/// prismatic), 5 N m (50 N), 2 rad/s (0.2 m/s), limits ±1 rad (±0.05 m), none if continuous.
std::shared_ptr<const model::Model> MakePair(model::JointType type, double start);

/// What a module of one joint is told to send that to a target (rad or m), at a speed (rad/s or
/// m/s).
morphbus::actuator_t PositionCommand(double target, double speed);

}  // namespace morphbus::sim::test
