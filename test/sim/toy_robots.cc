#include "test/sim/toy_robots.h"

#include <limits>

namespace morphbus::sim::test {
namespace {

using Eigen::Vector3d;

model::Link Cube(const std::string& name, const Vector3d& centre) {
  const Vector3d half = Vector3d::Constant(0.05);
  return {name, BoxCorners(centre - half, centre + half), {}, 1.0};
}

std::shared_ptr<const model::Model> Wrap(const model::ModuleType& type, const std::string& robot,
                                         const std::vector<double>& start) {
  auto model = std::make_shared<model::Model>();
  model->module_types.push_back(type);
  model::Robot& added = model->robots.emplace_back();
  added.name = robot;
  added.modules.push_back({"m1", 0, start});
  return model;
}

}  // namespace

std::vector<Vector3d> BoxCorners(const Vector3d& low, const Vector3d& high) {
  std::vector<Vector3d> corners;
  for (const double x : {low.x(), high.x()}) {
    for (const double y : {low.y(), high.y()}) {
      for (const double z : {low.z(), high.z()}) corners.emplace_back(x, y, z);
    }
  }
  return corners;
}

std::shared_ptr<const model::Model> MakeBox() {
  model::ModuleType type;
  type.name = "BOX";
  type.links.push_back(Cube("box", Vector3d::Zero()));
  return Wrap(type, "box", {});
}

std::shared_ptr<const model::Model> MakePair(model::JointType joint_type, double start) {
  model::ModuleType type;
  type.name = "PAIR";
  type.links.push_back(Cube("a", {-0.1, 0, 0}));
  type.links.push_back(Cube("b", {0.1, 0, 0}));
  const bool slides = joint_type == model::JointType::kPrismatic;
  model::Joint joint;
  joint.name = "joint";
  joint.type = joint_type;
  joint.link_a = 0;
  joint.link_b = 1;
  joint.p_MoJo_M = Vector3d::Zero();
  joint.axis = slides ? Vector3d::UnitX() : Vector3d::UnitZ();
  joint.upper = slides ? 0.05 : 1.0;
  if (joint_type == model::JointType::kContinuous) {
    joint.upper = std::numeric_limits<double>::infinity();
  }
  joint.lower = -joint.upper;
  joint.effort = slides ? 50.0 : 5.0;
  joint.speed = slides ? 0.2 : 2.0;
  type.joints.push_back(joint);
  return Wrap(type, "pair", {start});
}

morphbus::actuator_t PositionCommand(double target, double speed) {
  morphbus::actuator_t command = {};
  command.num_joints = 1;
  command.joints.resize(1);
  command.joints[0].mode = morphbus::joint_command_t::MODE_POSITION;
  command.joints[0].target_si = target;
  command.joints[0].speed_si = speed;
  return command;
}

}  // namespace morphbus::sim::test
