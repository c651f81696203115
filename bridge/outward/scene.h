#pragma once
// What never changes of a run, for viewers: what ran; and the robot as shapes, the hull of each
// link as triangles in the colour of its module, with what stands beside it.

#include <string>

#include "bridge/description/run_model.h"
#include "bridge/outward/foxglove.pb.h"
#include "bridge/outward/monitor.pb.h"
#include "compiler/base/role_colors.h"

namespace morphbus::bridge {

/// What ran (in all functions a run with its robot), but for the program's text; its roles have
/// these colours.
morphbus::Description DescriptionOf(const RunModel& run, const RoleColors& colors);

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
