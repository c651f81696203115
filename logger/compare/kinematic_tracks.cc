#include "logger/compare/kinematic_tracks.h"

#include <algorithm>
#include <cmath>
#include <morphbus/label_t.hpp>

namespace morphbus::logger {
namespace {

/// A row of SENSORS values of one joint (rad, m, per second, N m or N), times its sign; samples
/// that lack the joint are left out.
template <class Number>
ScalarTrack SensorTrack(const ModuleSeries& module, int joint, const JointSigns& signs,
                        std::vector<Number> SensorSample::*values) {
  ScalarTrack track;
  track.Reserve(module.sensors.size());
  for (const SensorSample& sample : module.sensors) {
    if (joint >= static_cast<int>((sample.*values).size())) continue;
    track.Add(sample.time_us,
              signs.At(sample.time_us) * static_cast<double>((sample.*values)[joint]));
  }
  return track;
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

std::optional<int64_t> FirstTaken(const std::vector<RoleSpan>& spans, const std::string& role) {
  for (const RoleSpan& span : spans) {
    if (span.role == role) return span.begin_us;
  }
  return std::nullopt;
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
  // The first convention also holds for the time before it: how the joint is built in does not
  // change.
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
  track.Reserve(module.actuators.size());
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
  track.Reserve(module.transforms.size());
  for (const TransformSample& sample : module.transforms) {
    // A module without a pose has none that could be stale.
    if (sample.has_pose) track.Add(sample.time_us, sample.pose_stale ? 1.0 : 0.0);
  }
  return track;
}

PoseTrack PropagatedTrack(const ModuleSeries& module, int link) {
  PoseTrack track;
  track.Reserve(module.transforms.size());
  for (const TransformSample& sample : module.transforms) {
    // The label may name a link that the type does not have, as in a damaged log.
    if (!sample.has_pose || link >= static_cast<int>(sample.X_RL.size())) continue;
    track.Add(sample.time_us, ToPose(sample.X_RL[link]));
  }
  return track;
}

Track<PoseDifference> Differences(const PoseTrack& a, const PoseTrack& b, const model::Pose& rest_a,
                                  const model::Pose& rest_b, int64_t end_us) {
  // P is the point of B's link that at rest lies where A's origin is, given in B's link frame.
  const Eigen::Vector3d p_BoP_B = rest_b.inverse() * rest_a.translation();
  Track<PoseDifference> out;
  out.Reserve(a.time_us.size());
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
  // A link without a shape lies where its frame is.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : link.hull) sum += point;
  return link.hull.empty() ? sum : Eigen::Vector3d(sum / static_cast<double>(link.hull.size()));
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

SimulatedPoses::Structure SimulatedPoses::BuildStructure(const WorldSample& sample) const {
  std::vector<std::pair<int, int>> bodies;
  for (const morphbus::body_pose_t& body : sample.bodies) {
    // Messages name modules by number, and the model by place.
    bodies.emplace_back(IndexById(model_index_of_id_, body.module_id), body.link);
  }
  return bridge::PlacesInBodies<model::Pose>(
      *log_.model, *log_.robot, DockingsAt(log_, model_index_of_id_, sample.time_us), bodies);
}

/// Pose of a link in the world; none if no body of the sample carries it.
std::optional<model::Pose> SimulatedPoses::X_WL(size_t sample, int module, int link) const {
  // Indices from messages and labels may be any number.
  const Structure& structure = structures_[structure_of_[sample]];
  if (!bridge::IsIndex(module, structure.size())) return std::nullopt;
  if (!bridge::IsIndex(link, structure[module].size())) return std::nullopt;
  const bridge::PlacedLink<model::Pose>& place = structure[module][link];
  if (place.body < 0) return std::nullopt;
  return ToPose(log_.world[sample].bodies[place.body]) * place.X_BL;
}

PoseTrack SimulatedPoses::TrackOf(int module, int link, const model::Pose& X_LF) const {
  PoseTrack track;
  track.Reserve(log_.world.size());
  for (size_t i = 0; available_ && i < log_.world.size(); ++i) {
    const std::optional<model::Pose> X_WLink = X_WL(i, module, link);
    if (X_WLink) track.Add(log_.world[i].time_us, X_R0W_ * *X_WLink * X_LF);
  }
  return track;
}

}  // namespace morphbus::logger
