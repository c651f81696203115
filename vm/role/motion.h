#pragma once
// Joints: targets, limits, arrival and stall, kinematic conventions, commands to the actuators.
//
// Degrees (millimetres for prismatic joints), in double: targets are sums of what a program asks
// for, and 45 + 45 has to be 90.

#include "vm/run/context.h"
#include "vm/run/interpreter.h"

namespace morphbus::vm {

/// Reads the sensors; the set-points follow the targets, and joints arrive or stall. `dt_us` is the
/// sim time since the last tick. On the first tick targets are the measured values.
void UpdateJoints(Context& context, const TickInput& input, int64_t dt_us);

/// The calls that moved the joints are over: one that turns endlessly stops, all others hold their
/// targets, and conventions stay.
void ForgetCalls(Context& context);

/// ForgetCalls; conventions go as well.
void DropConventions(Context& context);

/// setJointAxis: the sign is that of the direction about which `link` turns counter-clockwise for
/// positive actuator values, dotted with `axis`. On success *fault is kNone; a product below the
/// sine of 15 degrees is kAxisNotAligned, a link that the joint does not touch kLinkNotOnJoint.
void SetConvention(Context& context, int joint, int link, Axis axis, Fault* fault);

/// +1 or -1: the convention's sign, the actuator's own without one.
double SignOf(const Context& context, int joint);
/// Degrees a radian, or millimetres a metre where the joint slides.
double UnitsPerSi(const KinJoint& joint);

/// Sets an absolute target: `sign` times `asked` in the actuator's own sign. Returns false if it
/// had to be clamped by more than the tolerance; *fault then says to what.
bool SetTarget(Context& context, int joint, double asked, double sign, Fault* fault);

/// Turns endlessly at `sign` times `asked` degrees a second in the actuator's own sign; 0 stops and
/// holds. Returns false if that is beyond the joint's speed, to which it was clamped.
bool Turn(Context& context, int joint, double asked, double sign, Fault* fault);

/// The joint needs no waiting for: it has arrived, stalled, or turns endlessly.
bool IsAtRest(const Context& context, int joint);

/// What the actuators shall do until the next tick.
void FillCommands(const Context& context, TickOutput* output);

}  // namespace morphbus::vm
