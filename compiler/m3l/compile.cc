#include "compiler/m3l/compile.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "compiler/m3l/checker.h"
#include "compiler/m3l/constants.h"
#include "compiler/m3l/loader.h"
#include "compiler/model/visual_limits.h"

namespace morphbus::m3l {
namespace {

// Bounds that keep hostile input from taking forever; see also check_module.cc.
constexpr size_t kMaxDefinitions = 1000;
constexpr double kMaxSolverWork = 2e6;

/// All definitions of one kind, in order; repeated names are reported and left out.
template <typename Decl>
std::vector<const Decl*> Collect(const std::vector<FileAst>& files,
                                 std::vector<Decl> FileAst::*list, const std::string& kind,
                                 source::Diagnostics* diagnostics) {
  std::vector<const Decl*> all;
  std::map<std::string, const Decl*> seen;
  for (const FileAst& file : files) {
    for (const Decl& decl : file.*list) {
      // A name that did not parse is empty, and says nothing about another one.
      const auto [it, fresh] = seen.emplace(decl.name.text, &decl);
      if (!fresh && !decl.name.text.empty()) {
        diagnostics->Error(decl.name.span, "there is another " + kind + " '" + decl.name.text + "'")
            .Note(it->second->name.span, "first defined here");
      } else if (all.size() == kMaxDefinitions) {
        diagnostics->Error(decl.name.span, "more than " + std::to_string(kMaxDefinitions) + " " +
                                               kind + " definitions");
        return all;
      } else {
        all.push_back(&decl);
      }
    }
  }
  return all;
}

/// About how much there is to solve: pairs of connectors, each with the ways in which sub-points
/// can meet, each way with a comparison of hulls.
double WorkOf(const model::ModuleType& a, const model::ModuleType& b) {
  // Each connector has a motion of its own and those that its sub-points allow.
  const auto size = [](const model::ModuleType& type) {
    double connectors = 0.0, hull_points = 0.0;
    for (const model::Connector& connector : type.connectors) {
      connectors += 1.0 + static_cast<double>(connector.subpoints.size());
    }
    for (const model::Link& link : type.links) hull_points += static_cast<double>(link.hull.size());
    return std::pair(connectors, hull_points);
  };
  // Every pair of connectors may be looked at, and every pair of hull points for each of its
  // motions.
  const auto [connectors_a, hull_a] = size(a);
  const auto [connectors_b, hull_b] = size(b);
  return connectors_a * connectors_b * (1.0 + hull_a * hull_b / 1000.0);
}

/// The module types as conditions see them: every connector has all its directions, also those that
/// its source leaves out, which are no part of the model.
std::vector<model::ModuleType> WithDirections(const std::vector<CheckedModule>& modules) {
  std::vector<model::ModuleType> types;
  for (const CheckedModule& module : modules) {
    model::ModuleType& type = types.emplace_back(module.type);
    for (size_t i = 0; i < module.directions.size(); ++i) {
      type.connectors[i].normals = module.directions[i];
    }
  }
  return types;
}

/// Solves what is sound; the others stay without options, so that indices agree.
void SolveConnections(std::vector<CheckedConnection>& connections,
                      const std::vector<model::ModuleType>& types, model::Model& model,
                      source::Diagnostics* diagnostics) {
  double work = 0.0;
  for (CheckedConnection& connection : connections) {
    const solver::ConnectionProblem& problem = connection.problem;
    if (connection.valid) {
      work += WorkOf(model.module_types[problem.type_a], model.module_types[problem.type_b]);
    }
    // The bound is on all connections together; those before it are solved all the same.
    if (connection.valid && work > kMaxSolverWork) {
      diagnostics->Error(problem.span,
                         "the connections are too much to solve: too many connectors, "
                         "sub-points and hull points together");
      connection.valid = false;
    }
    if (connection.valid) {
      // A connection that the solver reports is unsound too.
      const int errors = diagnostics->error_count();
      model.connection_types.push_back(
          solver::SolveConnection(problem, types, diagnostics, &connection.broken));
      connection.valid = errors == diagnostics->error_count();
    } else {
      model::ConnectionType& unsolved = model.connection_types.emplace_back();
      unsolved.name = problem.name;
      unsolved.type_a = problem.type_a;
      unsolved.type_b = problem.type_b;
    }
  }
}

/// Where each link's hull is written.
std::vector<source::Span> HullSpans(const ModuleDecl& module) {
  std::vector<source::Span> spans;
  for (const LinkDecl& link : module.links) {
    // A link without a hull has an empty span, so that indices agree.
    const Attribute* hull = link.Find("hull");
    spans.push_back(hull != nullptr && hull->value ? hull->value->span : source::Span{});
  }
  return spans;
}

/// Adds what is seen of a module's links to `size`, points and triangles of those before it, and
/// reports the link with which it becomes more than the head of a log has room for.
void CountLooks(const ModuleDecl& decl, const model::ModuleType& type, size_t* size,
                source::Diagnostics* diagnostics) {
  for (size_t l = 0; l < type.links.size() && l < decl.links.size(); ++l) {
    const size_t before = *size;
    for (const model::VisualPart& part : type.links[l].visual) *size += model::SizeOf(part);
    if (before > model::kMaxVisualSizeOfModel || *size <= model::kMaxVisualSizeOfModel) continue;
    const Attribute* visual = decl.links[l].Find("visual");
    diagnostics
        ->Error(visual != nullptr && visual->value ? visual->value->span : decl.links[l].name.span,
                fmt::format("with this, what is seen of all links has {} points and triangles; the "
                            "most is {}, as every log of a run holds them",
                            *size, model::kMaxVisualSizeOfModel))
        .Hint("use coarser meshes");
  }
}

/// Warns of files without any definition, which are seldom meant.
void WarnIfEmpty(const std::vector<FileAst>& files, source::Diagnostics* diagnostics) {
  for (const FileAst& file : files) {
    if (!file.modules.empty() || !file.connections.empty() || !file.robots.empty()) return;
    if (!file.constants.empty()) return;
  }
  if (files.empty() || diagnostics->had_errors()) return;
  diagnostics->Warning({0, 0, 0}, "nothing is defined").hint =
      "definitions begin with module, connection or robot";
}

/// Checks and solves all definitions of `files`; the model, or nothing if there are errors.
std::optional<model::Model> Check(const std::vector<FileAst>& files, CompileOutput& output) {
  source::Diagnostics* diagnostics = &output.diagnostics;
  WarnIfEmpty(files, diagnostics);
  model::Model model;
  // Modules first, as connections and robots name them.
  std::vector<CheckedModule> modules;
  size_t looks = 0;
  for (const ModuleDecl* decl : Collect(files, &FileAst::modules, "module", diagnostics)) {
    if (diagnostics->full()) return std::nullopt;
    modules.push_back(CheckModule(*decl, output.sources, diagnostics));
    model.module_types.push_back(modules.back().type);
    output.hulls.push_back(HullSpans(*decl));
    CountLooks(*decl, modules.back().type, &looks, diagnostics);
  }
  // Connections next; a pointer to each module stays good, as no more are added.
  std::vector<CheckedConnection> connections;
  for (const auto* decl : Collect(files, &FileAst::connections, "connection", diagnostics)) {
    if (diagnostics->full()) return std::nullopt;
    connections.push_back(CheckConnection(*decl, modules, diagnostics));
  }
  // A connection is explainable if it was sound before it was solved.
  std::vector<bool> sound;
  for (const CheckedConnection& connection : connections) sound.push_back(connection.valid);
  output.solved.module_types = WithDirections(modules);
  SolveConnections(connections, output.solved.module_types, model, diagnostics);
  // What `why` explains: connections may be asked about where robots have errors.
  for (size_t i = 0; i < connections.size(); ++i) {
    const solver::ConnectionProblem& problem = connections[i].problem;
    // Where a member's type is not known there are no connectors to explain.
    if (problem.type_a < 0 || problem.type_b < 0) continue;
    output.solved.connection_types.push_back(model.connection_types[i]);
    output.problems.push_back(problem);
    output.explainable.push_back(sound[i]);
  }
  // Robots last: they choose among the options that the solver found.
  PairIndex pairs;
  for (const model::ConnectionType& connection : model.connection_types) {
    auto& table = pairs.emplace_back();
    for (int i = 0; i < std::ssize(connection.options); ++i) {
      const model::ConnectionOption& option = connection.options[i];
      // Robots name connectors: options are looked up by both.
      table[{option.connector_a, option.connector_b}].push_back(i);
    }
  }
  const RobotContext context{modules, connections, model, pairs};
  std::vector<model::Robot> robots;
  for (const RobotDecl* decl : Collect(files, &FileAst::robots, "robot", diagnostics)) {
    if (diagnostics->full()) return std::nullopt;
    std::optional<CheckedRobot> checked = CheckRobot(*decl, context, diagnostics);
    if (!checked) continue;
    robots.push_back(std::move(checked->robot));
    output.modules.push_back(std::move(checked->modules));
    output.dockings.push_back(std::move(checked->dockings));
  }
  if (diagnostics->had_errors()) return std::nullopt;
  model.robots = std::move(robots);
  return model;
}

}  // namespace

std::optional<Dump> DumpFromName(const std::string& name) {
  if (name == "tokens") return Dump::kTokens;
  if (name == "ast") return Dump::kAst;
  return std::nullopt;
}

CompileOutput CompileFiles(const std::vector<std::string>& paths, Dump dump,
                           const source::OpenTexts* open) {
  CompileOutput output;
  Loader loader(dump, &output, open);
  for (const std::string& path : paths) loader.LoadPath(path);
  ResolveConstants(&output.files, &output.diagnostics);
  output.model = Check(output.files, output);
  return output;
}

CompileOutput CompileText(const std::string& name, const std::string& text, Dump dump) {
  CompileOutput output;
  Loader loader(dump, &output);
  loader.LoadText(name, text);
  ResolveConstants(&output.files, &output.diagnostics);
  output.model = Check(output.files, output);
  return output;
}

}  // namespace morphbus::m3l
