#pragma once
// What holds for the kinematics of a module type, whether it comes as bytes or as tables in C. Each
// function returns what is wrong in a few words, nullptr if nothing is.

#include <cstdint>

#include "vm/kinematics_image.h"

namespace morphbus::vm {

const char* ProblemOfCounts(int num_links, int num_joints, int num_connectors);
const char* ProblemOf(const KinJoint& joint, int num_links);
const char* ProblemOf(const KinConnection& connection, int num_connectors);

/// Connections are sorted by it: connector, type, member, number.
uint64_t KeyOf(const KinConnection& connection);

/// A row of the tables in C.
KinConnection FromC(const morphbus_connection& row);

}  // namespace morphbus::vm
