#pragma once
// The formats of morphbus export: what each is made of, and by which back end.

#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/emit/exported.h"
#include "compiler/model/robot_model.h"
#include "compiler/world/obstacle.h"
#include "tools/base/output_path.h"

namespace morphbus::tools {

/// What a format can be made of: the whole file, one module type, one robot, or a robot as well as
/// a module type (which then stands alone as a robot of one module).
enum class Of { kFile, kModule, kRobot, kEither };

/// What is to be exported, and where to. The command makes one for each export; the model and the
/// robot belong to it and live as long as the call of ExportFormat::make.
struct ExportRequest {
  const model::Model& model;
  /// The robot to export. It is null for a format of the whole file; for a module type it is a
  /// robot that consists of that module.
  const model::Robot* robot = nullptr;
  /// Index of the module type, if one is exported; -1 for robots and whole files.
  int type = -1;
  /// The files beside the main one are called after this: the main file's name without its
  /// extension or, where the output is a stream, the robot's name.
  std::string stem;
  std::string mesh_prefix;  ///< See emit::MeshPlace.
  std::string controllers;  ///< Folder for Webots' controllers, relative to the main file's.
  std::string program;      ///< Image of the program that the modules run; empty for none.
  std::vector<world::Obstacle> obstacles;  ///< Of the world around the robot.
};

/// One value of --to: the row of a table that is built once and never changes.
struct ExportFormat {
  const char* name;  ///< As in --to.
  Of of;
  bool refers_to_meshes;  ///< Takes --mesh-prefix.
  bool takes_program;     ///< Takes --program.
  bool has_world;         ///< Takes --world.
  OutputKind kind;        ///< Of the main file.
  /// Makes the text and its companion files in memory, and writes nothing. The error is for the
  /// user, such as what of the model the format cannot express.
  Result<emit::Exported> (*make)(const ExportRequest&);
};

/// The kind of a file that lies beside a main file, by the extension of its name. It decides
/// whether a file that is there already may be replaced (CheckOutput).
OutputKind CompanionKind(const std::string& path);

/// All of them, in the order in which messages list them.
const std::vector<ExportFormat>& ExportFormats();

}  // namespace morphbus::tools
