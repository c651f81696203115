#pragma once
// A robot as shapes: the hull of each link as triangles in the colour of its module; and what
// stands beside it.

#include <string>

#include "bridge/outward/foxglove.pb.h"
#include "bridge/outward/run_model.h"

namespace morphbus::bridge {

/// Name of a link's frame: "walk/m1/active_block". `prefix` is the source's name with what stands
/// before the module: "walk" or "walk/propagated".
std::string LinkFrame(const std::string& prefix, const RunModel& run, int module, int link);

/// The colour of a module, by its index in the robot: that of the palette.
foxglove::Color ModuleColor(int module);

/// All links that have a hull, as entities that are called like their frames and move with them,
/// and the obstacles of the run's world, "walk/obstacles/wall.link.box", which stay in its world
/// frame.
foxglove::SceneUpdate SceneOf(const std::string& source, const RunModel& run);

}  // namespace morphbus::bridge
