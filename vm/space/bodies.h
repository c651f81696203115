#pragma once
// Bodies, distributed: which joints touch the body that each own link belongs to. A body is a
// largest set of links held together by dockings and fixed joints (paper, Fig. 6).

#include "vm/run/context.h"

namespace morphbus::vm {

/// Stamps the own joints and merges what the neighbours say of the bodies they share with us. Of an
/// origin only stamps newer than the last accepted count, so what is gone clears by itself within
/// diameter + 1 ticks, and modules cut off from it do not keep it alive for each other. News of a
/// body goes along the body and not across joints: the diameter is that of the body, should it be
/// longer than the robot's.
void UpdateBodies(Context& context, const Inbox& inbox);

/// Joints that touch the link's body.
int DegreeOf(const Context& context, int link);

/// Other joints that touch either of the joint's two bodies.
int AdjacentOf(const Context& context, int joint);

/// Adds the live joint sets to a digest.
void AddBodies(const Context& context, Digest* digest);

/// Adds the docked bodies to our own message, in at most `room` entries; larger sets go in turns.
void FillBodies(const Context& context, int room, NeighbourMessage* message);

}  // namespace morphbus::vm
