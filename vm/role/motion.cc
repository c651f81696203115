#include "vm/role/motion.h"

#include <cmath>

#include "vm/run/mathematics.h"
#include "vm/run/task_queue.h"
#include "vm/space/spatial.h"

namespace morphbus::vm {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kArrivedDegrees = 2.0;
constexpr double kArrivedMillimetres = 1.0;
constexpr double kClampTolerance = 0.01;  // Degrees, millimetres.
constexpr double kStallFraction = 0.1;    // Of the speed asked of a joint that turns endlessly.
constexpr float kUnlimited = 1e30f;       // rad or m; images carry the largest float.

bool IsPrismatic(const KinJoint& joint) { return joint.kind == JointKind::kPrismatic; }

/// The same angle from -180 to 180 degrees. Exact: whole turns and an angle that is nearer to them
/// than half a turn differ by less than either. What no sensor can say is no angle.
double WithinATurn(double degrees) {
  if (!(std::fabs(degrees) < 1e11)) return 0;
  const auto turns = static_cast<int32_t>(degrees / 360.0 + (degrees < 0 ? -0.5 : 0.5));
  return degrees - 360.0 * turns;
}

/// How far the joint is from its target.
double ErrorOf(const KinJoint& joint, const JointState& state) {
  const double error = state.measured - state.target;
  // The angle of an endless joint may be told in any turn.
  if (joint.kind == JointKind::kContinuous) return std::fabs(WithinATurn(error));
  return std::fabs(error);
}

double ToleranceOf(const KinJoint& joint) {
  return IsPrismatic(joint) ? kArrivedMillimetres : kArrivedDegrees;
}

/// Moves the set-point towards the target at the joint's speed, as the servo does with its own.
void FollowTarget(const KinJoint& joint, int64_t dt_us, JointState* state) {
  // The joint's speed is per second, the tick is shorter.
  const double step = static_cast<double>(joint.speed_rad_s) * UnitsPerSi(joint) *
                      static_cast<double>(dt_us) * 1e-6;
  const double way = state->target - state->set_point;
  if (std::fabs(way) <= step) {
    state->set_point = state->target;
  } else {
    state->set_point += way > 0 ? step : -step;
  }
}

/// True if the set-point has reached the target.
bool SetPointIsThere(const JointState& state) {
  return std::fabs(state.set_point - state.target) <= 0;
}

/// Notes that the joint is late in this tick. Once it has been for kStallUs, the stall is raised as
/// an event and reported with these numbers, which are in the actuator's own sign but for the
/// limit. Its place is that of the call that waits for the joint, else of the call that set it in
/// motion.
void NoteLate(Context& context, int j, int64_t late_since_us, FaultCode code, double asked,
              double measured, double limit) {
  JointState& state = context.state.joints[j];
  if (state.late_since_us < 0) state.late_since_us = late_since_us;
  if (state.stalled || context.state.sim_time_us - state.late_since_us < kStallUs) return;
  state.stalled = true;
  Fault fault{.code = code,
              .joint = static_cast<int8_t>(j),
              .asked = static_cast<float>(state.asked_sign * asked),
              .measured = static_cast<float>(state.asked_sign * measured),
              .limit = static_cast<float>(limit)};
  if (state.function >= 0) SetPlace(context.program, state.function, state.pc, &fault);
  // A task that waits for the joint is where a person looks first.
  for (const Task& task : context.state.scheduler.tasks) {
    if (!task.used || task.wait != WaitKind::kMotion || task.wait_joint != j) continue;
    SetPlace(context.program, task.function, task.pc, &fault);
    break;
  }
  RaiseEvent(context, Event::kStall, j);
  Report(context, fault);
}

/// The joint is where it should be, or is to go elsewhere: it is not late.
void ForgetLateness(JointState* state) {
  state->late_since_us = -1;
  state->turned_late = 0;
  state->stalled = false;
}

/// A joint on its way to a target arrives, or stalls where its set-point is there and it is not.
void CheckArrival(Context& context, int j) {
  const KinJoint& joint = context.kinematics.joint(j);
  JointState& state = context.state.joints[j];
  const bool there = SetPointIsThere(state);
  const bool close = ErrorOf(joint, state) <= ToleranceOf(joint);
  state.arrived = there && close;
  if (!there || close) return ForgetLateness(&state);
  NoteLate(context, j, context.state.sim_time_us, FaultCode::kStalled, state.target, state.measured,
           ToleranceOf(joint));
}

/// A joint that turns endlessly stalls where its mean speed stays below a tenth of what was asked.
/// `turned` is by how much it has turned since the last tick, `dt_us` ago.
void CheckTurning(Context& context, int j, double turned, int64_t dt_us) {
  JointState& state = context.state.joints[j];
  state.arrived = true;
  if (dt_us <= 0) return;
  const int64_t now = context.state.sim_time_us;
  const int64_t since = state.late_since_us < 0 ? now - dt_us : state.late_since_us;
  state.turned_late += state.velocity < 0 ? -turned : turned;
  const double seconds = static_cast<double>(now - since) * 1e-6;
  const bool fast = state.turned_late >= kStallFraction * std::fabs(state.velocity) * seconds;
  // A stalled joint is watched over whole half seconds, so that one that trembles on the spot does
  // not stall anew with every jerk.
  const bool window_ends = now - since >= kStallUs;
  if (fast && (!state.stalled || window_ends)) return ForgetLateness(&state);
  if (state.stalled && window_ends) {
    state.late_since_us = now;
    state.turned_late = 0;
    return;
  }
  const double right_way = state.velocity < 0 ? -1.0 : 1.0;
  NoteLate(context, j, since, FaultCode::kTurnStalled, state.velocity,
           right_way * state.turned_late / seconds, kStallFraction * std::fabs(state.velocity));
}

}  // namespace

double UnitsPerSi(const KinJoint& joint) { return IsPrismatic(joint) ? 1000.0 : 180.0 / kPi; }

void UpdateJoints(Context& context, const TickInput& input, int64_t dt_us) {
  for (int j = 0; j < context.kinematics.num_joints(); ++j) {
    const KinJoint& joint = context.kinematics.joint(j);
    JointState& state = context.state.joints[j];
    const double measured = input.joint_position[j] * UnitsPerSi(joint);
    // The angle of an endless joint may jump by whole turns.
    const double turned = WithinATurn(measured - state.measured);
    state.measured = measured;
    state.effort = input.joint_effort[j];
    // On the first tick, and while the joint turns endlessly, its target is where it is.
    if (!context.state.started || state.turning) {
      state.target = state.set_point = state.measured;
    }
    FollowTarget(joint, dt_us, &state);
    if (joint.kind == JointKind::kFixed) continue;
    if (state.turning) {
      CheckTurning(context, j, turned, dt_us);
    } else {
      CheckArrival(context, j);
    }
  }
}

void ForgetCalls(Context& context) {
  for (int j = 0; j < context.kinematics.num_joints(); ++j) {
    JointState& state = context.state.joints[j];
    state.turning = false;
    state.velocity = 0;
    // The call that moved it belongs to a role, or a program, that is gone.
    state.function = -1;
    state.pc = 0;
  }
}

void DropConventions(Context& context) {
  ForgetCalls(context);
  for (JointState& state : context.state.joints) state.sign = 0;
}

void SetConvention(Context& context, int joint, int link, Axis axis, Fault* fault) {
  // The fault has joint and link from the beginning, for both ways to fail.
  const KinJoint& j = context.kinematics.joint(joint);
  fault->joint = static_cast<int8_t>(joint);
  fault->link = static_cast<int8_t>(link);
  if (link != j.link_a && link != j.link_b) {
    fault->code = FaultCode::kLinkNotOnJoint;
    return;
  }
  // Positive actuator values turn link A about the joint's axis, and so link B the other way.
  Vec3 direction = JointDirection(context, joint);
  if (link == j.link_b) direction = Subtract(Vec3{}, direction);
  const float along = Dot(direction, UnitOf(axis));
  if (!LeadsTowards(std::fabs(along), 1.0f)) {
    fault->code = FaultCode::kAxisNotAligned;
    fault->measured = Mathematics(Opcode::kAcos, std::fabs(along), 0);
    fault->limit = kMostDegreesFromDirection;
    fault->asked_axis = axis;
    fault->direction_R = direction;
    return;
  }
  context.state.joints[joint].sign = along > 0 ? int8_t{1} : int8_t{-1};
}

double SignOf(const Context& context, int joint) {
  return context.state.joints[joint].sign < 0 ? -1.0 : 1.0;
}

bool SetTarget(Context& context, int joint, double asked, double sign, Fault* fault) {
  const KinJoint& j = context.kinematics.joint(joint);
  JointState& state = context.state.joints[joint];
  // Adding zero makes -0 a plain 0: equal targets have equal bytes in ACTUATOR, whatever the sign.
  double target = sign * asked + 0.0;
  bool within = true;
  if (j.kind != JointKind::kContinuous) {
    const double lower = static_cast<double>(j.lower_rad) * UnitsPerSi(j);
    const double upper = static_cast<double>(j.upper_rad) * UnitsPerSi(j);
    // A target within the tolerance is kept as asked, so that going back the same way is exact; the
    // actuator's command is clamped all the same.
    const double limit = target < lower ? lower : upper;
    if (target < lower - kClampTolerance || target > upper + kClampTolerance) {
      within = false;
      fault->code = FaultCode::kTargetClamped;
      fault->joint = static_cast<int8_t>(joint);
      fault->asked = static_cast<float>(asked);
      fault->limit = static_cast<float>(sign * limit);
      target = limit;
    }
  }
  // A joint that turned endlessly sets out from where it is.
  if (state.turning) state.set_point = state.measured;
  state.turning = false;
  state.velocity = 0;
  // A new target is late only from now on; it may have been reached before it was set.
  state.target = target;
  state.asked_sign = sign < 0 ? int8_t{-1} : int8_t{1};
  ForgetLateness(&state);
  state.arrived = SetPointIsThere(state) && ErrorOf(j, state) <= ToleranceOf(j);
  return within;
}

bool Turn(Context& context, int joint, double asked, double sign, Fault* fault) {
  const KinJoint& j = context.kinematics.joint(joint);
  JointState& state = context.state.joints[joint];
  // Faster than the joint can is asked for as fast as it can.
  const double fastest = static_cast<double>(j.speed_rad_s) * UnitsPerSi(j);
  double velocity = sign * asked;
  bool within = true;
  if (std::fabs(velocity) > fastest + kClampTolerance) {
    within = false;
    fault->code = FaultCode::kSpeedClamped;
    fault->joint = static_cast<int8_t>(joint);
    fault->asked = static_cast<float>(asked);
    velocity = velocity > 0 ? fastest : -fastest;
    fault->limit = static_cast<float>(sign * velocity);
  }
  // Stopping holds the joint where it is; starting leaves the old target behind.
  const bool stop = std::fabs(velocity) <= 0;
  if (!stop || state.turning) state.target = state.set_point = state.measured;
  state.turning = !stop;
  state.velocity = velocity;
  state.asked_sign = sign < 0 ? int8_t{-1} : int8_t{1};
  ForgetLateness(&state);
  return within;
}

bool IsAtRest(const Context& context, int joint) {
  const JointState& state = context.state.joints[joint];
  return state.arrived || state.stalled || state.turning;
}

void FillCommands(const Context& context, TickOutput* output) {
  for (int j = 0; j < context.kinematics.num_joints(); ++j) {
    const KinJoint& joint = context.kinematics.joint(j);
    const JointState& state = context.state.joints[j];
    JointCommand& command = output->joints[j];
    command = JointCommand();
    if (joint.kind == JointKind::kFixed) continue;
    if (state.turning) {
      command.mode = ActuatorMode::kVelocity;
      command.speed = state.velocity / UnitsPerSi(joint);
      continue;
    }
    // The actuator is never asked for more than its limits, though a target may lie beyond them by
    // the tolerance.
    command.mode = ActuatorMode::kPosition;
    command.target = state.target / UnitsPerSi(joint);
    command.speed = static_cast<double>(joint.speed_rad_s);
    if (joint.kind == JointKind::kContinuous) continue;
    const double lower = static_cast<double>(joint.lower_rad);
    const double upper = static_cast<double>(joint.upper_rad);
    if (lower > -static_cast<double>(kUnlimited))
      command.target = command.target < lower ? lower : command.target;
    if (upper < static_cast<double>(kUnlimited))
      command.target = command.target > upper ? upper : command.target;
  }
}

}  // namespace morphbus::vm
