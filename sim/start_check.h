#pragma once
// Whether a robot can start where it is: not inside an obstacle, from which the engine would throw
// it out.

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "sim/link_physics.h"
#include "sim/world.h"

namespace morphbus::sim {

/// Links may start in an obstacle by this much (m): to the engine thin links are larger than they
/// are by up to the shrinking and the margin that they have no room for.
inline constexpr double kMostStartOverlap = kHullShrink + kCollisionMargin;

/// Fails if a link of `robot` lies deeper in an obstacle of `world` than kMostStartOverlap, in a
/// sentence with links, obstacles, depths, and where each obstacle would have to go. The world
/// cannot be run afterwards (World::FindOverlaps).
Result<void> CheckStart(World* world, const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::sim
