// morphbus fk: forward kinematics of a robot.

#include <fmt/format.h>

#include <cmath>

#include "compiler/base/quantity.h"
#include "compiler/model/forward_kinematics.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus fk`.
struct FkOptions {
  std::string file;
  std::string robot;
  std::vector<std::string> set;
  bool json = false;
};

/// Reads "0.3" (rad or m), or "45deg" and "0.3rad" for joints that turn.
std::optional<double> ParseValue(const std::string& text, bool turns) {
  constexpr double kMost = 1e6;
  const std::optional<double> value = turns ? ReadRadians(text) : ReadPlainNumber(text);
  // Values far beyond any robot are refused.
  return value && std::abs(*value) <= kMost ? value : std::nullopt;
}

/// Applies one `module.joint=value`; fails for another text, or names that the robot lacks.
Result<void> ApplySetting(const model::Model& model, const model::Robot& robot,
                          const std::string& text, model::JointValues* q) {
  // The text has three parts: the module before the point, the joint up to the sign, the value.
  const size_t equals = text.find('=');
  const size_t dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals) {
    return Fail(fmt::format("--set {}: expected module.joint=value, e.g. m1.joint_1=0.3", text));
  }
  const std::string module_name = text.substr(0, dot);
  const std::string joint_name = text.substr(dot + 1, equals - dot - 1);
  // Wrong names get the nearest right one, of this robot and of this module type.
  const Result<int> module = FindModule(robot, module_name);
  if (!module) return Fail(fmt::format("--set {}: {}", text, module.error().message));
  const model::ModuleType& type = model.TypeOf(robot, *module);
  const std::optional<int> joint = type.FindJoint(joint_name);
  if (!joint) {
    const std::vector<std::string> names = NamesOf(type.joints);
    return Fail(fmt::format("--set {}: module {} has no joint '{}'{}; it has {}", text, type.name,
                            joint_name, DidYouMean(joint_name, names), fmt::join(names, ", ")));
  }
  // Only a joint that turns takes degrees.
  const bool turns = type.joints[*joint].type != model::JointType::kPrismatic;
  const std::optional<double> value = ParseValue(text.substr(equals + 1), turns);
  if (!value) {
    return Fail(fmt::format("--set {}: expected {}, at most 1e6", text,
                            turns ? "a number of radians, or of degrees such as 45deg"
                                  : "a number of metres: the joint slides"));
  }
  (*q)[*module][*joint] = *value;
  return {};
}

/// Sets the raw joint values of --set, computes all link poses, prints them.
int Fk(const FkOptions& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return kUnusable;
  // Joints that --set does not name stay at their start values. Limits are not applied.
  model::JointValues q = model::StartValues(*robot);
  for (const std::string& setting : options.set) {
    if (Result<void> r = ApplySetting(*model, *robot, setting, &q); !r) {
      return Unusable(r.error().message);
    }
  }
  const model::KinematicState state = model::ForwardKinematics(*model, *robot, q);
  // Poses by "module.link", in the order of the robot's modules and of each type's links.
  Json links = Json::object();
  for (size_t m = 0; m < robot->modules.size(); ++m) {
    const model::ModuleType& type = model->TypeOf(*robot, static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      // Names are unique; looking each up among all before it would be quadratic.
      links.get_ref<Json::object_t&>().emplace_back(
          robot->modules[m].name + "." + type.links[l].name, PoseJson(state.X_RL[m][l]));
    }
  }
  // Closure is the largest gap at which loops of connections do not meet at these values.
  if (options.json) {
    PrintJson({{"robot", robot->name},
               {"links", links},
               {"closure_m", state.closure_m},
               {"closure_rad", state.closure_rad}});
    return kDone;
  }
  Print("robot {}: poses of the link frames in the robot frame (north, up, east)\n", robot->name);
  Print("{:<24} {:>27}   {}\n", "link", "position (m)", "rotation (w x y z)");
  for (const auto& [name, pose] : links.items()) {
    // The columns are the position x y z and the quaternion w x y z.
    Print("{:<24} {:9.5f}   {:7.4f}\n", name, fmt::join(Numbers(pose["p"]), ""),
          fmt::join(Numbers(pose["q"]), " "));
  }
  Print("largest gap of a loop: {:.3g} m, {:.3g} degrees\n", state.closure_m,
        state.closure_rad * 180.0 / EIGEN_PI);
  return kDone;
}

}  // namespace

void AddFk(CommandLine* line) {
  Subcommand sub = line->Add("fk", "Forward kinematics of a robot");
  auto options = std::make_shared<FkOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file").Required();
  sub.Robot(&options->robot);
  sub.Add("--set", &options->set, "Raw joint value, rad or m, or e.g. 45deg; may be repeated")
      .TypeName("MODULE.JOINT=VALUE")
      .Repeatable();
  sub.Json(&options->json);
  sub.Footer(
      "Example:\n  morphbus fk models/mtran.m3l --robot quadruped --set m1.joint_1=0.3 "
      "--set m1.joint_2=-45deg");
  sub.Do([options] { return Fk(*options); });
}

}  // namespace morphbus::tools
