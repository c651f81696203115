#include "vm/space/spatial.h"

#include <cmath>

#include "vm/space/neighbours.h"

namespace morphbus::vm {

namespace {

constexpr float kCos15 = 0.96592583f;
constexpr float kSamePlace = 1e-6f;  // m; closer than this there is no direction.

/// True for finite numbers and a quaternion of about unit length; messages may say anything.
bool IsPose(const PoseF& X) {
  const float norm = X.q.w * X.q.w + X.q.x * X.q.x + X.q.y * X.q.y + X.q.z * X.q.z;
  return IsFinite(Norm(X.p)) && std::fabs(norm - 1.0f) < 1e-2f;
}

/// Takes what a pose says of the root's clock: that it is `ahead` of ours. Poses that were late say
/// less, so that the most that any says is right; but modules count ticks alike, and those that say
/// more than ours came to a module that was late itself. What all poses contradict for a while is
/// given up for the nearest that they say.
void FollowClock(int64_t ahead, PoseState* pose) {
  if (ahead == pose->clock_ahead || (ahead > pose->clock_ahead && ahead <= 0)) {
    pose->clock_ahead = ahead;
    pose->clock_doubts = 0;
    return;
  }
  // Doubts count while they point the same way.
  const bool above = ahead > pose->clock_ahead;
  const bool same_way = (pose->clock_doubted > pose->clock_ahead) == above;
  if (pose->clock_doubts == 0 || !same_way) {
    pose->clock_doubts = 0;
    pose->clock_doubted = ahead;
  }
  // Of all doubts the one that is nearest to what was believed.
  if (above ? ahead < pose->clock_doubted : ahead > pose->clock_doubted) {
    pose->clock_doubted = ahead;
  }
  if (++pose->clock_doubts < kClockDoubts) return;
  pose->clock_ahead = pose->clock_doubted;
  pose->clock_doubts = 0;
}

/// Takes the pose that arrived on connector c.
void Accept(Context& context, int c, const NeighbourMessage& message, int neighbour_link) {
  PoseState& pose = context.state.pose;
  const NeighbourRecord& neighbour = context.state.neighbours[c];
  const bool same_root =
      pose.has && pose.root == message.root && pose.root_incarnation == message.root_incarnation;
  // Each hop took a tick, or more where a message was late. Another root has another clock.
  const int64_t ahead = message.root_sequence + message.hops + 1 - context.state.tick;
  if (!same_root) {
    pose.clock_ahead = ahead < 0 ? ahead : 0;
    pose.clock_doubts = 0;
  }
  FollowClock(ahead, &pose);
  pose.has = true;
  pose.root = message.root;
  pose.root_incarnation = message.root_incarnation;
  pose.sequence = message.root_sequence;
  pose.hops = static_cast<uint16_t>(message.hops + 1);
  pose.accepted_tick = context.state.tick;
  // The neighbour's link in R, times how our docked link lies in it, is our link in R; the others
  // follow by FollowJoints.
  pose.entry_link = context.kinematics.connector(c).link;
  pose.X_RE = Compose(message.X_RL[neighbour_link], Inverse(neighbour.X_LK));
}

/// Takes the best pose that a neighbour offers: the newest, then the one with the fewest hops, then
/// that on the lowest connector.
void PickPose(Context& context, const Inbox& inbox) {
  const NeighbourMessage* best = nullptr;
  int best_connector = 0, best_link = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const NeighbourMessage* message = inbox.from[c];
    // Only a connection that is in the image says where the neighbour's link lies.
    if (message == nullptr || !message->has_pose || !context.state.neighbours[c].known) continue;
    const DockedLink* docked = DockedHere(context, *message, context.state.neighbours[c]);
    if (docked == nullptr || docked->link >= message->num_links) continue;
    // What is not newer than the last may be our own news come back; what is from far ahead is
    // nonsense.
    if (message->root_sequence <= context.state.pose.sequence ||
        message->root_sequence > context.state.tick + kMaxTickAhead || message->hops == 0xffff ||
        !IsPose(message->X_RL[docked->link])) {
      continue;
    }
    // Connectors are looked at from the lowest up, so of equal poses the first stays.
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

/// The root knows its pose, by a sensor if it has one, and broadcasts it, anew in every tick.
void SetAsRoot(Context& context, const TickInput& input) {
  PoseState& pose = context.state.pose;
  // What was sensed last is nearer to the truth than where the root was when it began.
  const bool sensed =
      input.has_root_pose && input.root_link == context.config.root_link && IsPose(input.X_RL_root);
  if (sensed) {
    pose.X_RE = input.X_RL_root;
  } else if (!pose.has) {
    pose.X_RE = context.config.X_RL_root;
  }
  pose.has = true;
  pose.root = context.config.module_id;
  pose.root_incarnation = context.config.incarnation;
  // The sequence is the root's tick, by which poses are told apart by age everywhere.
  pose.sequence = context.state.tick;
  pose.hops = 0;
  pose.clock_ahead = 0;
  pose.clock_doubts = 0;
  pose.accepted_tick = context.state.tick;
  pose.entry_link = context.config.root_link;
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
  // The entry link's pose is known. The others follow from it through the joints, each as soon as
  // the link on the joint's other side has its pose.
  PoseState& pose = context.state.pose;
  uint32_t placed = 1u << pose.entry_link;
  for (int i = 0; i < kin.num_links(); ++i) pose.X_RL[i] = pose.X_RE;
  // Each pass places the links one joint further away.
  for (int pass = 1; pass < kin.num_links(); ++pass) {
    for (int j = 0; j < kin.num_joints(); ++j) {
      const KinJoint& joint = kin.joint(j);
      const bool has_a = (placed >> joint.link_a & 1u) != 0;
      const bool has_b = (placed >> joint.link_b & 1u) != 0;
      // Where neither link is placed yet, a later pass has its turn.
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

void UpdateSpatial(Context& context, const TickInput& input, const Inbox& inbox) {
  PoseState& pose = context.state.pose;
  if (context.config.is_root) {
    SetAsRoot(context, input);
  } else {
    PickPose(context, inbox);
  }
  if (!pose.has) return;
  // Without news of the root the pose ages; the fault is told once.
  const int64_t age = context.state.tick - pose.accepted_tick;
  const int64_t oldest = kPoseStaleTicks + context.config.grace_ticks;
  const bool stale = age > oldest;
  if (stale && !pose.stale) {
    Report(context, {.code = FaultCode::kStalePose,
                     .measured = static_cast<float>(age),
                     .limit = static_cast<float>(oldest)});
  }
  pose.stale = stale;
  FollowJoints(context, input);
}

bool RootTick(const VmState& state, int64_t tick, int64_t* root_tick) {
  // Between poses, and without newer ones, our own ticks count on.
  *root_tick = tick + state.pose.clock_ahead;
  return state.pose.has;
}

bool HasFreshPose(const Context& context) {
  return context.state.pose.has && !context.state.pose.stale;
}

bool MayBeCutOff(const Context& context) {
  const PoseState& pose = context.state.pose;
  return context.state.tick - pose.accepted_tick > kNewsLateTicks + context.config.grace_ticks;
}

Vec3 PlaceOf(const Context& context) {
  return MeanOrigin(context.state.pose.X_RL, context.kinematics.num_links());
}

bool LiesTowards(const Context& context, int connector, Direction d) {
  if (d == Direction::kAny) return true;
  const NeighbourRecord& neighbour = context.state.neighbours[connector];
  if (!context.state.pose.has || !neighbour.has_place) return false;
  // The neighbour's place moves with our docked link; both places are taken to R and compared.
  const PoseF& X_RL = context.state.pose.X_RL[context.kinematics.connector(connector).link];
  const Vec3 place_R = Add(X_RL.p, Rotate(X_RL.q, neighbour.place_L));
  const Vec3 displacement = Subtract(place_R, PlaceOf(context));
  const float distance = Norm(displacement);
  return distance > kSamePlace && LeadsTowards(Dot(displacement, UnitOf(d)), distance);
}

Vec3 JointDirection(const Context& context, int joint) {
  const KinJoint& j = context.kinematics.joint(joint);
  return Rotate(context.state.pose.X_RL[j.link_b].q, j.axis);
}

bool LiesAlong(const Context& context, int joint, Axis axis) {
  if (axis == Axis::kAny) return true;
  if (!context.state.pose.has) return false;
  // Within 15 deg of the axis, either way round: an axis has no sign.
  return std::fabs(Dot(JointDirection(context, joint), UnitOf(axis))) >= kCos15;
}

Vec3 SensorDirection(const Context& context, int sensor) {
  const KinSensor& s = context.kinematics.sensor(sensor);
  return Rotate(context.state.pose.X_RL[s.link].q, s.direction);
}

void FillPose(const Context& context, NeighbourMessage* message) {
  const PoseState& pose = context.state.pose;
  // A stale pose is handed on as such: better an old one than none.
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
