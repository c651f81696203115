#include "vm/image/kinematics_tables.h"

#include "vm/image/kinematics_checks.h"

namespace morphbus::vm {

namespace {

constexpr uint16_t kMaxName = 255;  // As in an image.

/// Three floats of a table, in the module frame.
Vec3 ToVec3(const float v[3]) { return {v[0], v[1], v[2]}; }

/// Empty if the name is longer than any may be.
Text ToText(const char* name) {
  // What has no end within the longest name is no name.
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

/// A name that must be there.
Text Name(const char* name, int row, VerifyError* error) {
  const Text text = ToText(name);
  if (text.size == 0) Note("name is empty or too long", row, error);
  return text;
}

/// The error of a pointer that was left out.
constexpr const char* kMissing = "array is missing";

/// Null may stand only for an array of none.
template <typename T>
bool IsMissing(const T* array, int count) {
  return array == nullptr && count > 0;
}

/// Copies a row and notes what is wrong with it; `row` is its index.
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
  // What makes no joint, however it is stored.
  Note(ProblemOf(joint, num_links), row, error);
  return joint;
}

KinConnector ReadConnector(const morphbus_connector& from, int row, int num_links,
                           VerifyError* error) {
  // Points and attributes of a connector are for programs in C; the virtual machine needs where it
  // sits and its states.
  KinConnector connector;
  connector.name = Name(from.name, row, error);
  connector.link = from.link;
  if (from.link >= num_links) Note("connector sits on no link", row, error);
  if (from.num_states > kMaxConnectorStates) {
    Note("connector has too many states", row, error);
    return connector;
  }
  // The arrays are read below, so they must be there.
  if (IsMissing(from.states, from.num_states) || IsMissing(from.points, from.num_points)) {
    Note(kMissing, row, error);
    return connector;
  }
  // State variables keep their order: programs name them, commands number them.
  connector.num_states = from.num_states;
  for (int i = 0; i < from.num_states; ++i) {
    connector.states[i].name = Name(from.states[i].name, row, error);
    connector.states[i].num_values = from.states[i].num_values;
    if (from.states[i].num_values == 0) Note("state has no values", row, error);
  }
  return connector;
}

KinSensor ReadSensor(const morphbus_sensor& from, int row, int num_links, VerifyError* error) {
  KinSensor sensor;
  sensor.name = Name(from.name, row, error);
  // Without its kind nothing else of it can be judged.
  if (from.kind > MORPHBUS_TILT) {
    Note("sensor kind is unknown", row, error);
    return sensor;
  }
  sensor.kind = static_cast<SensorKind>(from.kind);
  sensor.link = from.link;
  sensor.direction = ToVec3(from.direction);
  sensor.range_m = from.range;
  Note(ProblemOf(sensor, num_links), row, error);
  return sensor;
}

}  // namespace

VerifyError VerifyTables(const morphbus_kinematics& tables, VerifiedKinematics* out) {
  *out = VerifiedKinematics();
  VerifyError error;
  Note(ProblemOfCounts(tables.num_links, tables.num_joints, tables.num_connectors,
                       tables.num_sensors),
       0, &error);
  if (IsMissing(tables.links, tables.num_links) || IsMissing(tables.joints, tables.num_joints) ||
      IsMissing(tables.connectors, tables.num_connectors) ||
      IsMissing(tables.sensors, tables.num_sensors) ||
      IsMissing(tables.connections, tables.num_connections)) {
    Note(kMissing, 0, &error);
  }
  if (error.message != nullptr) return error;
  // The counts and arrays hold, so the rows can be read. All else that is wrong is noted, the first
  // of it told.
  VerifiedKinematics k;
  k.table_ = tables.connections;
  k.hash_ = tables.hash;
  k.model_hash_ = tables.model_hash;
  k.type_name_ = Name(tables.type_name, 0, &error);
  k.num_links_ = tables.num_links;
  k.num_joints_ = tables.num_joints;
  k.num_connectors_ = tables.num_connectors;
  k.num_connections_ = tables.num_connections;
  k.num_sensors_ = tables.num_sensors;
  for (int i = 0; i < k.num_links_; ++i) k.links_[i].name = Name(tables.links[i].name, i, &error);
  for (int i = 0; i < k.num_joints_; ++i) {
    k.joints_[i] = ReadJoint(tables.joints[i], i, k.num_links_, &error);
  }
  for (int i = 0; i < k.num_connectors_; ++i) {
    k.connectors_[i] = ReadConnector(tables.connectors[i], i, k.num_links_, &error);
  }
  for (int i = 0; i < k.num_sensors_; ++i) {
    k.sensors_[i] = ReadSensor(tables.sensors[i], i, k.num_links_, &error);
  }
  // A tilt sensor has three values, so that sensors may be few enough and their values too many.
  Note(k.NumberSensorValues(), 0, &error);
  // As in an image: sorted, without repeats.
  uint64_t previous = 0;
  for (int i = 0; i < k.num_connections_; ++i) {
    const KinConnection c = k.connection(i);
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
