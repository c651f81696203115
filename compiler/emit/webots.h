#pragma once
// A world for Webots R2023b, and the controller that its modules run.

#include <string>

#include "compiler/emit/exported.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// The world (.wbt): a floor and one Robot node a module, named like it, standing as the robot does
/// at its start values. Modules hang together by Connector nodes that are locked from the start, so
/// loops are kept and modules can be parted at run time. World axes are the robot frame's
/// (coordinate system NUE). Base nodes only, so nothing has to be downloaded.
///
/// Companions, under `controllers`/morphbus_TYPE/ for each module type: a wrapper of Webots' C
/// interface by names of the model's joints and connectors, a main program that holds the start
/// values, a Makefile. Warns of docked connectors that Webots will not see as aligned.
Exported ToWebots(const model::Model& model, const model::Robot& robot,
                  const std::string& controllers);

/// The files of a module type's controller; paths relative to its folder.
std::vector<CompanionFile> WebotsController(const model::ModuleType& type);
/// "morphbus_TYPE"
std::string WebotsControllerName(const model::ModuleType& type);

}  // namespace morphbus::emit
