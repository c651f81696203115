#include "vm/image/kinematics_image.h"

#include "vm/image/image.h"
#include "vm/image/kinematics_layout.h"

namespace morphbus::vm {

namespace {

using image::ReadU16;
namespace layout = kinematics;

float ReadFloat(const uint8_t* p) { return Cell{image::ReadU32(p)}.AsFloat(); }

/// Decodes a record of the last section; its bounds have been checked.
KinConnection ReadConnection(const uint8_t* p) {
  KinConnection c;
  // Single bytes first, the numbers behind them at offsets that suit their sizes.
  c.connection_type = p[0];
  c.is_member_b = (p[1] & layout::kMemberBFlag) != 0;
  c.number = ReadU16(p + 2);
  c.connector = p[4];
  c.mate_connector = p[5];
  c.X_MN.p = {ReadFloat(p + 8), ReadFloat(p + 12), ReadFloat(p + 16)};
  c.X_MN.q = {ReadFloat(p + 20), ReadFloat(p + 24), ReadFloat(p + 28), ReadFloat(p + 32)};
  return c;
}

/// The same from a row of the tables in C.
KinConnection FromC(const morphbus_connection& row) {
  KinConnection c;
  c.connection_type = row.connection_type;
  c.is_member_b = row.is_member_b != 0;
  c.number = row.number;
  c.connector = row.connector;
  c.mate_connector = row.mate_connector;
  c.X_MN.p = {row.p[0], row.p[1], row.p[2]};
  c.X_MN.q = {row.q[0], row.q[1], row.q[2], row.q[3]};
  return c;
}

}  // namespace

uint64_t KeyOf(const KinConnection& c) {
  return static_cast<uint64_t>(c.connector) << 40 | static_cast<uint64_t>(c.connection_type) << 32 |
         static_cast<uint64_t>(c.is_member_b) << 16 | static_cast<uint64_t>(c.number);
}

const char* VerifiedKinematics::NumberSensorValues() {
  // Values of all sensors lie in one row, so that a message needs no names.
  for (int i = 0; i < num_sensors_; ++i) {
    sensors_[i].first_value = static_cast<uint8_t>(num_sensor_values_);
    num_sensor_values_ += NumValues(sensors_[i].kind);
  }
  return num_sensor_values_ > kMaxSensorValues ? "too many sensors" : nullptr;
}

// Links that fixed joints hold together move as one; the lowest of them stands for all.
void VerifiedKinematics::GroupLinks() {
  for (int i = 0; i < num_links_; ++i) body_link_[i] = static_cast<uint8_t>(i);
  // Lowering labels over the fixed joints ends after at most one pass a link.
  for (int pass = 0; pass < num_links_; ++pass) {
    for (int j = 0; j < num_joints_; ++j) {
      if (joints_[j].kind != JointKind::kFixed) continue;
      uint8_t& a = body_link_[joints_[j].link_a];
      uint8_t& b = body_link_[joints_[j].link_b];
      a = b = a < b ? a : b;
    }
  }
}

KinConnection VerifiedKinematics::connection(int i) const {
  // Tables in C are read where they lie, records of an image are decoded.
  if (table_ != nullptr) return FromC(table_[i]);
  return ReadConnection(bytes_ + connections_begin_ +
                        static_cast<uint32_t>(i) * layout::kConnectionBytes);
}

bool VerifiedKinematics::Find(int connection_type, int number, bool is_member_b, int connector,
                              KinConnection* out) const {
  // The key of the entry, if there is one.
  KinConnection key;
  key.connector = static_cast<uint8_t>(connector);
  key.connection_type = static_cast<uint8_t>(connection_type);
  key.is_member_b = is_member_b;
  key.number = static_cast<uint16_t>(number);
  // Connections are sorted by their keys.
  const uint64_t wanted = KeyOf(key);
  const auto count = static_cast<uint32_t>(num_connections_);
  const auto at = static_cast<int>(image::FirstNot(
      count, [&](uint32_t i) { return KeyOf(connection(static_cast<int>(i))) < wanted; }));
  // What stands there is the wanted one or the next behind it.
  if (at == num_connections_) return false;
  const KinConnection found = connection(at);
  if (KeyOf(found) != wanted) return false;
  *out = found;
  return true;
}

}  // namespace morphbus::vm
