#pragma once
// Joints: targets, limits, arrival and stall, kinematic conventions, commands to the actuators.
//
// Degrees (millimetres for prismatic joints), in double: targets are sums of what a program asks
// for, and 45 + 45 has to be 90.

#include "vm/context.h"
#include "vm/interpreter.h"

namespace morphbus::vm {

/// Reads the sensors; the set-points follow the targets, and joints arrive or stall. `dt_us` is the
/// sim time since the last tick. On the first tick targets are the measured values.
void UpdateJoints(Context& context, const TickInput& input, int64_t dt_us);

/// Conventions go; a joint that turns endlessly stops; all others hold their targets.
void DropConventions(Context& context);

/// setJointAxis: the sign is that of the direction about which `link` turns counter-clockwise for
/// positive actuator values, along `axis`. On success *fault is kNone; more than 45 degrees off is
/// kAxisNotAligned with all that a person needs.
void SetConvention(Context& context, int joint, int link, Axis axis, Fault* fault);

/// +1 or -1: the convention's sign, the actuator's own without one.
double SignOf(const Context& context, int joint);

/// Sets an absolute target in the actuator's own sign. Returns false if it had to be clamped by
/// more than the tolerance; *fault then says to what.
bool SetTarget(Context& context, int joint, double target, Fault* fault);

/// Turns endlessly at `velocity` degrees a second in the actuator's own sign; 0 stops and holds.
/// Returns false if that is beyond the joint's speed, to which it was clamped.
bool Turn(Context& context, int joint, double velocity, Fault* fault);

/// The joint needs no waiting for: it has arrived, stalled, or turns endlessly.
bool IsAtRest(const Context& context, int joint);

/// What the actuators shall do until the next tick.
void FillCommands(const Context& context, TickOutput* output);

}  // namespace morphbus::vm
