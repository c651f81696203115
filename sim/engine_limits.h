#pragma once
// What the engine cannot compute with, found out before a run begins.

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "sim/rigid_body_model.h"

namespace morphbus::sim {

/// A link that is nowhere wider than this is all margin to the engine, which takes kHullShrink off
/// every side and adds kCollisionMargin (m).
inline constexpr double kLeastLinkExtent = 1e-3;
/// A part of a link's shape thinner than this is no solid any more once its corners are halfway to
/// its middle and rounded to 1 nm: 1000 of them are left here, and shapes keep their form (m).
inline constexpr double kLeastPartThickness = 1e-6;
/// Bullet takes bodies whose bounding box has a diagonal of 1000 km out of the simulation, with
/// nothing but a line on stdout (btCollisionWorld::updateSingleAabb). One that reaches less far
/// than this from its centre of mass keeps below that however it turns (m).
inline constexpr double kMostBodyReach = 250e3;

/// Whether every link of the robot has a shape that the engine can compute with. Fails in a
/// sentence with the link's name, what it measures and what it would have to.
Result<void> CheckShapes(const model::Model& model, const model::Robot& robot);

/// Whether no rigid body reaches too far, likewise.
Result<void> CheckReach(const model::Model& model, const model::Robot& robot,
                        const RigidBodyModel& rigid_bodies);

}  // namespace morphbus::sim
