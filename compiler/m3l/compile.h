#pragma once
// The front door of the M3L compiler: files in, diagnostics and (if there are no errors) a Model
// out.

#include <optional>
#include <string>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/model/robot_model.h"
#include "compiler/solver/connection_problem.h"
#include "compiler/source/diagnostics.h"
#include "compiler/source/import_reader.h"

namespace morphbus::m3l {

/// A stage of the compiler whose result is wanted as text. The model, the last stage, has its text
/// from Protocol Buffers (compiler/model/model_proto.h).
enum class Dump { kNone, kTokens, kAst };

/// "tokens" or "ast"; nothing for other names.
std::optional<Dump> DumpFromName(const std::string& name);

struct CompileOutput {
  /// Present exactly when `diagnostics` holds no error.
  std::optional<model::Model> model;
  /// Files that were read (arguments and imports), for rendering the diagnostics.
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  /// The stage asked for, of every file in the order in which their definitions count.
  std::string dump;

  // For explanations of connections (`connections --why`), also where there are errors.

  /// Module types and connections without robots, as far as they could be worked out. A connection
  /// with an error has no options; one whose members' types are not both known is left out, so the
  /// indices in it are always good.
  model::Model solved;
  /// The conditions of solved.connection_types, in the same order.
  std::vector<solver::ConnectionProblem> problems;
  /// Which of the problems can be explained: those without an error in their conditions or modules.
  std::vector<bool> explainable;
  /// modules[robot][module]: where the name of each module of the model's robots is written.
  std::vector<std::vector<source::Span>> modules;
  /// hulls[type][link]: where the hull of a link is written; empty where it has none.
  std::vector<std::vector<source::Span>> hulls;
  /// dockings[robot][docking]: where each connection of the model's robots is written.
  std::vector<std::vector<source::Span>> dockings;
  /// The syntax trees of the files, imported ones first. Their numbers are those of `sources`.
  std::vector<FileAst> files;
};

/// Compiles `paths` and what they import as one model: lex, parse, check, solve, assemble.
/// Unreadable files are diagnostics too. Never throws.
/// @param open  if not null, texts in place of files.
CompileOutput CompileFiles(const std::vector<std::string>& paths, Dump dump = Dump::kNone,
                           const source::OpenTexts* open = nullptr);

/// The same for one text held in memory; `name` stands for the file name in diagnostics.
CompileOutput CompileText(const std::string& name, const std::string& text,
                          Dump dump = Dump::kNone);

}  // namespace morphbus::m3l
