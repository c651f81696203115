// morphbus build: a sheet with which a person puts a real robot together.

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "compiler/model/assembly_plan.h"
#include "compiler/solver/check_poses.h"
#include "logger/show/build_sheet.h"
#include "tools/base/json.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus build`.
struct BuildOptions {
  std::string model;
  std::string robot;
  std::string output;
  bool force = false;
  bool json = false;
};

/// The values of a module's joints by their names, radians or metres.
Json ValuesJson(const model::ModuleType& type, const std::vector<double>& values) {
  Json json = Json::object();
  for (size_t j = 0; j < type.joints.size(); ++j) json[type.joints[j].name] = values[j];
  return json;
}

Json MatingJson(const logger::Assembly& assembly, int module, const model::Mating& mating) {
  const model::Docking& d = assembly.robot.dockings[mating.docking];
  const model::ModuleType& own = assembly.TypeOf(module);
  const model::ModuleType& standing = assembly.TypeOf(mating.standing);
  Json states = Json::object();
  for (const model::StateRequirement& s : assembly.model.OptionOf(d).states) {
    const std::string end = s.of_a ? assembly.EndOf(d.module_a, d.connector_a)
                                   : assembly.EndOf(d.module_b, d.connector_b);
    states[end + "." + s.variable] = AttributeJson(s.value);
  }
  Json same_way = Json::array();
  for (const auto& [i, j] : mating.same_way) {
    same_way.push_back({own.connectors[i].name, standing.connectors[j].name});
  }
  Json loop = Json::array();
  for (const int one : mating.loop) loop.push_back(assembly.NameOf(one));
  // A turn is known where the way out is; half a turn is so in any case.
  Json turn;
  if (mating.turn && mating.turn->signed_) turn = mating.turn->degrees * EIGEN_PI / 180.0;
  return {{"own", assembly.EndOf(module, mating.own_connector)},
          {"standing", assembly.EndOf(mating.standing, mating.standing_connector)},
          {"connection", assembly.model.connection_types[d.connection_type].name},
          {"number", mating.number},
          {"ways", mating.ways},
          {"turn_rad", std::move(turn)},
          {"same_way", std::move(same_way)},
          {"state", std::move(states)},
          {"loop", std::move(loop)}};
}

Json StepsJson(const logger::Assembly& assembly) {
  Json json = Json::array();
  int step = 0;
  for (const auto& added : logger::StepsOf(assembly.plan)) {
    ++step;
    for (const model::AddedModule& one : added) {
      Json matings = Json::array();
      for (const model::Mating& mating : one.matings) {
        matings.push_back(MatingJson(assembly, one.module, mating));
      }
      const model::ModuleType& type = assembly.TypeOf(one.module);
      json.push_back({{"step", step},
                      {"module", assembly.NameOf(one.module)},
                      {"type", type.name},
                      {"joints", ValuesJson(type, assembly.robot.modules[one.module].start)},
                      {"connections", std::move(matings)}});
    }
  }
  return json;
}

Json PosesJson(const logger::Assembly& assembly, const solver::CheckPoses& poses) {
  constexpr const char* kNames[] = {"start", "zero", "bent"};
  Json json = Json::array();
  for (const solver::CheckPose& pose : poses.poses) {
    Json joints = Json::object();
    for (int m = 0; m < std::ssize(assembly.robot.modules); ++m) {
      joints[assembly.NameOf(m)] = ValuesJson(assembly.TypeOf(m), pose.q[m]);
    }
    Json alike = Json::array();
    for (const solver::AlikeWay& way : pose.alike) {
      alike.push_back({{"module", assembly.NameOf(assembly.plan.modules[way.added].module)},
                       {"number", way.number}});
    }
    json.push_back({{"pose", kNames[static_cast<int>(pose.kind)]},
                    {"joints", std::move(joints)},
                    {"other_ways", pose.num_other_ways},
                    {"alike", std::move(alike)}});
  }
  return json;
}

/// The steps and poses as docs/cli.md has them.
Json BuildJson(const logger::Assembly& assembly, const solver::CheckPoses& poses) {
  return {{"robot", assembly.robot.name},     {"steps", StepsJson(assembly)},
          {"loops", poses.num_loops},         {"closure_m", poses.closure_m},
          {"closure_rad", poses.closure_rad}, {"poses", PosesJson(assembly, poses)}};
}

/// The model with all directions of its connectors, which the sheet tells of; the files that were
/// read come to `read`.
std::optional<model::Model> LoadDirected(const std::string& path, std::vector<std::string>& read) {
  m3l::CompileOutput compiled = m3l::CompileFiles({path});
  PrintDiagnostics(compiled.diagnostics, compiled.sources);
  for (int file = 0; file < compiled.sources.size(); ++file) {
    read.push_back(compiled.sources.name(file));
  }
  if (compiled.model) compiled.model->module_types = std::move(compiled.solved.module_types);
  return std::move(compiled.model);
}

/// Writes the sheet in the format of its name.
int WriteSheet(const logger::Sheet& sheet, const BuildOptions& options, bool pdf) {
  WorkProgress progress;
  const auto show = [&](double part) { progress.Show(options.output, part); };
  const Result<std::string> bytes =
      pdf ? logger::SheetPdf(sheet, show) : Result<std::string>(logger::SheetHtml(sheet, show));
  if (!bytes) return Unusable(options.output + ": " + bytes.error().message);
  const Result<void> written = WriteFile(options.output, *bytes);
  return written ? kDone : Unusable(written.error().message);
}

int Build(const BuildOptions& options) {
  if (options.output.empty() && !options.json) {
    return Unusable("say what to write: -o FILE.html, -o FILE.pdf, or --json");
  }
  const bool pdf = options.output.ends_with(".pdf");
  if (!options.output.empty() && !pdf && !options.output.ends_with(".html")) {
    return Unusable(options.output + ": a sheet's name ends in .html or .pdf");
  }
  std::vector<std::string> read;
  const std::optional<model::Model> model = LoadDirected(options.model, read);
  if (!model) return kUnusable;
  if (!MayWrite(options.output, pdf ? outputs::kPdf : outputs::kReport, options.force, read)) {
    return kUnusable;
  }
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  if (robot->modules.size() > logger::kMostBuildModules) {
    return Unusable(fmt::format("{} has {} modules; a sheet is made for {} at most", robot->name,
                                robot->modules.size(), logger::kMostBuildModules));
  }
  const model::AssemblyPlan plan = model::PlanAssembly(*model, *robot);
  const solver::CheckPoses poses = solver::FindCheckPoses(*model, *robot, plan);
  const logger::Assembly assembly = {*model, *robot, plan};
  if (!options.output.empty()) {
    const int status = WriteSheet(logger::BuildSheet(assembly, poses), options, pdf);
    if (status != kDone) return status;
  }
  if (options.json) PrintJson(BuildJson(assembly, poses));
  return kDone;
}

}  // namespace

void AddBuild(CommandLine* line) {
  Subcommand sub =
      line->Add("build", "A sheet to put a real robot together: parts, steps, check poses");
  auto options = std::make_shared<BuildOptions>();
  sub.Add("FILE.m3l", &options->model, "M3L file").Required();
  sub.Robot(&options->robot);
  sub.Add("-o,--output", &options->output,
          "Sheet to write: .html, one self-contained page, or .pdf, pages of A4")
      .TypeName("FILE");
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n"
      "  morphbus build models/mtran.m3l --robot quadruped -o quadruped.pdf\n"
      "  morphbus build models/atron.m3l --robot car -o car.html\n"
      "  morphbus build models/mtran.m3l --robot quadruped --json");
  sub.Do([options] { return Build(*options); });
}

}  // namespace morphbus::tools
