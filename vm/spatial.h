#pragma once
// Distributed forward kinematics (paper, Sec. III-B), and what is asked of it: directions and axes.

#include "vm/context.h"

namespace morphbus::vm {

/// The root sets its pose; any other module takes the newest that a mate offers (newest sequence,
/// then fewer hops, then lower connector; never one that is not newer than its last, so that
/// modules cut off from the root do not feed each other). Then all links follow by the joint
/// values.
void UpdateSpatial(Context& context, const TickInput& input, const Mail& mail);

/// True while poses are neither missing nor stale.
bool HasFreshPose(const Context& context);

/// Unit vector in R; zero for kAny.
Vec3 UnitOf(Direction d);
/// The first named direction of an axis, in R; zero for kAny.
Vec3 UnitOf(Axis axis);

/// The module's place in R: mean of its links' origins.
Vec3 PlaceOf(const Context& context);

/// True if the mate on `connector` lies towards d: displacement * d >= sin(15 deg) *
/// |displacement|. Always true for kAny; false where either place is unknown.
bool LiesTowards(const Context& context, int connector, Direction d);

/// Unit direction in R about which the joint's first link turns (along which it slides) for
/// positive actuator values.
Vec3 JointDirection(const Context& context, int joint);

/// True if the joint's axis lies along `axis` to 15 degrees; always for kAny.
bool LiesAlong(const Context& context, int joint, Axis axis);

/// Adds the poses to our own message.
void FillPose(const Context& context, NeighbourMessage* message);

}  // namespace morphbus::vm
