#include "tools/plan/plan_modules.h"

#include "logger/compare/kinematic_tracks.h"
#include "tools/base/program.h"

namespace morphbus::tools {
namespace {

/// The bytes of an image, which the description holds as a string.
std::vector<uint8_t> ToBytes(const std::string& text) { return {text.begin(), text.end()}; }

/// What morphbus-module is told on its command line, for the module of this number.
bridge::ModuleSpec SpecOf(const RunPlan& plan, int module) {
  const model::Robot& robot = plan.robot();
  bridge::ModuleSpec spec;
  spec.run = plan.description.run();
  spec.module = robot.modules[module].name;
  spec.module_id = static_cast<uint16_t>(module);
  // Images of kinematics are known by the names of their module types.
  spec.kinematics = plan.model.TypeOf(robot, module).name;
  spec.build = plan.description.build();
  spec.random_seed = plan.description.random_seed();
  spec.realtime = plan.description.mode() == "realtime";
  // One module broadcasts where it is; all others find their places from it.
  if (spec.module == plan.description.root_module()) {
    const RootPose root = RootPoseOf(plan, module);
    spec.root = {static_cast<uint8_t>(root.link), logger::ToVmPose(root.X_RL)};
  }
  return spec;
}

}  // namespace

Result<std::unique_ptr<PlanModules>> BuildModules(const RunPlan& plan) {
  auto modules = std::make_unique<PlanModules>();
  bridge::ModuleImages& images = modules->images;
  const proto::RunDescription& description = plan.description;
  // All modules of the process share the verified images.
  if (Result<void> r = images.AddProgram("the program", ToBytes(description.program_image())); !r) {
    return Fail(r.error().message);
  }
  // Both are verified as they are added; a damaged one ends this.
  for (const proto::KinematicsImage& type : description.kinematics()) {
    if (Result<void> r = images.AddKinematics(type.type_name(), ToBytes(type.image())); !r) {
      return Fail(r.error().message);
    }
  }
  // Ids are indices into the robot's modules, as in the simulator.
  const auto names = std::make_shared<bridge::NameDirectory>();
  for (size_t m = 0; m < plan.robot().modules.size(); ++m) {
    bridge::ModuleSpec spec = SpecOf(plan, static_cast<int>(m));
    spec.names = names;
    auto instance = bridge::ModuleInstance::Create(images, std::move(spec));
    if (!instance) return Fail(instance.error().message);
    modules->instances.push_back(std::move(*instance));
  }
  return modules;
}

}  // namespace morphbus::tools
