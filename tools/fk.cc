// morphbus fk: forward kinematics of a robot.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdlib>

#include "compiler/model/forward_kinematics.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string robot;
  std::vector<std::string> set;
  bool json = false;
};

/// Reads "0.3" (rad or m), or "45deg" for joints that turn.
std::optional<double> ParseValue(const std::string& text, bool turns) {
  constexpr double kMost = 1e6;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const std::string unit = end;
  if (end == text.c_str() || !(std::abs(value) <= kMost)) return std::nullopt;
  if (unit == "deg" && turns) return value * EIGEN_PI / 180.0;
  if (unit.empty()) return value;
  return std::nullopt;
}

/// Applies one `module.joint=value`; on failure says why and returns false.
bool ApplySetting(const model::Model& model, const model::Robot& robot, const std::string& text,
                  model::JointValues* q) {
  const size_t equals = text.find('=');
  const size_t dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals) {
    Unusable(fmt::format("--set {}: expected module.joint=value, e.g. m1.joint_1=0.3", text));
    return false;
  }
  const std::string module_name = text.substr(0, dot);
  const std::string joint_name = text.substr(dot + 1, equals - dot - 1);
  const std::optional<int> module = robot.FindModule(module_name);
  if (!module) {
    std::vector<std::string> names;
    for (const model::ModuleInstance& m : robot.modules) names.push_back(m.name);
    Unusable(fmt::format("--set {}: robot {} has no module '{}'{}", text, robot.name, module_name,
                         DidYouMean(module_name, names)));
    return false;
  }
  const model::ModuleType& type = model.TypeOf(robot, *module);
  const std::optional<int> joint = type.FindJoint(joint_name);
  if (!joint) {
    std::vector<std::string> names;
    for (const model::Joint& j : type.joints) names.push_back(j.name);
    Unusable(fmt::format("--set {}: module {} has no joint '{}'{}; it has {}", text, type.name,
                         joint_name, DidYouMean(joint_name, names), fmt::join(names, ", ")));
    return false;
  }
  const bool turns = type.joints[static_cast<size_t>(*joint)].type != model::JointType::kPrismatic;
  const std::optional<double> value = ParseValue(text.substr(equals + 1), turns);
  if (!value) {
    Unusable(fmt::format("--set {}: expected {}, at most 1e6", text,
                         turns ? "a number of radians, or of degrees such as 45deg"
                               : "a number of metres: the joint slides"));
    return false;
  }
  (*q)[static_cast<size_t>(*module)][static_cast<size_t>(*joint)] = *value;
  return true;
}

int Fk(const Options& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  model::JointValues q = model::StartValues(*robot);
  for (const std::string& setting : options.set) {
    if (!ApplySetting(*model, *robot, setting, &q)) return kUnusable;
  }
  const model::KinematicState state = model::ForwardKinematics(*model, *robot, q);
  Json links = Json::object();
  for (size_t m = 0; m < robot->modules.size(); ++m) {
    const model::ModuleType& type = model->TypeOf(*robot, static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      // Names are unique; looking each up among all before it would be quadratic.
      links.get_ref<Json::object_t&>().emplace_back(
          robot->modules[m].name + "." + type.links[l].name, PoseJson(state.X_RL[m][l]));
    }
  }
  if (options.json) {
    PrintJson({{"robot", robot->name},
               {"links", links},
               {"closure_m", state.closure_m},
               {"closure_rad", state.closure_rad}});
    return kDone;
  }
  fmt::print("robot {}: poses of the link frames in the robot frame (north, up, east)\n",
             robot->name);
  fmt::print("{:<24} {:>27}   {}\n", "link", "position (m)", "rotation (w x y z)");
  for (const auto& [name, pose] : links.items()) {
    const Json& p = pose["p"];
    const Json& r = pose["q"];
    fmt::print("{:<24}{:9.5f} {:9.5f}{:9.5f}   {:7.4f} {:7.4f} {:7.4f} {:7.4f}\n", name,
               p[0].get<double>(), p[1].get<double>(), p[2].get<double>(), r[0].get<double>(),
               r[1].get<double>(), r[2].get<double>(), r[3].get<double>());
  }
  fmt::print("largest gap of a loop: {:.3g} m, {:.3g} degrees\n", state.closure_m,
             state.closure_rad * 180.0 / EIGEN_PI);
  return kDone;
}

}  // namespace

void AddFk(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("fk", "Forward kinematics of a robot");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--robot", options->robot, "The robot's name (default: the only one)");
  sub->add_option("--set", options->set,
                  "Raw joint value, rad or m, or e.g. 45deg; may be repeated")
      ->type_name("MODULE.JOINT=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Example:\n  morphbus fk models/mtran.m3l --robot quadruped --set m1.joint_1=0.3 "
      "--set m1.joint_2=-45deg");
  sub->callback([options, action] { *action = [options] { return Fk(*options); }; });
}

}  // namespace morphbus::tools
