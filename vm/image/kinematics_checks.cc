#include "vm/image/kinematics_checks.h"

#include <cmath>

#include "vm/image/verify_error.h"

namespace morphbus::vm {

namespace {

bool AllFinite(const Vec3& v) { return IsFinite(v.x) && IsFinite(v.y) && IsFinite(v.z); }

/// Of a square of a length; false for what is not finite.
bool IsUnit(float squared_norm) { return std::fabs(squared_norm - 1.0f) < 1e-4f; }

}  // namespace

// A module type without links could not be anywhere; the rest is bounded by what a VM holds.
const char* ProblemOfCounts(int num_links, int num_joints, int num_connectors, int num_sensors) {
  if (num_links == 0 || num_links > kMaxLinks) return Reason("number of links");
  if (num_joints > kMaxJoints) return Reason("too many joints");
  if (num_connectors > kMaxConnectors) return Reason("too many connectors");
  if (num_sensors > kMaxSensors) return Reason("too many sensors");
  return nullptr;
}

const char* ProblemOf(const KinSensor& sensor, int num_links) {
  // Programs ask sensors by where they look, which is computed from this direction.
  if (sensor.link >= num_links) return Reason("sensor sits on no link");
  if (!AllFinite(sensor.direction) || !IsFinite(sensor.range_m) || sensor.range_m < 0) {
    return Reason("number of a sensor is not finite, or its range negative");
  }
  if (!IsUnit(Dot(sensor.direction, sensor.direction))) {
    return Reason("sensor's direction is not a unit vector");
  }
  return nullptr;
}

const char* ProblemOf(const KinJoint& joint, int num_links) {
  if (joint.link_a >= num_links || joint.link_b >= num_links || joint.link_a == joint.link_b) {
    return Reason("joint does not connect two links");
  }
  // One number that is not finite would spread through all poses of the robot.
  if (!AllFinite(joint.origin_m) || !IsFinite(joint.lower_rad) || !IsFinite(joint.upper_rad) ||
      !IsFinite(joint.speed_rad_s)) {
    return Reason("number is not finite");
  }
  // Angles and lengths along the axis are right only if it is a unit vector.
  if (!IsUnit(Dot(joint.axis, joint.axis))) return Reason("joint axis is not a unit vector");
  if (joint.lower_rad > joint.upper_rad) return Reason("joint limits are the wrong way round");
  if (joint.speed_rad_s <= 0) return Reason("joint speed is not positive");
  return nullptr;
}

const char* ProblemOf(const KinConnection& connection, int num_connectors) {
  if (connection.connector >= num_connectors || connection.mate_connector >= kMaxConnectors) {
    return Reason("connection names no connector");
  }
  if (connection.number == 0) return Reason("connection numbers begin at 1");
  // The neighbour's module frame in ours.
  const Quat& q = connection.X_MN.q;
  if (!AllFinite(connection.X_MN.p) || !IsUnit(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z)) {
    return Reason("transform of a connection is not a pose");
  }
  return nullptr;
}

}  // namespace morphbus::vm
