#include "compiler/congruence/screw_graph.h"

#include <algorithm>
#include <cmath>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::congruence {

bool ScrewJoint::bounded() const { return std::isfinite(lower) && std::isfinite(upper); }

Eigen::Vector3d ScrewGraph::FootFrom(int body, int joint) const {
  // From the reference point to some point of the axis, less the part along it.
  const ScrewJoint& j = joints[joint];
  const Eigen::Vector3d to_axis = j.p_RoJo - bodies[body].p_RoTo;
  return to_axis - to_axis.dot(j.axis) * j.axis;
}

std::string ScrewGraph::JointName(int joint) const {
  const ScrewJoint& j = joints[joint];
  return robot->modules[j.module].name + "." + model->TypeOf(*robot, j.module).joints[j.joint].name;
}

std::string ScrewGraph::LinkName(const model::LinkRef& link) const {
  return robot->modules[link.module].name + "." +
         model->TypeOf(*robot, link.module).links[link.link].name;
}

std::string ScrewGraph::BodyName(int body) const {
  // The first few links are enough to find the body by.
  constexpr size_t kMaxNamed = 6;
  const std::vector<model::LinkRef>& links = bodies[body].links;
  std::string name;
  for (size_t i = 0; i < std::min(links.size(), kMaxNamed); ++i) {
    name += (i == 0 ? "" : " + ") + LinkName(links[i]);
  }
  if (links.size() > kMaxNamed) {
    name += " and " + std::to_string(links.size() - kMaxNamed) + " more links";
  }
  return name;
}

std::vector<model::ScrewJoint> ScrewJointsOf(const ScrewGraph& graph) {
  // Only the names of the fields differ.
  std::vector<model::ScrewJoint> screws;
  for (const ScrewJoint& j : graph.joints) {
    screws.push_back({j.body_a, j.body_b, j.slide, j.axis, j.p_RoJo});
  }
  return screws;
}

namespace {

/// Only loops lock joints, and a tree, which has none, has one joint fewer than bodies.
void MarkLocked(ScrewGraph& graph) {
  if (graph.joints.size() < graph.bodies.size()) return;
  const model::LoopMobility loops =
      model::ComputeLoopMobility(static_cast<int>(graph.bodies.size()), ScrewJointsOf(graph));
  graph.locked_computed = loops.computed;
  for (size_t j = 0; j < graph.joints.size(); ++j) graph.joints[j].locked = loops.locked[j];
}

/// Adds the joints of a module, but for fixed ones.
void AddJoints(const model::ModuleType& type, int module, ScrewGraph& graph) {
  for (size_t j = 0; j < type.joints.size(); ++j) {
    const model::Joint& joint = type.joints[j];
    if (joint.type == model::JointType::kFixed) continue;
    // The joint's axis is given in the frame of its link b, which is on the module's origin.
    const model::Pose& X_RB = graph.X_RL[module][joint.link_b];
    ScrewJoint& entry = graph.joints.emplace_back();
    entry.module = module;
    entry.joint = static_cast<int>(j);
    entry.slide = joint.type == model::JointType::kPrismatic;
    entry.lower = joint.lower;
    entry.upper = joint.upper;
    entry.start = graph.robot->modules[module].start[j];
    entry.body_a = graph.body_of[module][joint.link_a];
    entry.body_b = graph.body_of[module][joint.link_b];
    entry.p_RoJo = X_RB * joint.p_MoJo_M;
    entry.axis = X_RB.linear() * joint.axis;
    graph.extent_m = std::max(graph.extent_m, joint.p_MoJo_M.norm());
  }
}

}  // namespace

ScrewGraph BuildScrewGraph(const model::Model& model, const model::Robot& robot) {
  ScrewGraph graph;
  graph.model = &model;
  graph.robot = &robot;
  graph.body_of = model::BodiesOf(model, robot);
  graph.X_RL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;

  // Links make up bodies; the size of a module is that of its links or how far out its joints lie.
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const int module = static_cast<int>(m);
    const model::ModuleType& type = model.TypeOf(robot, module);
    graph.extent_m = std::max(graph.extent_m, model::ExtentOf(type));
    for (size_t l = 0; l < type.links.size(); ++l) {
      const auto body = static_cast<size_t>(graph.body_of[m][l]);
      if (body >= graph.bodies.size()) graph.bodies.resize(body + 1);
      graph.bodies[body].links.push_back({module, static_cast<int>(l)});
    }
    AddJoints(type, module, graph);
  }
  if (graph.extent_m <= 0.0) graph.extent_m = 1.0;  // nothing has a size

  // Bodies know their joints, and their reference points are the means of their links' origins.
  for (size_t j = 0; j < graph.joints.size(); ++j) {
    const ScrewJoint& joint = graph.joints[j];
    graph.bodies[joint.body_a].joints.push_back(static_cast<int>(j));
    if (joint.body_b == joint.body_a) continue;
    graph.bodies[joint.body_b].joints.push_back(static_cast<int>(j));
  }
  // All link origins are at their start values, as everything here.
  for (ScrewBody& body : graph.bodies) {
    body.p_RoTo.setZero();
    for (const model::LinkRef& ref : body.links) {
      body.p_RoTo += graph.X_RL[ref.module][ref.link].translation();
    }
    body.p_RoTo /= static_cast<double>(body.links.size());
  }
  MarkLocked(graph);
  return graph;
}

}  // namespace morphbus::congruence
