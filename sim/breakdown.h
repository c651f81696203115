#pragma once
// Whether the simulation can still be believed: an engine that is asked for too much does not say
// so, but lets joints go where they cannot.

#include <string>

#include "compiler/model/robot_model.h"
#include "sim/world.h"

namespace morphbus::sim {

/// Beyond its limits by more than this no joint can stand: its mechanical stops lie 2 degrees
/// (1 mm) behind them, and give way a little, by less than 0.6 degrees in 55 of 56 runs of shipped
/// robots that were tried (rad, m).
inline constexpr double kMostOverrun = 5.0 * EIGEN_PI / 180.0;
inline constexpr double kMostOverrunLinear = 5e-3;

/// Why what `world` shows of `robot` is not to be believed, with what to change, in one sentence of
/// less than 200 characters where names are not long; empty while all is well. Told are bodies that
/// are nowhere (World::lost), and the joint that is furthest beyond its limits, if by more than the
/// above.
std::string WhyBroken(const World& world, const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::sim
