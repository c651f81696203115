#pragma once
// The kinematics of one module type, verified: what a module knows of its own body. It comes as
// bytes (little-endian; vm/kinematics_layout.h) or as the same tables in C (vm/kinematics_c.h),
// which "morphbus export --to c" prints.

#include <cstdint>

#include "vm/kinematics_c.h"
#include "vm/limits.h"
#include "vm/pose.h"
#include "vm/program.h"
#include "vm/verifier.h"

namespace morphbus::vm {

enum class JointKind : uint8_t { kRevolute, kContinuous, kPrismatic, kFixed };

struct KinLink {
  Text name;
};

/// +q turns A relative to B about `axis` (unit, A's axis) through `origin`, both in the module
/// frame.
struct KinJoint {
  Text name;
  JointKind kind = JointKind::kRevolute;
  uint8_t link_a = 0, link_b = 0;
  Vec3 origin_m;
  Vec3 axis;
  float lower_rad = 0, upper_rad = 0;  ///< m for prismatic; -/+ largest float when unlimited.
  float speed_rad_s = 0;               ///< m/s for prismatic.
};

struct KinConnectorState {
  Text name;               ///< e.g. "extended".
  uint8_t num_values = 2;  ///< 2 for [bool].
};

struct KinConnector {
  Text name;
  uint8_t link = 0;
  uint8_t num_states = 0;
  KinConnectorState states[kMaxConnectorStates];
};

/// A numbered connection seen from this module: the mate's module frame in ours, joints at 0.
struct KinConnection {
  uint8_t connection_type = 0;  ///< Index of the M3L `connection`, as the connector sensor reports.
  uint16_t number = 0;
  uint8_t connector = 0;  ///< Our connector.
  uint8_t mate_connector = 0;
  bool is_member_b = false;  ///< As in ConnectorReading.
  PoseF X_MN;                ///< N: the mate's module frame (m).
};

/// Made only by the two functions below. Points into the bytes or tables; connections are decoded
/// on demand.
class VerifiedKinematics {
 public:
  [[nodiscard]] uint64_t hash() const { return hash_; }  ///< Of this image.
  [[nodiscard]] uint64_t model_hash() const {
    return model_hash_;
  }  ///< Of the model it comes from.
  [[nodiscard]] Text type_name() const { return type_name_; }
  [[nodiscard]] int num_links() const { return num_links_; }
  [[nodiscard]] const KinLink& link(int i) const { return links_[i]; }
  [[nodiscard]] int num_joints() const { return num_joints_; }
  [[nodiscard]] const KinJoint& joint(int i) const { return joints_[i]; }
  [[nodiscard]] int num_connectors() const { return num_connectors_; }
  [[nodiscard]] const KinConnector& connector(int i) const { return connectors_[i]; }
  [[nodiscard]] int num_connections() const { return num_connections_; }
  [[nodiscard]] KinConnection connection(int i) const;
  /// The entry that fits a connector's reading; false if there is none. Logarithmic.
  [[nodiscard]] bool Find(int connection_type, int number, bool is_member_b, int connector,
                          KinConnection* out) const;
  /// Lowest of the links that fixed joints hold together with `link`.
  [[nodiscard]] int BodyLink(int link) const { return body_link_[link]; }

 private:
  friend VerifyError VerifyKinematics(const uint8_t* bytes, uint32_t size, VerifiedKinematics* out);
  friend VerifyError VerifyTables(const morphbus_kinematics& tables, VerifiedKinematics* out);
  void GroupLinks();
  /// One of the two has the connections.
  const uint8_t* bytes_ = nullptr;
  const morphbus_connection* table_ = nullptr;
  uint32_t connections_begin_ = 0;
  uint64_t hash_ = 0, model_hash_ = 0;
  Text type_name_;
  int num_links_ = 0, num_joints_ = 0, num_connectors_ = 0, num_connections_ = 0;
  KinLink links_[kMaxLinks];
  KinJoint joints_[kMaxJoints];
  KinConnector connectors_[kMaxConnectors];
  uint8_t body_link_[kMaxLinks] = {};
};

/// Checks everything (sizes, indices, names, finite numbers, unit axes and quaternions, hash).
VerifyError VerifyKinematics(const uint8_t* bytes, uint32_t size, VerifiedKinematics* out);

/// The same of tables in C, but for the hash, which stands for the image's content and is believed:
/// the tables are part of the program. `offset` of an error is the index of the table's row.
/// `tables` must outlive `out`.
VerifyError VerifyTables(const morphbus_kinematics& tables, VerifiedKinematics* out);

}  // namespace morphbus::vm
