#include "vm/image/kinematics_checks.h"

#include <cmath>

namespace morphbus::vm {

namespace {

bool IsFinite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Of a square of a length; false for what is not finite.
bool IsUnit(float squared_norm) { return std::fabs(squared_norm - 1.0f) < 1e-4f; }

}  // namespace

// A module type without links could not be anywhere; the rest is bounded by what a VM holds.
const char* ProblemOfCounts(int num_links, int num_joints, int num_connectors) {
  if (num_links == 0 || num_links > kMaxLinks) return "number of links";
  if (num_joints > kMaxJoints) return "too many joints";
  if (num_connectors > kMaxConnectors) return "too many connectors";
  return nullptr;
}

const char* ProblemOf(const KinJoint& joint, int num_links) {
  if (joint.link_a >= num_links || joint.link_b >= num_links || joint.link_a == joint.link_b) {
    return "joint does not connect two links";
  }
  // One number that is not finite would spread through all poses of the robot.
  if (!IsFinite(joint.origin_m) || !std::isfinite(joint.lower_rad) ||
      !std::isfinite(joint.upper_rad) || !std::isfinite(joint.speed_rad_s)) {
    return "number is not finite";
  }
  // Angles and lengths along the axis are right only if it is a unit vector.
  if (!IsUnit(Dot(joint.axis, joint.axis))) return "joint axis is not a unit vector";
  if (joint.lower_rad > joint.upper_rad) return "joint limits are the wrong way round";
  if (joint.speed_rad_s <= 0) return "joint speed is not positive";
  return nullptr;
}

const char* ProblemOf(const KinConnection& connection, int num_connectors) {
  if (connection.connector >= num_connectors || connection.mate_connector >= kMaxConnectors) {
    return "connection names no connector";
  }
  if (connection.number == 0) return "connection numbers begin at 1";
  // The neighbour's module frame in ours.
  const Quat& q = connection.X_MN.q;
  if (!IsFinite(connection.X_MN.p) || !IsUnit(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z)) {
    return "transform of a connection is not a pose";
  }
  return nullptr;
}

uint64_t KeyOf(const KinConnection& c) {
  return static_cast<uint64_t>(c.connector) << 40 | static_cast<uint64_t>(c.connection_type) << 32 |
         static_cast<uint64_t>(c.is_member_b) << 16 | static_cast<uint64_t>(c.number);
}

}  // namespace morphbus::vm
