#pragma once
// Distributed forward kinematics (paper, Sec. III-B), and what is asked of it: directions and axes.

#include "vm/run/context.h"

namespace morphbus::vm {

/// The sine of 15 degrees, and what they leave of a right angle, in degrees: for messages.
inline constexpr float kSin15 = 0.25881905f, kMostDegreesFromDirection = 75.0f;
/// The rule of "towards", for neighbours, sensors and axes of joints alike: a vector leads towards
/// a direction if it leads at least 15 degrees out of the plane normal to it. `along` is the
/// vector's dot product with the direction, `length` the vector's own length.
inline bool LeadsTowards(float along, float length) { return along >= kSin15 * length; }

/// The root sets its pose; any other module takes the newest that a neighbour offers (newest
/// sequence, then fewer hops, then lower connector; never one that is not newer than its last, so
/// that modules cut off from the root do not feed each other). Then all links follow by the joint
/// values.
void UpdateSpatial(Context& context, const TickInput& input, const Inbox& inbox);

/// The tick of the root's clock at this module's tick: its poses bring both the root's tick and the
/// hops that it took. False while the module has heard of no root.
bool RootTick(const VmState& state, int64_t tick, int64_t* root_tick);

/// True while poses are neither missing nor stale.
bool HasFreshPose(const Context& context);
/// No news of the root for some ticks, though it sends some in each: whether the way to it has only
/// become longer, or there is none any more, shows once news comes or the pose goes stale.
bool MayBeCutOff(const Context& context);

/// The module's place in R: mean of its links' origins.
Vec3 PlaceOf(const Context& context);

/// True if the neighbour on `connector` lies towards d: displacement * d >= sin(15 deg) *
/// |displacement|. Always true for kAny; false where either place is unknown.
bool LiesTowards(const Context& context, int connector, Direction d);

/// Unit direction in R about which the joint's first link turns (along which it slides) for
/// positive actuator values.
Vec3 JointDirection(const Context& context, int joint);

/// True if the joint's axis lies along `axis` to 15 degrees; always for kAny.
bool LiesAlong(const Context& context, int joint, Axis axis);

/// Unit direction in R in which a sensor looks.
Vec3 SensorDirection(const Context& context, int sensor);

/// Adds the poses to our own message.
void FillPose(const Context& context, NeighbourMessage* message);

}  // namespace morphbus::vm
