#pragma once
// What `morphbus draw` draws of a model: a robot, a module type, two modules that are mated, or a
// robot and the roles of a program.

#include <optional>
#include <string>

#include "logger/show/drawing.h"
#include "tools/base/output_path.h"

namespace morphbus::tools {

/// What of which model. At most one of robot with program, module and number is given.
struct ModelPicture {
  std::string file;     ///< Path of the M3L file.
  std::string robot;    ///< Empty: the only one.
  std::string program;  ///< Path of a program by whose roles the modules are coloured; empty: none.
  std::string module;   ///< Name of a module type; empty: no such picture.
  std::string connection;  ///< Name of a connection; empty: the only one.
  int number = 0;          ///< Which way of this connection to mate two modules, from 1; 0: none.
  std::string world;       ///< Path of an SDFormat file of obstacles beside a robot; empty: none.
};

/// The scene, the title and the legend; the caller chooses views and size. Nothing, after saying
/// why, if it cannot be drawn. `output`, of this kind, is checked to be none of the files that were
/// read, before anything takes long.
std::optional<logger::Drawing> DrawModel(const ModelPicture& picture, const std::string& output,
                                         const OutputKind& kind, bool force);

}  // namespace morphbus::tools
