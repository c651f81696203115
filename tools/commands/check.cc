// morphbus check: everything that can be said about a model without running it.

#include <fmt/format.h>

#include <algorithm>

#include "compiler/base/text.h"
#include "compiler/model/attributes.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/model_proto.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/commands/motion.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus check`.
struct CheckOptions {
  std::vector<std::string> files;
  std::string dump;
  bool attributes = false;
  bool json = false;
  MotionChoice motion;
};

/// One of "modules".
Json ModuleTypeJson(const model::ModuleType& type) {
  // The mass of a module is the sum of its links.
  double mass_kg = 0.0;
  for (const model::Link& link : type.links) mass_kg += link.mass_kg;
  return {{"name", type.name},
          {"links", type.links.size()},
          {"joints", type.joints.size()},
          {"connectors", type.connectors.size()},
          {"mass_kg", mass_kg}};
}

/// One of "connections".
Json ConnectionJson(const model::Model& model, const model::ConnectionType& connection) {
  return {{"name", connection.name},
          {"a", model.module_types[connection.type_a].name},
          {"b", model.module_types[connection.type_b].name},
          {"count", connection.options.size()},
          {"candidates", connection.candidates}};
}

/// What is not computed is null: a reader must not take it for an answer.
Json RobotJson(const model::Model& model, const model::Robot& robot,
               const model::KinematicGraph& graph) {
  // Loops close, or do not, at the start values.
  const model::KinematicState state =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  Json locked = graph.locked_computed ? Json::array() : Json();
  for (const model::GraphJoint& joint : graph.joints) {
    if (!joint.locked) continue;
    locked.push_back(JointName(model, robot, joint));
  }
  return {{"name", robot.name},
          {"modules", robot.modules.size()},
          {"connections", robot.dockings.size()},
          {"bodies", graph.bodies.size()},
          {"joints", graph.joints.size()},
          {"mobility", graph.mobility ? Json(*graph.mobility) : Json()},
          {"loops", state.num_loops},
          // The largest gap that remains where a loop of connections closes, metres and radians.
          {"closure_m", state.closure_m},
          {"closure_rad", state.closure_rad},
          {"locked", locked}};
}

/// "3 links": the count that `json` has under the plural of `noun`.
std::string CountedIn(const Json& json, const std::string& noun) {
  return Counted(json[noun + "s"].get<int64_t>(), noun);
}

/// The same as RobotJson for people: a line of counts, then loops and the joints they lock.
void PrintRobot(const Json& robot, const model::KinematicGraph& graph) {
  Print("robot {}: {}, {}, {}, {}, {}\n", robot["name"].get<std::string>(),
        CountedIn(robot, "module"), CountedIn(robot, "connection"),
        Counted(robot["bodies"].get<int64_t>(), "body", "bodies"), CountedIn(robot, "joint"),
        MobilityText(graph));
  // Robots without loops have no gaps to report.
  if (robot["loops"].get<int>() > 0) {
    Print("  loops close within {:.1e} m and {:.1e} degrees\n", robot["closure_m"].get<double>(),
          robot["closure_rad"].get<double>() * 180.0 / EIGEN_PI);
  }
  // Above a limit of joints in one system of loops locks are not computed.
  if (robot["locked"].is_null()) {
    Print("  which joints are locked is not computed either\n");
  } else if (!robot["locked"].empty()) {
    Print("  locked by loops: {}\n", NameSome(robot["locked"].get<std::vector<std::string>>()));
  }
}

/// What `run --set` can change: a list for JSON, of which a table is printed unless `json`. A part
/// that has no value of its own, as a link that grips as the world says, has null there.
Json AttributeList(const model::Model& model, bool json) {
  const std::vector<model::SettableAttribute> attributes = model::SettableAttributes(model);
  Json list = Json::array();
  size_t width = 0;
  for (const model::SettableAttribute& attribute : attributes) {
    width = std::max(width, attribute.name.size());
    list.push_back({{"name", attribute.name},
                    {"value", attribute.value ? Json(*attribute.value) : Json()},
                    {"unit", attribute.unit},
                    {"least", attribute.least},
                    {"most", attribute.most}});
  }
  if (json || attributes.empty()) return list;
  Print("{:<{}}  {:>12}  {:>12}  {:>12}  unit\n", "attribute", width, "value", "least", "most");
  for (const model::SettableAttribute& attribute : attributes) {
    Print("{:<{}}  {:>12}  {:>12}  {:>12}  {}\n", attribute.name, width,
          attribute.value ? model::NumberText(*attribute.value) : "-",
          model::NumberText(attribute.least), model::NumberText(attribute.most), attribute.unit);
  }
  return list;
}

/// Prints a stage of the compiler instead of the summary.
int DumpStage(const CheckOptions& options) {
  // The model is what all stages together make; tokens and ast are stages of the front end.
  const bool model = options.dump == "model";
  const std::optional<m3l::Dump> stage =
      model ? std::optional(m3l::Dump::kNone) : m3l::DumpFromName(options.dump);
  // A name that is no stage is refused before any file is read.
  if (!stage) return Unusable("--dump: expected tokens, ast or model");
  const m3l::CompileOutput compiled = m3l::CompileFiles(options.files, *stage);
  PrintDiagnostics(compiled.diagnostics, compiled.sources);
  PrintText(model && compiled.model ? model::ModelText(*compiled.model) : compiled.dump);
  return compiled.model ? kDone : kUnusable;
}

/// Lists module types, connections and robots. Whatever is wrong with them stops LoadModel. What
/// moves is looked at last, as it takes longest.
int Check(const CheckOptions& options) {
  const std::optional<model::Model> model = LoadModel(options.files);
  if (!model || !IsUsable(options.motion, *model)) return kUnusable;
  // Module types come first. Each entry is printed from its JSON, so both outputs agree.
  Json modules = Json::array();
  for (const model::ModuleType& type : model->module_types) {
    modules.push_back(ModuleTypeJson(type));
    if (options.json) continue;
    Print("module {}: {}, {}, {}, {:.3g} kg\n", type.name, CountedIn(modules.back(), "link"),
          CountedIn(modules.back(), "joint"), CountedIn(modules.back(), "connector"),
          modules.back()["mass_kg"].get<double>());
  }
  // Connections follow, with how many of the candidate motions were kept.
  Json connections = Json::array();
  for (const model::ConnectionType& type : model->connection_types) {
    connections.push_back(ConnectionJson(*model, type));
    if (options.json) continue;
    Print("connection {} ({}, {}): {} of {} candidates\n", type.name,
          model->module_types[type.type_a].name, model->module_types[type.type_b].name,
          type.options.size(), type.candidates);
  }
  // Robots come last, each with the figures of its kinematic graph.
  Json robots = Json::array();
  for (const model::Robot& robot : model->robots) {
    const model::KinematicGraph graph = model::BuildKinematicGraph(*model, robot);
    robots.push_back(RobotJson(*model, robot, graph));
    if (!options.json) PrintRobot(robots.back(), graph);
  }
  Json json = {{"modules", modules}, {"connections", connections}, {"robots", robots}};
  if (options.attributes) json["attributes"] = AttributeList(*model, options.json);
  int status = kDone;
  if (options.motion.wanted) {
    Json motion;
    status = CheckMotions(options.motion, *model, options.json ? &motion : nullptr);
    json["motion"] = motion;
  }
  if (!options.motion.wanted && !options.json && !model->robots.empty()) {
    Print("whether links meet when joints move: morphbus check --motion\n");
  }
  // Without an answer there is none in part either.
  if (options.json && status != kUnusable) PrintJson(json);
  return status;
}

}  // namespace

void AddCheck(CommandLine* line) {
  Subcommand sub = line->Add("check", "Check M3L models and print what they hold");
  auto options = std::make_shared<CheckOptions>();
  sub.Add("FILE.m3l", &options->files, "M3L files; several are one model").Required();
  sub.Json(&options->json);
  sub.Add("--dump", &options->dump, "Print a stage instead: tokens, ast or model")
      .TypeName("tokens|ast|model");
  sub.Flag("--attributes", &options->attributes,
           "Also list what `run --set` can change: values, ranges and units");
  AddMotionOptions(&sub, &options->motion);
  sub.Footer(
      "With --motion the exit status is 1 if some links meet.\n"
      "Examples:\n  morphbus check models/mtran.m3l\n"
      "  morphbus check models/mtran.m3l --motion --robot quadruped --postures 5000");
  sub.Do([options] {
    if (!IsUsable(options->motion)) return kUnusable;
    if (!options->dump.empty() && options->motion.wanted) {
      return Unusable("--dump prints a stage instead of what --motion finds: choose one of them");
    }
    if (!options->dump.empty() && options->attributes) {
      return Unusable("--dump prints a stage instead of what --attributes lists: choose one");
    }
    return options->dump.empty() ? Check(*options) : DumpStage(*options);
  });
}

}  // namespace morphbus::tools
