#include "logger/compare/kinematic_tracks.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <morphbus/label_t.hpp>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::logger {
namespace {

/// A row of SENSORS values of one joint (rad, m, per second, N m or N), times its sign; samples
/// that lack the joint are left out.
template <class Number>
ScalarTrack SensorTrack(const ModuleSeries& module, int joint, const JointSigns& signs,
                        std::vector<Number> SensorSample::*values) {
  ScalarTrack track;
  for (const SensorSample& sample : module.sensors) {
    if (joint >= static_cast<int>((sample.*values).size())) continue;
    track.Add(sample.time_us,
              signs.At(sample.time_us) * static_cast<double>((sample.*values)[joint]));
  }
  return track;
}

/// A link that is rigid with another one, and where it is in that one's frame.
struct RigidEdge {
  int module = 0;
  int link = 0;
  model::Pose X_FromTo;
};
using RigidEdges = std::vector<std::vector<std::vector<RigidEdge>>>;  ///< By module, link.

/// The module's index in the model by its id in SENSORS; -1 if unknown.
int ModelIndexOf(const std::map<int, int>& model_index_of_id, int id) {
  const auto found = model_index_of_id.find(id);
  return found == model_index_of_id.end() ? -1 : found->second;
}

/// Enters that two links are rigid with each other; X_AB is the pose of the second in the first.
void Join(int a, int link_a, int b, int link_b, const model::Pose& X_AB, RigidEdges* edges) {
  (*edges)[a][link_a].push_back({b, link_b, X_AB});
  (*edges)[b][link_b].push_back({a, link_a, X_AB.inverse()});
}

/// Enters the dockings that the robot declares.
void JoinDeclared(const RunLog& log, RigidEdges* edges) {
  for (const model::Docking& d : log.robot->dockings) {
    const model::ModuleType& type_a = log.model->TypeOf(*log.robot, d.module_a);
    const model::ModuleType& type_b = log.model->TypeOf(*log.robot, d.module_b);
    Join(d.module_a, type_a.connectors[d.connector_a].link, d.module_b,
         type_b.connectors[d.connector_b].link,
         log.model->connection_types[d.connection_type].options[d.option].X_AB, edges);
  }
}

/// Links held together by fixed joints and by the dockings sensed at `time_us`; as the robot
/// declares them if nothing was sensed. All link frames of a module coincide with M at joint values
/// 0, and a docking's X_AB is given for those, so X_AB is also the pose of the one link in the
/// other.
RigidEdges EdgesAt(const RunLog& log, const std::map<int, int>& model_index_of_id,
                   int64_t time_us) {
  const int num_modules = static_cast<int>(log.robot->modules.size());
  RigidEdges edges(num_modules);
  for (int m = 0; m < num_modules; ++m) {
    const model::ModuleType& type = log.model->TypeOf(*log.robot, m);
    edges[m].resize(type.links.size());
    for (const model::Joint& joint : type.joints) {
      if (joint.type != model::JointType::kFixed) continue;
      Join(m, joint.link_b, m, joint.link_a, model::JointMotion(joint, 0.0), &edges);
    }
  }
  // What the sensors showed at that time, or, without sensors, what the robot declares.
  // A module's sample at that time or, if that is missing, its next one counts.
  bool sensed = false;
  const auto earlier = [](const SensorSample& s, int64_t time) { return s.time_us < time; };
  for (const ModuleSeries& module : log.modules) {
    const auto at =
        std::lower_bound(module.sensors.begin(), module.sensors.end(), time_us, earlier);
    if (module.model_index < 0 || at == module.sensors.end()) continue;
    sensed = true;
    for (const morphbus::docked_connector_t& docked : at->docked) {
      const int m = module.model_index;
      const int mate = ModelIndexOf(model_index_of_id, docked.mate_module);
      const std::optional<model::Pose> X_OwnMate = DockedPose(log, m, mate, docked);
      if (!X_OwnMate) continue;
      Join(m, log.model->TypeOf(*log.robot, m).connectors[docked.connector].link, mate,
           log.model->TypeOf(*log.robot, mate).connectors[docked.mate_connector].link, *X_OwnMate,
           &edges);
    }
  }
  if (!sensed) JoinDeclared(log, &edges);
  return edges;
}

/// Angle of the rotation from b to a in radians, 0…π. The arc tangent keeps small angles exact,
/// where the arc cosine of w would lose half of the digits; |w| because q and -q are one rotation.
double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a * b.conjugate();
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

}  // namespace

vm::PoseF ToVmPose(const model::Pose& X) {
  // As in PoseJson, w >= 0 makes the sign of the quaternion unique.
  Eigen::Quaterniond q(X.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const Eigen::Vector3d& p = X.translation();
  // No negative zeros: the same pose must be the same bytes, however it was come by.
  const auto plain = [](double v) {
    return static_cast<float>(v) == 0.0F ? 0.0F : static_cast<float>(v);
  };
  // The VM orders a quaternion w x y z, as the wire does.
  vm::PoseF out;
  out.p = {plain(p.x()), plain(p.y()), plain(p.z())};
  out.q = {plain(q.w()), plain(q.x()), plain(q.y()), plain(q.z())};
  return out;
}

std::vector<RoleSpan> RoleSpans(const ModuleSeries& module, int64_t end_us) {
  std::vector<RoleSpan> spans;
  for (const StatusSample& sample : module.status) {
    if (sample.time_us > end_us) break;
    // A span lasts as long as role and labels stay the same.
    RoleSpan span;
    span.begin_us = sample.time_us;
    span.end_us = end_us;
    span.role = sample.status.role_name;
    for (const morphbus::label_t& label : sample.status.labels) {
      const bool is_joint = label.kind == morphbus::label_t::KIND_JOINT;
      (is_joint ? span.joints : span.links)[label.name] = label.index;
    }
    // A report that changes nothing continues the span; another one ends it at its own time.
    if (!spans.empty()) {
      RoleSpan& last = spans.back();
      if (last.role == span.role && last.joints == span.joints && last.links == span.links)
        continue;
      last.end_us = span.begin_us;
      if (last.begin_us == last.end_us) spans.pop_back();
    }
    spans.push_back(std::move(span));
  }
  return spans;
}

JointSigns::JointSigns(const ModuleSeries& module, int joint) {
  for (const StatusSample& sample : module.status) {
    const auto& signs = sample.status.joint_sign;
    if (joint < 0 || joint >= static_cast<int>(signs.size())) continue;
    const int sign = signs[joint];
    // 0 says that there is no convention yet; only a change of the sign is entered.
    if (sign == 0 || (!signs_.empty() && signs_.back().second == sign)) continue;
    signs_.emplace_back(sample.time_us, sign);
  }
}

int JointSigns::At(int64_t time_us) const {
  if (signs_.empty()) return 0;
  int sign = signs_.front().second;
  for (const auto& [since, value] : signs_) {
    if (since > time_us) break;
    sign = value;
  }
  return sign;
}

ScalarTrack AngleTrack(const ModuleSeries& module, int joint, const JointSigns& signs) {
  return SensorTrack(module, joint, signs, &SensorSample::position);
}

ScalarTrack VelocityTrack(const ModuleSeries& module, int joint, const JointSigns& signs) {
  return SensorTrack(module, joint, signs, &SensorSample::velocity);
}

ScalarTrack EffortTrack(const ModuleSeries& module, int joint, const JointSigns& signs) {
  return SensorTrack(module, joint, signs, &SensorSample::effort);
}

Track<JointCommand> CommandsOf(const ModuleSeries& module, int joint, const JointSigns& signs) {
  using morphbus::joint_command_t;
  Track<JointCommand> track;
  for (const ActuatorSample& sample : module.actuators) {
    if (joint >= static_cast<int>(sample.joints.size())) continue;
    const joint_command_t& command = sample.joints[joint];
    // What the value means depends on the mode: a target, a velocity, or nothing for hold.
    const bool has_target = command.mode == joint_command_t::MODE_POSITION;
    const double value = has_target                                       ? command.target_si
                         : command.mode == joint_command_t::MODE_VELOCITY ? command.speed_si
                                                                          : 0.0;
    // The speed of a position command is a limit: it holds in both directions.
    track.Add(sample.time_us, {command.mode, signs.At(sample.time_us) * value,
                               has_target ? command.speed_si : 0.0});
  }
  return track;
}

ScalarTrack StalenessTrack(const ModuleSeries& module) {
  ScalarTrack track;
  for (const TransformSample& sample : module.transforms) {
    if (sample.has_pose) track.Add(sample.time_us, sample.pose_stale ? 1.0 : 0.0);
  }
  return track;
}

PoseTrack PropagatedTrack(const ModuleSeries& module, int link) {
  PoseTrack track;
  for (const TransformSample& sample : module.transforms) {
    if (!sample.has_pose || link >= static_cast<int>(sample.X_RL.size())) continue;
    track.Add(sample.time_us, ToPose(sample.X_RL[link]));
  }
  return track;
}

RestPoses RestPosesOf(const RunLog& log) {
  return model::ForwardKinematics(*log.model, *log.robot, model::StartValues(*log.robot)).X_RL;
}

Track<PoseDifference> Differences(const PoseTrack& a, const PoseTrack& b, const model::Pose& rest_a,
                                  const model::Pose& rest_b, int64_t end_us) {
  // P is the point of B's link that at rest lies where A's origin is, given in B's link frame.
  const Eigen::Vector3d p_BoP_B = rest_b.inverse() * rest_a.translation();
  Track<PoseDifference> out;
  ForCommonTimes(a.time_us, b.time_us, end_us, [&](size_t i, size_t j) {
    const model::Pose& X_A = a.value[i];
    const model::Pose& X_B = b.value[j];
    // Turns since rest, R(t)·R(rest)ᵀ, do not depend on how a frame is fixed in its link.
    const Eigen::Quaterniond turn_A(Eigen::Matrix3d(X_A.linear() * rest_a.linear().transpose()));
    const Eigen::Quaterniond turn_B(Eigen::Matrix3d(X_B.linear() * rest_b.linear().transpose()));
    out.Add(a.time_us[i],
            {(X_A.translation() - X_B * p_BoP_B).norm(), AngleBetween(turn_A, turn_B)});
  });
  return out;
}

Eigen::Vector3d LinkCentre(const model::Link& link) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : link.hull) sum += point;
  return link.hull.empty() ? sum : Eigen::Vector3d(sum / static_cast<double>(link.hull.size()));
}

std::map<int, int> ModelIndices(const RunLog& log) {
  std::map<int, int> indices;
  for (const ModuleSeries& module : log.modules) {
    if (module.id >= 0 && module.model_index >= 0) indices[module.id] = module.model_index;
  }
  return indices;
}

std::optional<model::Pose> DockedPose(const RunLog& log, int module, int mate,
                                      const morphbus::docked_connector_t& docked) {
  // A damaged entry may name a mate or a connection that the model does not have.
  const auto& types = log.model->connection_types;
  const int type = docked.connection_type;
  if (mate < 0 || type < 0 || type >= static_cast<int>(types.size())) return std::nullopt;
  const model::ConnectionType& connection = types[type];
  if (docked.number < 1 || docked.number > static_cast<int>(connection.options.size())) {
    return std::nullopt;
  }
  const model::ConnectionOption& option = connection.options[docked.number - 1];
  // The option must be one of these two connectors, with this module as member a or b.
  const auto fits = [&](int a, int connector_a, int b, int connector_b) {
    return log.robot->modules[a].type == connection.type_a &&
           log.robot->modules[b].type == connection.type_b && option.connector_a == connector_a &&
           option.connector_b == connector_b;
  };
  if (fits(module, docked.connector, mate, docked.mate_connector)) return option.X_AB;
  // Between unlike module types only one is the connection's member a; the other holds the inverse.
  if (!fits(mate, docked.mate_connector, module, docked.connector)) return std::nullopt;
  return option.X_AB.inverse();
}

SimulatedPoses::SimulatedPoses(const RunLog& log, const SimulatedPoses* before)
    : log_(log), model_index_of_id_(ModelIndices(log)) {
  // What the stretch before knew goes on: its last structure, and where the robot began.
  if (before != nullptr) {
    if (!before->structures_.empty()) structures_.push_back(before->structures_.back());
    last_bodies_ = before->last_bodies_;
    X_R0W_ = before->X_R0W_;
    available_ = before->available_;
  }
  // Bodies fall apart and join only where the set of bodies changes: then the structure is new.
  for (const WorldSample& sample : log.world) {
    BodyKey bodies;
    for (const auto& body : sample.bodies) bodies.emplace_back(body.module_id, body.link);
    if (structures_.empty() || bodies != last_bodies_) {
      structures_.push_back(BuildStructure(sample));
      last_bodies_ = std::move(bodies);
    }
    structure_of_.push_back(static_cast<int>(structures_.size()) - 1);
  }
  // Poses are told from where the robot frame was at the first tick: X_R0W = (X_WL · X_LR)⁻¹.
  if (before != nullptr || log.world.empty() || log.ticks_us.empty() ||
      log.world.front().time_us != log.ticks_us.front()) {
    return;
  }
  const std::optional<model::Pose> X_WRoot = X_WL(0, log.robot->root_module, log.robot->root_link);
  if (!X_WRoot) return;
  X_R0W_ = (*X_WRoot * log.robot->X_LR).inverse();
  available_ = true;
}

/// Adds the links of a body, breadth first from the link that stands for it.
SimulatedPoses::Structure SimulatedPoses::BuildStructure(const WorldSample& sample) const {
  // Links that fixed joints and dockings hold together move as one body.
  const RigidEdges edges = EdgesAt(log_, model_index_of_id_, sample.time_us);
  Structure structure(edges.size());
  for (size_t m = 0; m < edges.size(); ++m) structure[m].resize(edges[m].size());
  // Each body is known by one link; from it all links are reached that are rigid with it.
  for (size_t body = 0; body < sample.bodies.size(); ++body) {
    const int module = ModelIndexOf(model_index_of_id_, sample.bodies[body].module_id);
    const int link = sample.bodies[body].link;
    if (module < 0 || link < 0 || link >= static_cast<int>(structure[module].size())) continue;
    // A link that another body already carries is not claimed twice.
    if (structure[module][link].body >= 0) continue;
    structure[module][link].body = static_cast<int>(body);
    std::deque<std::pair<int, int>> queue = {{module, link}};
    while (!queue.empty()) {
      const auto [m, l] = queue.front();
      queue.pop_front();
      for (const RigidEdge& edge : edges[m][l]) {
        Place& place = structure[edge.module][edge.link];
        if (place.body >= 0) continue;
        place = {static_cast<int>(body), structure[m][l].X_BL * edge.X_FromTo};
        queue.emplace_back(edge.module, edge.link);
      }
    }
  }
  return structure;
}

/// Pose of a link in the world; none if no body of the sample carries it.
std::optional<model::Pose> SimulatedPoses::X_WL(size_t sample, int module, int link) const {
  // Indices from messages and labels may be any number.
  const Structure& structure = structures_[structure_of_[sample]];
  if (module < 0 || module >= static_cast<int>(structure.size())) return std::nullopt;
  const auto& links = structure[module];
  if (link < 0 || link >= static_cast<int>(links.size())) return std::nullopt;
  const Place& place = links[link];
  if (place.body < 0) return std::nullopt;
  return ToPose(log_.world[sample].bodies[place.body]) * place.X_BL;
}

PoseTrack SimulatedPoses::TrackOf(int module, int link, const model::Pose& X_LF) const {
  PoseTrack track;
  for (size_t i = 0; available_ && i < log_.world.size(); ++i) {
    const std::optional<model::Pose> X_WLink = X_WL(i, module, link);
    if (X_WLink) track.Add(log_.world[i].time_us, X_R0W_ * *X_WLink * X_LF);
  }
  return track;
}

}  // namespace morphbus::logger
