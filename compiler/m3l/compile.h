#pragma once
// The front door of the M3L compiler: files in, diagnostics and (if there are no errors) a Model
// out.

#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"
#include "compiler/solver/connection_problem.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

struct CompileOutput {
  /// Present exactly when `diagnostics` holds no error.
  std::optional<model::Model> model;
  /// Files that were read (arguments and imports), for rendering the diagnostics.
  source::SourceSet sources;
  source::Diagnostics diagnostics;

  // For explanations of connections (`connections --why`), also where there are errors.

  /// Module types and connections without robots, as far as they could be worked out. A connection
  /// with an error has no options.
  model::Model solved;
  /// The conditions of solved.connection_types, in the same order.
  std::vector<solver::ConnectionProblem> problems;
  /// Which of the problems can be explained: those without an error in their conditions or modules.
  std::vector<bool> explainable;
  /// hulls[type][link]: where the hull of a link is written; empty where it has none.
  std::vector<std::vector<source::Span>> hulls;
};

/// Compiles `paths` and what they import as one model: lex, parse, check, solve, assemble.
/// Unreadable files are diagnostics too. Never throws.
CompileOutput CompileFiles(const std::vector<std::string>& paths);

/// The same for one text held in memory; `name` stands for the file name in diagnostics.
CompileOutput CompileText(const std::string& name, const std::string& text);

}  // namespace morphbus::m3l
