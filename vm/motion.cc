#include "vm/motion.h"

#include <cmath>

#include "vm/scheduler.h"
#include "vm/spatial.h"

namespace morphbus::vm {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kArrivedDegrees = 2.0;
constexpr double kArrivedMillimetres = 1.0;
constexpr double kClampTolerance = 0.01;  // Degrees, millimetres.
constexpr float kCos45 = 0.70710678f;
constexpr float kUnlimited = 1e30f;  // rad or m; images carry the largest float.

bool IsPrismatic(const KinJoint& joint) { return joint.kind == JointKind::kPrismatic; }

/// Degrees a radian, or millimetres a metre.
double UnitsPerSi(const KinJoint& joint) { return IsPrismatic(joint) ? 1000.0 : 180.0 / kPi; }

/// How far the joint is from its target.
double ErrorOf(const KinJoint& joint, const JointState& state) {
  const double error = state.measured - state.target;
  // The angle of an endless joint may be told in any turn.
  if (joint.kind == JointKind::kContinuous) return std::fabs(std::remainder(error, 360.0));
  return std::fabs(error);
}

double ToleranceOf(const KinJoint& joint) {
  return IsPrismatic(joint) ? kArrivedMillimetres : kArrivedDegrees;
}

void FollowTarget(const KinJoint& joint, int64_t dt_us, JointState* state) {
  const double step = static_cast<double>(joint.speed_rad_s) * UnitsPerSi(joint) *
                      static_cast<double>(dt_us) * 1e-6;
  const double way = state->target - state->set_point;
  if (std::fabs(way) <= step) {
    state->set_point = state->target;
  } else {
    state->set_point += way > 0 ? step : -step;
  }
}

bool SetPointIsThere(const JointState& state) {
  return std::fabs(state.set_point - state.target) <= 0;
}

void JudgeArrival(Context& context, int j) {
  const KinJoint& joint = context.kinematics.joint(j);
  JointState& state = context.state.joints[j];
  const bool there = SetPointIsThere(state);
  const bool close = ErrorOf(joint, state) <= ToleranceOf(joint);
  state.arrived = there && close;
  if (!there || close) {
    state.late_since_us = -1;
    state.stalled = false;
    return;
  }
  const int64_t now = context.state.sim_time_us;
  if (state.late_since_us < 0) state.late_since_us = now;
  if (state.stalled || now - state.late_since_us < kStallUs) return;
  state.stalled = true;
  Fault fault;
  fault.code = FaultCode::kStalled;
  fault.joint = static_cast<int16_t>(j);
  fault.value = static_cast<float>(state.measured);
  fault.limit = static_cast<float>(state.target);
  Report(context, fault);
  RaiseEvent(context, Event::kStall, j);
}

}  // namespace

void UpdateJoints(Context& context, const TickInput& input, int64_t dt_us) {
  for (int j = 0; j < context.kinematics.num_joints(); ++j) {
    const KinJoint& joint = context.kinematics.joint(j);
    JointState& state = context.state.joints[j];
    state.measured = input.joint_position[j] * UnitsPerSi(joint);
    if (!context.state.started || state.turning) {
      state.target = state.set_point = state.measured;
    }
    FollowTarget(joint, dt_us, &state);
    if (joint.kind != JointKind::kFixed) JudgeArrival(context, j);
  }
}

void DropConventions(Context& context) {
  for (int j = 0; j < context.kinematics.num_joints(); ++j) {
    JointState& state = context.state.joints[j];
    state.sign = 0;
    state.turning = false;
    state.velocity = 0;
  }
}

void SetConvention(Context& context, int joint, int link, Axis axis, Fault* fault) {
  const KinJoint& j = context.kinematics.joint(joint);
  fault->joint = static_cast<int16_t>(joint);
  if (link != j.link_a && link != j.link_b) {
    fault->code = FaultCode::kLinkNotOnJoint;
    return;
  }
  Vec3 direction = JointDirection(context, joint);
  if (link == j.link_b) direction = Subtract(Vec3{}, direction);
  const float along = Dot(direction, UnitOf(axis));
  if (!(std::fabs(along) >= kCos45)) {
    fault->code = FaultCode::kAxisNotAligned;
    fault->value = std::acos(std::fmin(1.0f, std::fabs(along))) * static_cast<float>(180.0 / kPi);
    fault->limit = 45.0f;
    fault->axis = axis;
    fault->direction_R = direction;
    return;
  }
  context.state.joints[joint].sign = along > 0 ? int8_t{1} : int8_t{-1};
}

double SignOf(const Context& context, int joint) {
  return context.state.joints[joint].sign < 0 ? -1.0 : 1.0;
}

bool SetTarget(Context& context, int joint, double target, Fault* fault) {
  const KinJoint& j = context.kinematics.joint(joint);
  JointState& state = context.state.joints[joint];
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
      fault->joint = static_cast<int16_t>(joint);
      fault->value = static_cast<float>(target);
      fault->limit = static_cast<float>(limit);
      target = limit;
    }
  }
  if (state.turning) state.set_point = state.measured;
  state.turning = false;
  state.velocity = 0;
  state.target = target;
  state.stalled = false;
  state.late_since_us = -1;
  state.arrived = SetPointIsThere(state) && ErrorOf(j, state) <= ToleranceOf(j);
  return within;
}

bool Turn(Context& context, int joint, double velocity, Fault* fault) {
  const KinJoint& j = context.kinematics.joint(joint);
  JointState& state = context.state.joints[joint];
  const double fastest = static_cast<double>(j.speed_rad_s) * UnitsPerSi(j);
  bool within = true;
  if (std::fabs(velocity) > fastest + kClampTolerance) {
    within = false;
    fault->code = FaultCode::kTargetClamped;
    fault->joint = static_cast<int16_t>(joint);
    fault->value = static_cast<float>(velocity);
    velocity = velocity > 0 ? fastest : -fastest;
    fault->limit = static_cast<float>(velocity);
  }
  const bool stop = std::fabs(velocity) <= 0;
  if (!stop || state.turning) state.target = state.set_point = state.measured;
  state.turning = !stop;
  state.velocity = velocity;
  state.stalled = false;
  state.late_since_us = -1;
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
    command.mode = ActuatorMode::kPosition;
    command.target = state.target / UnitsPerSi(joint);
    command.speed = static_cast<double>(joint.speed_rad_s);
    if (joint.kind == JointKind::kContinuous) continue;
    const double lower = static_cast<double>(joint.lower_rad);
    const double upper = static_cast<double>(joint.upper_rad);
    if (lower > -static_cast<double>(kUnlimited)) command.target = std::fmax(command.target, lower);
    if (upper < static_cast<double>(kUnlimited)) command.target = std::fmin(command.target, upper);
  }
}

}  // namespace morphbus::vm
