#pragma once
// The kinematics of one module type, verified: what a module knows of its own body. It comes as
// bytes (little-endian; vm/image/kinematics_layout.h) or as the same tables in C
// (vm/image/kinematics_c.h), which "morphbus export --to c" prints.

#include <cstdint>

#include "vm/image/kinematics_c.h"
#include "vm/image/pose.h"
#include "vm/image/program.h"
#include "vm/image/verify_error.h"
#include "vm/limits.h"

namespace morphbus::vm {

/// How a joint moves; a continuous joint turns without limits.
enum class JointKind : uint8_t { kRevolute, kContinuous, kPrismatic, kFixed };

/// A rigid part of the module.
struct KinLink {
  Text name;
};

/// +q turns A relative to B about `axis` (unit, A's axis) through `origin`, both in the module
/// frame.
struct KinJoint {
  Text name;
  JointKind kind = JointKind::kRevolute;
  /// The links A and B, by index.
  uint8_t link_a = 0, link_b = 0;
  /// A point on the axis (m).
  Vec3 origin_m;
  Vec3 axis;
  /// The limits (rad, or m for prismatic joints); the largest float with its sign where there is
  /// none.
  float lower_rad = 0, upper_rad = 0;
  /// The greatest speed (rad/s, or m/s for prismatic joints).
  float speed_rad_s = 0;
};

/// Something about a connector that its hardware can change at run time, such as hooks.
struct KinConnectorState {
  /// The name, e.g. "extended".
  Text name;
  /// The number of values; 2 for [bool].
  uint8_t num_values = 2;
};

/// A place at which another module can dock.
struct KinConnector {
  Text name;
  /// The index of the link that carries it.
  uint8_t link = 0;
  /// The state variables in the order of their declaration; commands name them by their numbers.
  uint8_t num_states = 0;
  KinConnectorState states[kMaxConnectorStates];
};

/// A sensor, rigid with a link.
struct KinSensor {
  Text name;
  SensorKind kind = SensorKind::kDistance;
  /// The index of the link that carries it.
  uint8_t link = 0;
  /// Where its first value stands among those of all sensors.
  uint8_t first_value = 0;
  /// The unit direction in which it looks, in the module frame.
  Vec3 direction;
  /// How far it sees (m); 0 for a tilt.
  float range_m = 0;
};

/// How many values a sensor of this kind has: a distance its metres, a contact 0 or 1, a tilt the
/// unit vector that points straight up, in the frame of its link.
constexpr int NumValues(SensorKind kind) { return kind == SensorKind::kTilt ? 3 : 1; }

/// A numbered connection seen from this module: the mate's module frame in ours, joints at 0.
struct KinConnection {
  /// The index of the M3L `connection`, as the connector sensor reports it.
  uint8_t connection_type = 0;
  /// The number of the option within that connection, from 1.
  uint16_t number = 0;
  /// Our connector and the mate's, by index.
  uint8_t connector = 0;
  uint8_t mate_connector = 0;
  /// True if this module is the connection's second member, as in ConnectorReading.
  bool is_member_b = false;
  /// The pose of N, the mate's module frame, in our module frame M (m).
  PoseF X_MN;
};

/// Made only by VerifyKinematics (vm/image/kinematics_verifier.h) and VerifyTables
/// (vm/image/kinematics_tables.h). Points into the bytes or tables; connections are decoded on
/// demand.
class VerifiedKinematics {
 public:
  /// The hash of this image.
  [[nodiscard]] uint64_t hash() const { return hash_; }
  /// Of the model that it was compiled from.
  [[nodiscard]] uint64_t model_hash() const { return model_hash_; }
  /// The module type's name in the model, then its parts in the order of their declaration.
  [[nodiscard]] Text type_name() const { return type_name_; }
  [[nodiscard]] int num_links() const { return num_links_; }
  [[nodiscard]] const KinLink& link(int i) const { return links_[i]; }
  [[nodiscard]] int num_joints() const { return num_joints_; }
  [[nodiscard]] const KinJoint& joint(int i) const { return joints_[i]; }
  [[nodiscard]] int num_connectors() const { return num_connectors_; }
  [[nodiscard]] const KinConnector& connector(int i) const { return connectors_[i]; }
  [[nodiscard]] int num_sensors() const { return num_sensors_; }
  [[nodiscard]] const KinSensor& sensor(int i) const { return sensors_[i]; }
  /// How many values all sensors together have.
  [[nodiscard]] int num_sensor_values() const { return num_sensor_values_; }
  [[nodiscard]] int num_connections() const { return num_connections_; }
  /// Decodes connection number i, from 0 in sorted order.
  [[nodiscard]] KinConnection connection(int i) const;
  /// The entry that fits a connector's reading; false if there is none. Logarithmic.
  [[nodiscard]] bool Find(int connection_type, int number, bool is_member_b, int connector,
                          KinConnection* out) const;
  /// Lowest of the links that fixed joints hold together with `link`.
  [[nodiscard]] int BodyLink(int link) const { return body_link_[link]; }

 private:
  // Only the two verifiers fill it in.
  friend VerifyError VerifyKinematics(const uint8_t* bytes, uint32_t size, VerifiedKinematics* out);
  friend VerifyError VerifyTables(const morphbus_kinematics& tables, VerifiedKinematics* out);
  /// Gives each sensor the place of its values; a sentence if they are too many.
  const char* NumberSensorValues();
  /// Fills body_link_ from the fixed joints.
  void GroupLinks();
  /// The image or the tables, whichever it was made from; the other is null. That one has the
  /// connections.
  const uint8_t* bytes_ = nullptr;
  const morphbus_connection* table_ = nullptr;
  uint32_t connections_begin_ = 0;
  uint64_t hash_ = 0, model_hash_ = 0;
  Text type_name_;
  int num_links_ = 0, num_joints_ = 0, num_connectors_ = 0, num_connections_ = 0;
  int num_sensors_ = 0, num_sensor_values_ = 0;
  KinLink links_[kMaxLinks];
  KinJoint joints_[kMaxJoints];
  KinConnector connectors_[kMaxConnectors];
  KinSensor sensors_[kMaxSensors];
  /// For each link, the lowest link of its body.
  uint8_t body_link_[kMaxLinks] = {};
};

/// Connections are sorted by it: connector, type, member, number.
uint64_t KeyOf(const KinConnection& connection);

}  // namespace morphbus::vm
