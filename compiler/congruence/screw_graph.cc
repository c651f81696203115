#include "compiler/congruence/screw_graph.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

ScrewGraph BuildScrewGraph(const model::Model& model, const model::Robot& robot) {
  model::KinematicGraph kinematic = model::BuildKinematicGraph(model, robot);
  // Bodies and joints are those of the kinematic graph; names are looked up when they are asked
  // for.
  ScrewGraph graph;
  graph.model = &model;
  graph.robot = &robot;
  graph.body_of = std::move(kinematic.body_of);
  graph.locked_computed = kinematic.locked_computed;
  graph.X_RL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;

  // The reference points of bodies are the means of their links' origins, at the start values as
  // everything here.
  for (model::Body& body : kinematic.bodies) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const model::LinkRef& ref : body.links) {
      sum += graph.X_RL[ref.module][ref.link].translation();
    }
    const auto links = static_cast<double>(body.links.size());
    graph.bodies.push_back({std::move(body.links), sum / links, {}});
  }

  // The size of a module is that of its links or how far out its joints lie.
  for (const model::ModuleInstance& module : robot.modules) {
    graph.extent_m = std::max(graph.extent_m, model::ExtentOf(model.module_types[module.type]));
  }
  // Joints come in order of module, then joint, and their bodies learn of them.
  for (const model::GraphJoint& j : kinematic.joints) {
    const model::Joint& joint = model.TypeOf(robot, j.module).joints[j.joint];
    const bool slide = joint.type == model::JointType::kPrismatic;
    const double start = robot.modules[j.module].start[j.joint];
    // A joint within one body is that body's once.
    const auto index = static_cast<int>(graph.joints.size());
    graph.joints.push_back({j.module, j.joint, slide, joint.lower, joint.upper, start, j.locked,
                            j.body_a, j.body_b, j.p_RoJo_R, j.axis_R});
    graph.extent_m = std::max(graph.extent_m, joint.p_MoJo_M.norm());
    graph.bodies[j.body_a].joints.push_back(index);
    if (j.body_b != j.body_a) graph.bodies[j.body_b].joints.push_back(index);
  }
  if (graph.extent_m <= 0.0) graph.extent_m = 1.0;  // nothing has a size
  return graph;
}

}  // namespace morphbus::congruence
