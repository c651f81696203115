// morphbus roles: which module takes which role, and why not, without moving anything.

#include <fmt/format.h>

#include <algorithm>

#include "compiler/keywords/module_keywords.h"
#include "tools/commands/commands.h"
#include "tools/commands/role_report.h"
#include "tools/plan/settings.h"
#include "tools/roles/role_explanation.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus roles`.
struct RolesOptions {
  std::string file;
  std::vector<std::string> programs;
  std::vector<std::string> robots;
  std::string root;
  std::string params;
  std::vector<std::string> set;
  std::vector<std::string> why;  ///< Module, and role if one is asked for; empty without --why.
  bool json = false;
};

/// The options of a run that never starts.
RunOptions RunOf(const RolesOptions& options, const std::string& program,
                 const std::string& robot) {
  RunOptions run;
  run.model_file = options.file;
  run.program_file = program;
  run.robot = robot;
  run.root = options.root;
  run.params = options.params;
  run.set = options.set;
  return run;
}

/// The plan of the only program on the only robot, with the same errors as `run` has.
std::optional<RunPlan> OnlyPlan(const RolesOptions& options, ModelSource* source) {
  return PlanRun(RunOf(options, options.programs[0], options.robots[0]), source);
}

/// One program on one robot: who plays what, and everything that is wrong with it.
int RolesOfOne(const RolesOptions& options) {
  ModelSource source;
  const std::optional<RunPlan> plan = OnlyPlan(options, &source);
  if (!plan) return kUnusable;
  const Result<StaticRoles> roles = SettleRoles(*plan);
  if (!roles) return Unusable(roles.error().message);
  if (options.json) {
    PrintJson(RolesJson(*roles));
  } else {
    PrintRoles(*plan, *roles, std::move(source));
  }
  // A program without roles runs main code alone: that no module has a role is then no failure.
  const bool any = std::any_of(roles->modules.begin(), roles->modules.end(),
                               [](const StaticRole& module) { return !module.role.empty(); });
  return any || !HasRoles(*plan) ? kDone : kNo;
}

/// What a program's roles find on each of the robots; nothing, after saying why, if that cannot be
/// asked.
std::optional<std::vector<Recognized>> RecognizeProgram(const RolesOptions& options,
                                                        const model::Model& model,
                                                        const std::string& path) {
  // A file that cannot be read is no answer, other than one that does not compile for this model:
  // it may be for other modules. What the compiler says of it is said once.
  if (const Result<std::string> text = ReadFile(path); !text) {
    return Refuse(text.error().message);
  }
  const std::optional<CompiledProgram> program = LoadProgram(path, keywords::KeywordsOf(model));
  std::vector<Recognized> found;
  for (const std::string& robot : options.robots) {
    Recognized& one = found.emplace_back();
    one.program = path;
    // Recognize has looked all names up, so that there is a robot.
    one.robot = PickRobot(model, robot)->name;
    // It stays in the list without roles, which is told as "does not compile".
    if (!program) continue;
    const std::optional<RunPlan> plan = PlanCompiled(RunOf(options, path, robot), model, *program);
    if (!plan) return std::nullopt;
    Result<StaticRoles> roles = SettleRoles(*plan);
    if (!roles) return Refuse(roles.error().message);
    one.roles = std::move(*roles);
  }
  return found;
}

/// Several programs or robots: which fit each other.
int Recognize(const RolesOptions& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  // All names are looked up before the first program is tried, which takes longer.
  for (const std::string& robot : options.robots) {
    if (PickRobot(*model, robot) == nullptr) return kUnusable;
  }
  std::vector<Recognized> found;
  for (const std::string& program : options.programs) {
    std::optional<std::vector<Recognized>> answers = RecognizeProgram(options, *model, program);
    if (!answers) return kUnusable;
    std::move(answers->begin(), answers->end(), std::back_inserter(found));
  }
  if (options.json) {
    PrintJson(RecognizedJson(found));
  } else {
    PrintRecognized(found);
  }
  // The answer is yes if any program fits any robot wholly.
  const bool any = std::any_of(found.begin(), found.end(),
                               [](const Recognized& one) { return FitOf(one) == Fit::kAll; });
  return any ? kDone : kNo;
}

/// One module, and one role or all: what they ask for, and what was found.
int Why(const RolesOptions& options) {
  ModelSource source;
  const std::optional<RunPlan> plan = OnlyPlan(options, &source);
  if (!plan) return kUnusable;
  const Result<std::vector<RoleExplanation>> why =
      ExplainRoles(*plan, options.why[0], options.why.size() > 1 ? options.why[1] : "");
  if (!why) return Unusable("--why: " + why.error().message);
  if (options.json) {
    PrintJson(ExplanationsJson(*why));
  } else {
    PrintExplanations(*plan, *why, std::move(source));
  }
  const bool any =
      std::any_of(why->begin(), why->end(), [](const RoleExplanation& role) { return role.fits; });
  return any ? kDone : kNo;
}

int Roles(RolesOptions options) {
  // Without a name it is the model's only robot. More than one of either is a question of which fit
  // each other, and one of both is a question of who plays what.
  if (options.robots.empty()) options.robots.emplace_back();
  const bool several = options.programs.size() * options.robots.size() > 1;
  if (!options.why.empty() && several) return Unusable("--why asks one program and one robot");
  if (!options.why.empty()) return Why(options);
  return several ? Recognize(options) : RolesOfOne(options);
}

}  // namespace

void AddRoles(CommandLine* line) {
  Subcommand sub = line->Add(
      "roles", "Which module takes which role, and why not; which programs fit; nothing moves");
  auto options = std::make_shared<RolesOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file").Required();
  sub.Add("PROG.dyn", &options->programs,
          "DynaRole program or image; of several: which of them fit the robot")
      .Required();
  sub.Add("--robot", &options->robots,
          "The robot's name (default: the only one); may be repeated: which of them fit")
      .TypeName("ROBOT")
      .Repeatable();
  sub.Add("--root", &options->root,
          "Module that broadcasts the root pose (default: the robot frame's)")
      .TypeName("MODULE");
  AddSettings(&sub, &options->params, &options->set);
  sub.Add("--why", &options->why,
          "What the role, or every role, asks of the module, and what was measured there")
      .TypeName("MODULE [ROLE]")
      .Values(1, 2);
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 1: the program has roles, and no module takes one; none of several programs "
      "fits; "
      "the role of --why, or every role, does not fit.\n"
      "Examples:\n  morphbus roles models/mtran.m3l models/programs/quadruped.dyn --robot "
      "quadruped\n"
      "  morphbus roles models/mtran.m3l models/programs/*.dyn --robot quadruped\n"
      "  morphbus roles models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --why m4 "
      "FrontLeftUpperHalf");
  sub.Do([options] { return Roles(*options); });
}

}  // namespace morphbus::tools
