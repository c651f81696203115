#pragma once
// A world for Webots R2023b, and the controller that its modules run.

#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/webots_docks.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// The world (.wbt): a floor and one Robot node a module, named like it, standing as the robot does
/// at its start values. Modules hang together by Connector nodes that are locked from the start, so
/// loops are kept and modules can be parted at run time. World axes are the robot frame's
/// (coordinate system NUE). Base nodes only, so nothing has to be downloaded.
///
/// Companions, under `controllers`/morphbus_TYPE_HASH/ for each module type: a wrapper of Webots' C
/// interface that gives and takes what a module's virtual machine takes and gives
/// (vm/module_api.h), a main program that holds the start values, a Makefile. Warns of docked
/// connectors that Webots will not see as aligned, of limits that it cannot hold, and of docking
/// that it allows in more ways than the model.
Exported ToWebots(const model::Model& model, const model::Robot& robot,
                  const std::string& controllers);

/// The controller of one module type.
struct WebotsProgram {
  /// "morphbus_TYPE_1a2b3c4d", of its folder and main file: with a hash of what the files say, so
  /// that worlds of other connections or joints find their own beside it.
  std::string name;
  std::vector<CompanionFile> files;  ///< Paths relative to its folder.
};
WebotsProgram WebotsController(const model::Model& model, const DockFaces& faces, int type);

}  // namespace morphbus::emit
