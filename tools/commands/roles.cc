// morphbus roles: which module takes which role, without moving anything.

#include <fmt/format.h>

#include <algorithm>

#include "tools/commands/commands.h"
#include "tools/launch/run_plan.h"
#include "tools/launch/static_roles.h"

namespace morphbus::tools {
namespace {

/// The object that docs/cli.md describes: roles by module, and all problems in one list.
Json RolesJson(const StaticRoles& roles) {
  Json modules = Json::object();
  Json problems = Json::array();
  for (const StaticRole& module : roles.modules) {
    // Both maps are empty for a module without a role.
    Json labels = Json::object();
    for (const auto& [label, target] : module.labels) labels[label] = target;
    Json signs = Json::object();
    for (const auto& [label, sign] : module.signs) signs[label] = sign;
    modules[module.module] = {{"role", module.role.empty() ? Json(nullptr) : Json(module.role)},
                              {"labels", labels},
                              {"signs", signs}};
    for (const std::string& problem : module.problems) problems.push_back(problem);
  }
  // Roles that never settle are a problem of the program, and one for all modules.
  if (!roles.settled)
    problems.push_back(fmt::format("roles still change after {} ticks", roles.ticks));
  return {{"modules", modules}, {"problems", problems}};
}

/// Prints a line a module, with labels and signs, then the problems.
void PrintRoles(const Json& json) {
  fmt::print("{:<8} {:<24} {}\n", "module", "role", "labels (sign under setJointAxis)");
  for (const auto& [name, module] : json["modules"].items()) {
    // "knee = joint_1 (+)": the sign only where the program sets a convention.
    std::string labels;
    for (const auto& [label, target] : module["labels"].items()) {
      const auto sign = module["signs"].find(label);
      labels +=
          fmt::format("{}{} = {}", labels.empty() ? "" : ", ", label, target.get<std::string>());
      if (sign != module["signs"].end()) labels += sign->get<int>() > 0 ? " (+)" : " (-)";
    }
    // A module without a role has no labels either.
    fmt::print("{:<8} {:<24} {}\n", name,
               module["role"].is_null() ? "(none)" : module["role"].get<std::string>(), labels);
  }
  for (const Json& problem : json["problems"])
    fmt::print("problem: {}\n", problem.get<std::string>());
}

/// Plans a run that never starts, and lets its VMs settle.
int Roles(const RunOptions& options) {
  const std::optional<RunPlan> plan = PlanRun(options);
  if (!plan) return kUnusable;
  // Everything up to here is as for `run`, with the same errors.
  const Result<StaticRoles> roles = SettleRoles(*plan);
  if (!roles) return Unusable(roles.error().message);
  const Json json = RolesJson(*roles);
  if (options.json) {
    PrintJson(json);
  } else {
    PrintRoles(json);
  }
  // A program without roles runs main code alone: that no module has a role is then no failure.
  const bool any = std::any_of(roles->modules.begin(), roles->modules.end(),
                               [](const StaticRole& module) { return !module.role.empty(); });
  return any || !HasRoles(*plan) ? kDone : kNo;
}

}  // namespace

void AddRoles(CommandLine* line) {
  Subcommand sub = line->Add(
      "roles", "Which module takes which role, its labels and conventions; nothing moves");
  auto options = std::make_shared<RunOptions>();
  sub.Add("FILE", &options->model_file, "M3L file").Required();
  sub.Add("PROGRAM", &options->program_file, "DynaRole program or image").Required();
  sub.Robot(&options->robot);
  sub.Add("--root", &options->root,
          "Module that broadcasts the root pose (default: the robot frame's)");
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 1: the program has roles, and no module takes one.\n"
      "Example:\n  morphbus roles models/mtran.m3l models/programs/quadruped.dyn --robot "
      "quadruped");
  sub.Do([options] { return Roles(*options); });
}

}  // namespace morphbus::tools
