#include "tools/libraries/module_setup.h"

#include <set>

#include "bridge/description/run_model.h"
#include "compiler/base/version.h"
#include "compiler/emit/kinematics.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/pose_numbers.h"
#include "tools/libraries/model_content.h"
#include "tools/libraries/program_content.h"

namespace morphbus {
namespace {

std::vector<uint8_t> ToBytes(const std::string& text) { return {text.begin(), text.end()}; }

/// A pose in the VM's single precision, without negative zeros.
vm::PoseF ToVmPose(const model::Pose& X) {
  const model::PoseNumbers numbers = model::NumbersOf(X);
  // A sum with 0 is no negative zero.
  const auto plain = [](double v) { return static_cast<float>(v) + 0.0F; };
  const auto& [p, q] = numbers;
  return {{plain(p[0]), plain(p[1]), plain(p[2])},
          {plain(q[0]), plain(q[1]), plain(q[2]), plain(q[3])}};
}

}  // namespace

std::unique_ptr<bridge::ModuleImages> ImagesOf(const Robot& robot, const Program& program) {
  auto images = std::make_unique<bridge::ModuleImages>();
  if (Result<void> r = images->AddProgram("the program", ToBytes(program.content()->image)); !r) {
    throw Failure(r.error().message);
  }
  const model::Model& model = robot.content()->of_model->model;
  const uint64_t model_hash = ModelHashOf(robot);
  std::set<int> types;
  for (const model::ModuleInstance& module : robot.content()->robot.modules) {
    if (!types.insert(module.type).second) continue;
    const Result<std::string> image = emit::KinematicsImage(model, module.type, model_hash);
    if (!image) throw Failure(image.error().message);
    const std::string& type = model.module_types[module.type].name;
    if (Result<void> r = images->AddKinematics(type, ToBytes(*image)); !r) {
      throw Failure(r.error().message);
    }
  }
  return images;
}

uint64_t ModelHashOf(const Robot& robot) {
  return model::ModelHash(model::SerializeModel(robot.content()->of_model->model));
}

bridge::ModuleSpec SpecOf(const Robot& robot, int module) {
  const model::Robot& of = robot.content()->robot;
  bridge::ModuleSpec spec;
  spec.module = of.modules[module].name;
  spec.module_id = static_cast<uint16_t>(module);
  spec.build = Version();
  spec.kinematics = robot.content()->modules[module].type;
  if (module == of.root_module) {
    const int link = bridge::RootLinkOf(of, module).link;
    const model::KinematicState state =
        model::ForwardKinematics(robot.content()->of_model->model, of, model::StartValues(of));
    spec.root = {static_cast<uint8_t>(link), ToVmPose(state.X_RL[module][link])};
  }
  return spec;
}

}  // namespace morphbus
