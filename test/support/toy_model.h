#pragma once
// Small models made by hand, for tests that need no compiler: a module with two links and a hinge,
// one with four links and every other kind of joint, and random robots of them.

#include <cstdint>

#include "compiler/model/robot_model.h"

namespace morphbus::test {

/// Module types 0 "Hinge" (links one, two; joint turn; connectors c0..c5, three on each link) and
/// 1 "Rail" (links base, cover, slider, rotor; joints fixed, slide, spin; connectors d0..d3, one on
/// each). Connection 0 mates any two Hinge connectors in two ways (mirrored options exist);
/// connection 1 mates a Hinge (a) with a Rail (b).
model::Model ToyModel();

/// A random robot of `modules` modules: a tree, then up to `loops` more dockings. Loops do not
/// close geometrically; what hangs together does not depend on that.
model::Robot RandomRobot(const model::Model& model, int modules, int loops, uint64_t seed);

/// A straight row of `modules` Hinges, c5 to c0.
model::Robot ChainRobot(const model::Model& model, int modules);

/// Longest shortest path between two modules, in dockings.
int DiameterOf(const model::Robot& robot);

/// The same within bodies: longest shortest path, in dockings, between two parts of one body. It
/// can be longer than the robot's, whose shortest paths lead across joints.
int BodyDiameterOf(const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::test
