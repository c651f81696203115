#pragma once
// A world for Webots R2023b, and the controller that its modules run.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/emit/exported.h"
#include "compiler/emit/webots_docks.h"
#include "compiler/model/robot_model.h"
#include "compiler/world/obstacle.h"

namespace morphbus::emit {

/// What a world is made of beside the robot.
struct WebotsOptions {
  std::string controllers;   ///< Folder of the controllers, relative to the world's.
  std::string program = {};  ///< Image of what the modules run; empty: they hold their joints.
  uint64_t model_hash = 0;   ///< The model's hash, which images carry.
  std::vector<world::Obstacle> obstacles = {};
};

/// The world (.wbt): a floor and one Robot node a module, named like it, standing as the robot does
/// at its start values. Modules hang together by Connector nodes that are locked from the start, so
/// obstacles stand still beside them, loops are kept, and modules can be parted at run time. World
/// axes are the robot frame's (coordinate system NUE). Base nodes only, so nothing has to be
/// downloaded. Sensors have their devices, noise included (webots_sensors.h).
///
/// Companions, under options.controllers/morphbus_TYPE_HASH/ for each module type: a wrapper of
/// Webots' C interface that gives and takes what a module's virtual machine takes and gives
/// (vm/module_api.h), a main program, a Makefile. Without a program the main program holds the
/// start values; with one it runs a virtual machine, whose sources are written too. Warns of docked
/// connectors that Webots will not see as aligned, of limits that it cannot hold, of contact
/// sensors without a face, and of docking that it allows in more ways than the model. Fails for a
/// module type that exceeds the capacities of vm/limits.h, if there is a program.
Result<Exported> ToWebots(const model::Model& model, const model::Robot& robot,
                          const WebotsOptions& options);

/// The controller of one module type.
struct WebotsProgram {
  /// "morphbus_TYPE_1a2b3c4d", of its folder and main file: with a hash of what the files say, so
  /// that worlds of other connections, joints or programs find their own beside it.
  std::string name;
  std::vector<CompanionFile> files;  ///< Paths relative to its folder.
};
/// `program` and `model_hash` are those of WebotsOptions. Fails as ToWebots does.
Result<WebotsProgram> WebotsController(const model::Model& model, const DockFaces& faces, int type,
                                       const std::string& program = {}, uint64_t model_hash = 0);

}  // namespace morphbus::emit
