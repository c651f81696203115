#pragma once
// The formats of morphbus export: what each is made of, and by which back end.

#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/model/robot_model.h"
#include "compiler/source/result.h"

namespace morphbus::tools {

/// What a format can be made of.
enum class Of { kFile, kModule, kRobot, kEither };

/// What is to be exported, and where to.
struct ExportRequest {
  const model::Model& model;
  const model::Robot* robot = nullptr;  ///< Null for Of::kFile and Of::kModule.
  int type = -1;     ///< Index of the module type; then `robot`, if any, is that module alone.
  std::string stem;  ///< What files beside the main one are called after.
  std::string mesh_prefix;  ///< See emit::MeshPlace.
  std::string controllers;  ///< Folder for Webots' controllers, relative to the main file's.
};

struct ExportFormat {
  const char* name;
  Of of;
  bool refers_to_meshes;
  Result<emit::Exported> (*make)(const ExportRequest&);
};

/// All of them, in the order in which messages list them.
const std::vector<ExportFormat>& ExportFormats();

}  // namespace morphbus::tools
