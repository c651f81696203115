#include "vm/spatial.h"

#include <cmath>

#include "vm/mates.h"

namespace morphbus::vm {

namespace {

constexpr float kSin15 = 0.25881905f;
constexpr float kCos15 = 0.96592583f;
constexpr float kSamePlace = 1e-6f;  // m; closer than this there is no direction.

bool IsPose(const PoseF& X) {
  const float norm = X.q.w * X.q.w + X.q.x * X.q.x + X.q.y * X.q.y + X.q.z * X.q.z;
  return std::isfinite(Norm(X.p)) && std::fabs(norm - 1.0f) < 1e-2f;
}

/// Takes the pose that arrived on connector c.
void Accept(Context& context, int c, const NeighbourMessage& message, int mate_link) {
  PoseState& pose = context.state.pose;
  const MateRecord& mate = context.state.mates[c];
  pose.has = true;
  pose.root = message.root;
  pose.root_incarnation = message.root_incarnation;
  pose.sequence = message.root_sequence;
  pose.hops = static_cast<uint16_t>(message.hops + 1);
  pose.accepted_tick = context.state.tick;
  pose.entry_link = context.kinematics.connector(c).link;
  pose.X_RE = Compose(message.X_RL[mate_link], Inverse(mate.X_LK));
}

void PickFromMail(Context& context, const Mail& mail) {
  const NeighbourMessage* best = nullptr;
  int best_connector = 0, best_link = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const NeighbourMessage* message = mail.from[c];
    if (message == nullptr || !message->has_pose || !context.state.mates[c].known) continue;
    const DockedLink* docked = DockedHere(context, *message, context.state.mates[c]);
    if (docked == nullptr || docked->link >= message->num_links) continue;
    if (message->root_sequence <= context.state.pose.sequence ||
        message->root_sequence > context.state.tick + kMaxTickAhead || message->hops == 0xffff ||
        !IsPose(message->X_RL[docked->link])) {
      continue;
    }
    const bool better =
        best == nullptr || message->root_sequence > best->root_sequence ||
        (message->root_sequence == best->root_sequence && message->hops < best->hops);
    if (!better) continue;
    best = message;
    best_connector = c;
    best_link = docked->link;
  }
  if (best != nullptr) Accept(context, best_connector, *best, best_link);
}

void SetAsRoot(Context& context) {
  PoseState& pose = context.state.pose;
  pose.has = true;
  pose.root = context.config.module_id;
  pose.root_incarnation = context.config.incarnation;
  pose.sequence = context.state.tick;
  pose.hops = 0;
  pose.accepted_tick = context.state.tick;
  pose.entry_link = context.config.root_link;
  pose.X_RE = context.config.X_RL_root;
}

/// X_BA of a joint's link A in its link B at joint value q (rad or m).
PoseF Motion(const KinJoint& joint, float q) {
  switch (joint.kind) {
    case JointKind::kRevolute:
    case JointKind::kContinuous:
      return RevoluteMotion(joint.origin_m, joint.axis, q);
    case JointKind::kPrismatic:
      return PrismaticMotion(joint.axis, q);
    case JointKind::kFixed:
      break;
  }
  return {};
}

void FollowJoints(Context& context, const TickInput& input) {
  const VerifiedKinematics& kin = context.kinematics;
  PoseState& pose = context.state.pose;
  uint32_t placed = 1u << pose.entry_link;
  for (int i = 0; i < kin.num_links(); ++i) pose.X_RL[i] = pose.X_RE;
  // Each pass places the links one joint further away.
  for (int pass = 1; pass < kin.num_links(); ++pass) {
    for (int j = 0; j < kin.num_joints(); ++j) {
      const KinJoint& joint = kin.joint(j);
      const bool has_a = (placed >> joint.link_a & 1u) != 0;
      const bool has_b = (placed >> joint.link_b & 1u) != 0;
      if (has_a == has_b) continue;
      const PoseF X_BA = Motion(joint, static_cast<float>(input.joint_position[j]));
      if (has_b) {
        pose.X_RL[joint.link_a] = Compose(pose.X_RL[joint.link_b], X_BA);
      } else {
        pose.X_RL[joint.link_b] = Compose(pose.X_RL[joint.link_a], Inverse(X_BA));
      }
      placed |= 1u << joint.link_a | 1u << joint.link_b;
    }
  }
}

}  // namespace

void UpdateSpatial(Context& context, const TickInput& input, const Mail& mail) {
  PoseState& pose = context.state.pose;
  if (context.config.is_root) {
    SetAsRoot(context);
  } else {
    PickFromMail(context, mail);
  }
  if (!pose.has) return;
  const bool stale =
      context.state.tick - pose.accepted_tick > kPoseStaleTicks + context.config.grace_ticks;
  if (stale && !pose.stale) Report(context, FaultCode::kStalePose);
  pose.stale = stale;
  FollowJoints(context, input);
}

bool HasFreshPose(const Context& context) {
  return context.state.pose.has && !context.state.pose.stale;
}

Vec3 UnitOf(Direction d) {
  switch (d) {
    case Direction::kNorth:
      return {1, 0, 0};
    case Direction::kSouth:
      return {-1, 0, 0};
    case Direction::kUp:
      return {0, 1, 0};
    case Direction::kDown:
      return {0, -1, 0};
    case Direction::kEast:
      return {0, 0, 1};
    case Direction::kWest:
      return {0, 0, -1};
    case Direction::kAny:
      break;
  }
  return {};
}

Vec3 UnitOf(Axis axis) {
  switch (axis) {
    case Axis::kNorthSouth:
      return UnitOf(Direction::kNorth);
    case Axis::kUpDown:
      return UnitOf(Direction::kUp);
    case Axis::kEastWest:
      return UnitOf(Direction::kEast);
    case Axis::kAny:
      break;
  }
  return {};
}

Vec3 PlaceOf(const Context& context) {
  const int n = context.kinematics.num_links();
  Vec3 sum;
  for (int i = 0; i < n; ++i) sum = Add(sum, context.state.pose.X_RL[i].p);
  const auto count = static_cast<float>(n);
  return {sum.x / count, sum.y / count, sum.z / count};
}

bool LiesTowards(const Context& context, int connector, Direction d) {
  if (d == Direction::kAny) return true;
  const MateRecord& mate = context.state.mates[connector];
  if (!context.state.pose.has || !mate.has_place) return false;
  const PoseF& X_RL = context.state.pose.X_RL[context.kinematics.connector(connector).link];
  const Vec3 place_R = Add(X_RL.p, Rotate(X_RL.q, mate.place_L));
  const Vec3 displacement = Subtract(place_R, PlaceOf(context));
  const float distance = Norm(displacement);
  return distance > kSamePlace && Dot(displacement, UnitOf(d)) >= kSin15 * distance;
}

Vec3 JointDirection(const Context& context, int joint) {
  const KinJoint& j = context.kinematics.joint(joint);
  return Rotate(context.state.pose.X_RL[j.link_b].q, j.axis);
}

bool LiesAlong(const Context& context, int joint, Axis axis) {
  if (axis == Axis::kAny) return true;
  if (!context.state.pose.has) return false;
  return std::fabs(Dot(JointDirection(context, joint), UnitOf(axis))) >= kCos15;
}

void FillPose(const Context& context, NeighbourMessage* message) {
  const PoseState& pose = context.state.pose;
  message->has_pose = pose.has;
  message->num_links = 0;
  if (!pose.has) return;
  message->pose_stale = pose.stale;
  message->root = pose.root;
  message->root_incarnation = pose.root_incarnation;
  message->root_sequence = pose.sequence;
  message->hops = pose.hops;
  message->num_links = static_cast<uint8_t>(context.kinematics.num_links());
  for (int i = 0; i < context.kinematics.num_links(); ++i) message->X_RL[i] = pose.X_RL[i];
}

}  // namespace morphbus::vm
