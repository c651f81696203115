// morphbus roles: which module takes which role, without moving anything.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"
#include "tools/run_plan.h"
#include "tools/static_roles.h"

namespace morphbus::tools {
namespace {

Json RolesJson(const StaticRoles& roles) {
  Json modules = Json::object();
  Json problems = Json::array();
  for (const StaticRole& module : roles.modules) {
    Json labels = Json::object();
    for (const auto& [label, target] : module.labels) labels[label] = target;
    Json signs = Json::object();
    for (const auto& [label, sign] : module.signs) signs[label] = sign;
    modules[module.module] = {{"role", module.role.empty() ? Json(nullptr) : Json(module.role)},
                              {"labels", labels},
                              {"signs", signs}};
    for (const std::string& problem : module.problems) problems.push_back(problem);
  }
  if (!roles.settled)
    problems.push_back(fmt::format("roles still change after {} ticks", roles.ticks));
  return {{"modules", modules}, {"problems", problems}};
}

void PrintRoles(const Json& json) {
  fmt::print("{:<8} {:<24} {}\n", "module", "role", "labels (sign under setJointAxis)");
  for (const auto& [name, module] : json["modules"].items()) {
    std::string labels;
    for (const auto& [label, target] : module["labels"].items()) {
      const auto sign = module["signs"].find(label);
      labels +=
          fmt::format("{}{} = {}", labels.empty() ? "" : ", ", label, target.get<std::string>());
      if (sign != module["signs"].end()) labels += sign->get<int>() > 0 ? " (+)" : " (-)";
    }
    fmt::print("{:<8} {:<24} {}\n", name,
               module["role"].is_null() ? "(none)" : module["role"].get<std::string>(), labels);
  }
  for (const Json& problem : json["problems"])
    fmt::print("problem: {}\n", problem.get<std::string>());
}

int Roles(const RunOptions& options) {
  const std::optional<RunPlan> plan = PlanRun(options);
  if (!plan) return kUnusable;
  const Result<StaticRoles> roles = SettleRoles(*plan);
  if (!roles) return Unusable(roles.error().message);
  const Json json = RolesJson(*roles);
  if (options.json) {
    PrintJson(json);
  } else {
    PrintRoles(json);
  }
  return kDone;
}

}  // namespace

void AddRoles(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand(
      "roles", "Which module takes which role, its labels and conventions; nothing moves");
  auto options = std::make_shared<RunOptions>();
  sub->add_option("FILE", options->model_file, "M3L file")->required();
  sub->add_option("PROGRAM", options->program_file, "DynaRole program or image")->required();
  sub->add_option("--robot", options->robot, "The robot's name (default: the only one)");
  sub->add_option("--root", options->root,
                  "Module that broadcasts the root pose (default: the robot frame's)");
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Example:\n  morphbus roles models/mtran.m3l models/programs/quadruped.dyn --robot "
      "quadruped");
  sub->callback([options, action] { *action = [options] { return Roles(*options); }; });
}

}  // namespace morphbus::tools
