#pragma once
// The front door of the M3L compiler: files in, diagnostics and (if there are no errors) a Model
// out.

#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

struct CompileOutput {
  /// Present exactly when `diagnostics` holds no error.
  std::optional<model::Model> model;
  /// Files that were read (arguments and imports), for rendering the diagnostics.
  source::SourceSet sources;
  source::Diagnostics diagnostics;
};

/// Compiles `paths` and what they import as one model: lex, parse, check, solve, assemble.
/// Unreadable files are diagnostics too. Never throws.
CompileOutput CompileFiles(const std::vector<std::string>& paths);

/// The same for one text held in memory; `name` stands for the file name in diagnostics.
CompileOutput CompileText(const std::string& name, const std::string& text);

}  // namespace morphbus::m3l
