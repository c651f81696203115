#include <morphbus/model/robot.h>

#include <algorithm>
#include <utility>

#include "compiler/congruence/congruence.h"
#include "compiler/congruence/variants.h"
#include "compiler/model/jacobian.h"
#include "compiler/model/kinematic_graph.h"
#include "tools/libraries/model_content.h"

namespace morphbus {
namespace {

/// The place of the one that is so called. Throws Failure where there is none.
template <class Things>
int Find(const Things& things, std::string_view what, std::string_view name) {
  std::vector<std::string> names;
  for (const auto& thing : things) {
    if (thing.name == name) return static_cast<int>(&thing - things.data());
    names.push_back(thing.name);
  }
  ThrowUnknown(what, name, names);
}

std::array<double, 3> ToArray(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Robot::Robot(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

const std::string& Robot::name() const { return content_->robot.name; }
Model Robot::model() const { return Model(content_->of_model); }
const std::vector<Module>& Robot::modules() const { return content_->modules; }
const std::vector<Link>& Robot::links() const { return content_->links; }
const std::vector<Joint>& Robot::joints() const { return content_->joints; }
const std::vector<Connection>& Robot::connections() const { return content_->connections; }

int Robot::FindLink(std::string_view name) const { return Find(links(), "link", name); }
int Robot::FindJoint(std::string_view name) const { return Find(joints(), "joint", name); }

std::vector<double> Robot::StartValues() const {
  std::vector<double> values;
  for (const Joint& joint : joints()) values.push_back(joint.start);
  return values;
}

LinkPoses Robot::ForwardKinematics(std::span<const double> joint_values) const {
  // Inside, values and poses are kept module by module, and here in one row.
  const model::KinematicState state = model::ForwardKinematics(
      content_->of_model->model, content_->robot, content_->ByModule(joint_values));
  LinkPoses poses = {{}, state.closure_m, state.closure_rad};
  poses.X_RL.reserve(links().size());
  for (const auto& module : state.X_RL) {
    for (const model::Pose& X_RL : module) poses.X_RL.push_back(ToPublic(X_RL));
  }
  return poses;
}

Jacobian Robot::JacobianOf(int link, std::span<const double> joint_values) const {
  if (link < 0 || link >= static_cast<int>(links().size())) {
    throw Failure("there is no link number " + std::to_string(link) + " in robot " + name());
  }
  const int module = links()[link].module;
  const auto computed =
      model::Jacobian(content_->of_model->model, content_->robot, content_->ByModule(joint_values),
                      module, link - content_->first_link[module]);
  // It is told row by row, as an array of rows by columns lies in memory.
  Jacobian jacobian;
  jacobian.columns = joints().size();
  for (int row = 0; row < 6; ++row) {
    for (int j = 0; j < computed.cols(); ++j) jacobian.values.push_back(computed(row, j));
  }
  return jacobian;
}

KinematicGraph Robot::Graph() const {
  const model::KinematicGraph computed =
      model::BuildKinematicGraph(content_->of_model->model, content_->robot);
  // Parts are told by their places among all links and joints of the robot.
  KinematicGraph graph;
  for (const model::Body& body : computed.bodies) {
    std::vector<int>& of_body = graph.bodies.emplace_back();
    for (const model::LinkRef& ref : body.links) {
      of_body.push_back(content_->first_link[ref.module] + ref.link);
    }
  }
  for (const model::GraphJoint& joint : computed.joints) {
    KinematicGraph::Edge edge = {content_->first_joint[joint.module] + joint.joint,
                                 joint.body_a,
                                 joint.body_b,
                                 ToArray(joint.axis_R),
                                 ToArray(joint.p_RoJo_R),
                                 {}};
    if (computed.locked_computed) edge.locked = joint.locked;
    graph.joints.push_back(edge);
  }
  graph.mobility = computed.mobility;
  return graph;
}

uint64_t Robot::CongruenceHash() const {
  return congruence::CongruenceHash(content_->of_model->model, content_->robot);
}

Congruence Robot::CompareWith(const Robot& other) const {
  const congruence::Congruence computed =
      congruence::Compare(content_->of_model->model, content_->robot,
                          other.content_->of_model->model, other.content_->robot);
  Congruence answer;
  answer.decided = computed.decided;
  answer.congruent = computed.congruent();
  answer.ways = computed.count;
  answer.complete = computed.count_complete;
  answer.reason = computed.reason;
  if (!computed.congruent()) return answer;
  // Of several ways the first is told, which keeps the robot frame if any does.
  const congruence::Mapping& way = computed.mappings.front();
  answer.keeps_frame = way.keeps_frame;
  answer.modules = way.module_to;
  const auto place = [](const Robot& robot, const congruence::JointRef& ref) {
    return robot.content_->first_joint[ref.module] + ref.joint;
  };
  for (size_t j = 0; j < way.joints.size(); ++j) {
    const congruence::JointImage& image = way.joints[j];
    answer.joints.push_back({place(*this, computed.joints_a[j]),
                             place(other, computed.joints_b[image.to]), image.sign > 0 ? 1 : -1,
                             image.offset});
  }
  answer.masses_equal = computed.masses.masses_equal;
  answer.hulls_equal = computed.masses.hulls_equal;
  return answer;
}

std::vector<Robot> Robot::Variants(size_t most, std::optional<uint64_t> seed) const {
  std::vector<Robot> robots;
  // Each belongs to the same model, whose types of modules it is made of.
  for (congruence::Variant& variant :
       congruence::Variants(content_->of_model->model, content_->robot, {most, seed})) {
    robots.emplace_back(std::make_shared<Content>(content_->of_model, std::move(variant.robot)));
  }
  return robots;
}

}  // namespace morphbus
