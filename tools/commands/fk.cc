// morphbus fk: forward kinematics of a robot.

#include <fmt/format.h>

#include <cmath>

#include "compiler/base/quantity.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/jacobian.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus fk`.
struct FkOptions {
  std::string file;
  std::string robot;
  std::vector<std::string> set;
  /// A link whose Jacobian is printed, too; empty: none.
  std::string jacobian;
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

/// The link called `text`, "m1.link_a"; fails for names that the robot lacks.
Result<model::LinkRef> FindLink(const model::Model& model, const model::Robot& robot,
                                const std::string& text) {
  const size_t dot = text.find('.');
  if (dot == std::string::npos) {
    return Fail(fmt::format("--jacobian {}: expected module.link, e.g. m1.link_a", text));
  }
  const Result<int> module = FindModule(robot, text.substr(0, dot));
  if (!module) return Fail(fmt::format("--jacobian {}: {}", text, module.error().message));
  const model::ModuleType& type = model.TypeOf(robot, *module);
  const std::string name = text.substr(dot + 1);
  if (const std::optional<int> link = type.FindLink(name)) return model::LinkRef{*module, *link};
  const std::vector<std::string> names = NamesOf(type.links);
  return Fail(fmt::format("--jacobian {}: module {} has no link '{}'{}; it has {}", text, type.name,
                          name, DidYouMean(name, names), fmt::join(names, ", ")));
}

/// The Jacobian of a link: a column by the name of each joint.
Json JacobianJson(const model::Model& model, const model::Robot& robot, const model::JointValues& q,
                  const model::LinkRef& link) {
  const auto jacobian = model::Jacobian(model, robot, q, link.module, link.link);
  Json::object_t columns;
  int column = 0;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    for (const model::Joint& joint : model.TypeOf(robot, static_cast<int>(m)).joints) {
      Json& values =
          columns.emplace_back(robot.modules[m].name + "." + joint.name, Json::array()).second;
      for (const double value : jacobian.col(column)) values.push_back(value == 0.0 ? 0.0 : value);
      ++column;
    }
  }
  return columns;
}

/// Sets the raw joint values of --set, computes all link poses and the Jacobian that was asked for,
/// prints them.
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
  Json jacobian;
  if (!options.jacobian.empty()) {
    const Result<model::LinkRef> link = FindLink(*model, *robot, options.jacobian);
    if (!link) return Unusable(link.error().message);
    jacobian = JacobianJson(*model, *robot, q, *link);
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
    Json json = {{"robot", robot->name},
                 {"links", links},
                 {"closure_m", state.closure_m},
                 {"closure_rad", state.closure_rad}};
    if (!jacobian.is_null()) json["jacobian"] = {{"link", options.jacobian}, {"joints", jacobian}};
    PrintJson(json);
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
  if (jacobian.is_null()) return kDone;
  Print(
      "\n{}: how fast its frame moves when one joint moves by 1 rad/s, or 1 m/s\n{:<24} {:>27}   "
      "{}\n",
      options.jacobian, "joint", "velocity (m/s)", "angular velocity (rad/s)");
  for (const auto& [name, column] : jacobian.items()) {
    const std::vector<double> values = Numbers(column);
    Print("{:<24} {:9.5f}   {:8.5f}\n", name, fmt::join(values.begin(), values.begin() + 3, ""),
          fmt::join(values.begin() + 3, values.end(), " "));
  }
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
  sub.Add("--jacobian", &options->jacobian, "Also how fast this link moves for each joint's rate")
      .TypeName("MODULE.LINK");
  sub.Json(&options->json);
  sub.Footer(
      "Example:\n  morphbus fk models/mtran.m3l --robot quadruped --set m1.joint_1=0.3 "
      "--set m1.joint_2=-45deg");
  sub.Do([options] { return Fk(*options); });
}

}  // namespace morphbus::tools
