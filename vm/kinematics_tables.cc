// The kinematics of a module type from tables in C.

#include <cmath>

#include "vm/kinematics_checks.h"

namespace morphbus::vm {

namespace {

constexpr uint16_t kMaxName = 255;  // As in an image.

Vec3 ToVec3(const float v[3]) { return {v[0], v[1], v[2]}; }

bool IsFinite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Of a square of a length; false for what is not finite.
bool IsUnit(float squared_norm) { return std::fabs(squared_norm - 1.0f) < 1e-4f; }

/// Empty if the name is longer than any may be.
Text ToText(const char* name) {
  Text text{name, 0};
  while (name != nullptr && text.size <= kMaxName && name[text.size] != 0) ++text.size;
  if (text.size > kMaxName) text.size = 0;
  return text;
}

/// Keeps the first thing that was wrong.
void Note(const char* message, int row, VerifyError* error) {
  if (error->message == nullptr && message != nullptr) {
    *error = {message, static_cast<uint32_t>(row)};
  }
}

Text Name(const char* name, int row, VerifyError* error) {
  const Text text = ToText(name);
  if (text.size == 0) Note("name is empty or too long", row, error);
  return text;
}

constexpr const char* kMissing = "array is missing";

/// Null may stand only for an array of none.
template <typename T>
bool IsMissing(const T* array, int count) {
  return array == nullptr && count > 0;
}

KinJoint ReadJoint(const morphbus_joint& from, int row, int num_links, VerifyError* error) {
  KinJoint joint;
  joint.name = Name(from.name, row, error);
  if (from.kind > MORPHBUS_FIXED) Note("joint kind is unknown", row, error);
  joint.kind = static_cast<JointKind>(from.kind);
  joint.link_a = from.link_a;
  joint.link_b = from.link_b;
  joint.origin_m = ToVec3(from.origin);
  joint.axis = ToVec3(from.axis);
  joint.lower_rad = from.lower;
  joint.upper_rad = from.upper;
  joint.speed_rad_s = from.speed;
  Note(ProblemOf(joint, num_links), row, error);
  return joint;
}

KinConnector ReadConnector(const morphbus_connector& from, int row, int num_links,
                           VerifyError* error) {
  KinConnector connector;
  connector.name = Name(from.name, row, error);
  connector.link = from.link;
  if (from.link >= num_links) Note("connector sits on no link", row, error);
  if (from.num_states > kMaxConnectorStates) {
    Note("connector has too many states", row, error);
    return connector;
  }
  if (IsMissing(from.states, from.num_states) || IsMissing(from.points, from.num_points)) {
    Note(kMissing, row, error);
    return connector;
  }
  connector.num_states = from.num_states;
  for (int i = 0; i < from.num_states; ++i) {
    connector.states[i].name = Name(from.states[i].name, row, error);
    connector.states[i].num_values = from.states[i].num_values;
    if (from.states[i].num_values == 0) Note("state has no values", row, error);
  }
  return connector;
}

}  // namespace

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
  if (!IsFinite(joint.origin_m) || !std::isfinite(joint.lower_rad) ||
      !std::isfinite(joint.upper_rad) || !std::isfinite(joint.speed_rad_s)) {
    return "number is not finite";
  }
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

KinConnection FromC(const morphbus_connection& row) {
  KinConnection c;
  c.connection_type = row.connection_type;
  c.is_member_b = row.is_member_b != 0;
  c.number = row.number;
  c.connector = row.connector;
  c.mate_connector = row.mate_connector;
  c.X_MN.p = ToVec3(row.p);
  c.X_MN.q = {row.q[0], row.q[1], row.q[2], row.q[3]};
  return c;
}

VerifyError VerifyTables(const morphbus_kinematics& tables, VerifiedKinematics* out) {
  *out = VerifiedKinematics();
  VerifyError error;
  Note(ProblemOfCounts(tables.num_links, tables.num_joints, tables.num_connectors), 0, &error);
  if (IsMissing(tables.links, tables.num_links) || IsMissing(tables.joints, tables.num_joints) ||
      IsMissing(tables.connectors, tables.num_connectors) ||
      IsMissing(tables.connections, tables.num_connections)) {
    Note(kMissing, 0, &error);
  }
  if (error.message != nullptr) return error;
  VerifiedKinematics k;
  k.table_ = tables.connections;
  k.hash_ = tables.hash;
  k.model_hash_ = tables.model_hash;
  k.type_name_ = Name(tables.type_name, 0, &error);
  k.num_links_ = tables.num_links;
  k.num_joints_ = tables.num_joints;
  k.num_connectors_ = tables.num_connectors;
  k.num_connections_ = tables.num_connections;
  for (int i = 0; i < k.num_links_; ++i) k.links_[i].name = Name(tables.links[i].name, i, &error);
  for (int i = 0; i < k.num_joints_; ++i) {
    k.joints_[i] = ReadJoint(tables.joints[i], i, k.num_links_, &error);
  }
  for (int i = 0; i < k.num_connectors_; ++i) {
    k.connectors_[i] = ReadConnector(tables.connectors[i], i, k.num_links_, &error);
  }
  uint64_t previous = 0;
  for (int i = 0; i < k.num_connections_; ++i) {
    const KinConnection c = FromC(tables.connections[i]);
    Note(ProblemOf(c, k.num_connectors_), i, &error);
    if (i > 0 && KeyOf(c) <= previous) Note("connections are not in order", i, &error);
    previous = KeyOf(c);
  }
  if (error.message != nullptr) return error;
  k.GroupLinks();
  *out = k;
  return {};
}

}  // namespace morphbus::vm
