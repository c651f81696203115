#include "compiler/congruence/assembly.h"

#include <algorithm>
#include <cmath>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::congruence {

bool AssemblyJoint::bounded() const { return std::isfinite(lower) && std::isfinite(upper); }

Eigen::Vector3d Assembly::FootFrom(int body, int joint) const {
  const AssemblyJoint& j = joints[joint];
  const Eigen::Vector3d to_axis = j.p_RoJo - bodies[body].p_RoTo;
  return to_axis - to_axis.dot(j.axis) * j.axis;
}

std::string Assembly::JointName(int joint) const {
  const AssemblyJoint& j = joints[joint];
  return robot->modules[j.module].name + "." + model->TypeOf(*robot, j.module).joints[j.joint].name;
}

std::string Assembly::BodyName(int body) const {
  constexpr size_t kMaxNamed = 6;
  const std::vector<model::LinkRef>& links = bodies[body].links;
  std::string name;
  for (size_t i = 0; i < std::min(links.size(), kMaxNamed); ++i) {
    name += (i == 0 ? "" : " + ") + robot->modules[links[i].module].name + "." +
            model->TypeOf(*robot, links[i].module).links[links[i].link].name;
  }
  if (links.size() > kMaxNamed) {
    name += " and " + std::to_string(links.size() - kMaxNamed) + " more links";
  }
  return name;
}

std::vector<model::ScrewJoint> ScrewJointsOf(const Assembly& assembly) {
  std::vector<model::ScrewJoint> screws;
  for (const AssemblyJoint& j : assembly.joints) {
    screws.push_back({j.body_a, j.body_b, j.slide, j.axis, j.p_RoJo});
  }
  return screws;
}

namespace {

void MarkLocked(Assembly& assembly) {
  // Only loops lock joints; a tree has one joint fewer than bodies.
  if (assembly.joints.size() < assembly.bodies.size()) return;
  const model::LoopMobility loops =
      model::ComputeLoopMobility(static_cast<int>(assembly.bodies.size()), ScrewJointsOf(assembly));
  assembly.locked_computed = loops.computed;
  for (size_t j = 0; j < assembly.joints.size(); ++j) assembly.joints[j].locked = loops.locked[j];
}

}  // namespace

Assembly Flatten(const model::Model& model, const model::Robot& robot) {
  Assembly assembly;
  assembly.model = &model;
  assembly.robot = &robot;
  assembly.body_of = model::BodiesOf(model, robot);
  assembly.X_RL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.module_types[robot.modules[m].type];
    assembly.extent_m = std::max(assembly.extent_m, model::ExtentOf(type));
    for (size_t l = 0; l < type.links.size(); ++l) {
      const auto body = static_cast<size_t>(assembly.body_of[m][l]);
      if (body >= assembly.bodies.size()) assembly.bodies.resize(body + 1);
      assembly.bodies[body].links.push_back({static_cast<int>(m), static_cast<int>(l)});
    }
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& joint = type.joints[j];
      if (joint.type == model::JointType::kFixed) continue;
      const model::Pose& X_RB = assembly.X_RL[m][joint.link_b];
      AssemblyJoint& entry = assembly.joints.emplace_back();
      entry.module = static_cast<int>(m);
      entry.joint = static_cast<int>(j);
      entry.slide = joint.type == model::JointType::kPrismatic;
      entry.lower = joint.lower;
      entry.upper = joint.upper;
      entry.start = robot.modules[m].start[j];
      entry.body_a = assembly.body_of[m][joint.link_a];
      entry.body_b = assembly.body_of[m][joint.link_b];
      entry.p_RoJo = X_RB * joint.p_MoJo_M;
      entry.axis = X_RB.linear() * joint.axis;
      assembly.extent_m = std::max(assembly.extent_m, joint.p_MoJo_M.norm());
    }
  }
  if (assembly.extent_m <= 0.0) assembly.extent_m = 1.0;  // nothing has a size
  for (size_t j = 0; j < assembly.joints.size(); ++j) {
    const AssemblyJoint& joint = assembly.joints[j];
    assembly.bodies[joint.body_a].joints.push_back(static_cast<int>(j));
    if (joint.body_b != joint.body_a) {
      assembly.bodies[joint.body_b].joints.push_back(static_cast<int>(j));
    }
  }
  for (AssemblyBody& body : assembly.bodies) {
    body.p_RoTo.setZero();
    for (const model::LinkRef& ref : body.links) {
      body.p_RoTo += assembly.X_RL[ref.module][ref.link].translation();
    }
    body.p_RoTo /= static_cast<double>(body.links.size());
  }
  MarkLocked(assembly);
  return assembly;
}

}  // namespace morphbus::congruence
