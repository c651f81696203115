#pragma once
// What holds for the kinematics of a module type, whether it comes as bytes or as tables in C. Each
// function returns what is wrong in a few words, nullptr if nothing is.

#include <cstdint>

#include "vm/image/kinematics_image.h"

namespace morphbus::vm {

/// Of a module type's numbers of links, joints, connectors and sensors against vm/limits.h.
const char* ProblemOfCounts(int num_links, int num_joints, int num_connectors, int num_sensors);
/// Of one sensor: its kind, its link, and whether its direction is a unit vector.
const char* ProblemOf(const KinSensor& sensor, int num_links);
/// Of one joint: its links, and whether its numbers are finite, its axis a unit vector and its
/// limits in order.
const char* ProblemOf(const KinJoint& joint, int num_links);
/// Of one connection: its connectors, its number, and whether its transform is a pose.
const char* ProblemOf(const KinConnection& connection, int num_connectors);

}  // namespace morphbus::vm
