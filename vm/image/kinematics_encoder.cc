#include "vm/image/kinematics_encoder.h"

#include <algorithm>
#include <cfloat>
#include <tuple>

#include "vm/image/image.h"
#include "vm/image/image_bytes.h"
#include "vm/image/kinematics_layout.h"
#include "vm/image/kinematics_verifier.h"

namespace morphbus::vm {

namespace {

namespace layout = kinematics;

/// The bytes of an image, with what a module type's tables are made of.
class Writer : public ImageBytes {
 public:
  void Float(double value) {
    // Unlimited joints carry the largest float, since every number of an image is finite.
    U32(Cell::Float(static_cast<float>(std::clamp<double>(value, -FLT_MAX, FLT_MAX))).bits);
  }
  void Vector(const Vec3& v) {
    for (float x : {v.x, v.y, v.z}) Float(x);
  }
  void Name(const std::string& name) {
    U8(name.size());
    Append(name);
  }
};

/// Sentence about the first capacity that the tables exceed, or empty.
std::string CheckCapacities(const KinematicsTables& t) {
  const auto over = [&t](const char* what, size_t count, int limit) {
    return "module type " + t.type_name + " has " + std::to_string(count) + " " + what +
           "; the virtual machine holds at most " + std::to_string(limit);
  };
  // Parts of the module type.
  if (t.links.empty()) return "module type " + t.type_name + " has no links";
  if (t.links.size() > kMaxLinks) return over("links", t.links.size(), kMaxLinks);
  if (t.joints.size() > kMaxJoints) return over("joints", t.joints.size(), kMaxJoints);
  if (t.connectors.size() > kMaxConnectors) {
    return over("connectors", t.connectors.size(), kMaxConnectors);
  }
  if (t.sensors.size() > kMaxSensors) return over("sensors", t.sensors.size(), kMaxSensors);
  // What a module tells of its sensors has room for so many values.
  int values = 0;
  for (const auto& sensor : t.sensors) values += NumValues(sensor.kind);
  if (values > kMaxSensorValues) {
    return over("sensor values (three of each tilt sensor)", values, kMaxSensorValues);
  }
  // All names stand in the image with one byte for their length.
  std::vector<std::string> names = t.links;
  names.push_back(t.type_name);
  for (const auto& joint : t.joints) names.push_back(joint.name);
  for (const auto& connector : t.connectors) {
    names.push_back(connector.name);
    if (connector.states.size() > kMaxConnectorStates) {
      return over("state variables on one connector", connector.states.size(), kMaxConnectorStates);
    }
    for (const auto& state : connector.states) {
      names.push_back(state.name);
      if (state.num_values > 255) return "state " + state.name + " has more than 255 values";
    }
  }
  for (const auto& sensor : t.sensors) names.push_back(sensor.name);
  // A name that is too long would be cut silently.
  for (const std::string& name : names) {
    if (name.empty() || name.size() > 255) return "a name is empty or longer than 255 characters";
  }
  return "";
}

/// Writes the connections, sorted by the key by which the VM searches them.
void WriteConnections(const KinematicsTables& tables, Writer* out) {
  std::vector<KinConnection> sorted = tables.connections;
  // The order is that of KeyOf (vm/image/kinematics_checks.h).
  std::sort(sorted.begin(), sorted.end(), [](const KinConnection& a, const KinConnection& b) {
    return std::make_tuple(a.connector, a.connection_type, a.is_member_b, a.number) <
           std::make_tuple(b.connector, b.connection_type, b.is_member_b, b.number);
  });
  for (const KinConnection& c : sorted) {
    // As ReadConnection of kinematics_image.cc expects them.
    out->U8(c.connection_type);
    out->U8(c.is_member_b ? layout::kMemberBFlag : 0);
    out->U16(c.number);
    out->U8(c.connector);
    out->U8(c.mate_connector);
    // Two reserved bytes keep the records at 36 bytes.
    out->U16(0);
    out->Vector(c.X_MN.p);
    for (float x : {c.X_MN.q.w, c.X_MN.q.x, c.X_MN.q.y, c.X_MN.q.z}) out->Float(x);
  }
}

/// Everything between the header and the connections, in the order of the layout.
void WriteTables(const KinematicsTables& tables, Writer* out) {
  // The reader finds each record behind the one before it, and so needs no offsets.
  out->Name(tables.type_name);
  for (const std::string& link : tables.links) out->Name(link);
  for (const auto& joint : tables.joints) {
    // Limits are cut to finite floats by Float.
    out->Name(joint.name);
    out->U8(static_cast<int>(joint.kind));
    out->U8(joint.link_a);
    out->U8(joint.link_b);
    out->Vector(joint.origin_m);
    out->Vector(joint.axis);
    for (double x : {joint.lower, joint.upper, joint.speed}) out->Float(x);
  }
  for (const auto& connector : tables.connectors) {
    // Only the link matters: poses of connections are those of modules.
    out->Name(connector.name);
    out->U8(connector.link);
    out->U8(static_cast<int>(connector.states.size()));
    for (const auto& state : connector.states) {
      out->Name(state.name);
      out->U8(state.num_values);
    }
  }
  for (const auto& sensor : tables.sensors) {
    out->Name(sensor.name);
    out->U8(static_cast<int>(sensor.kind));
    out->U8(sensor.link);
    out->Vector(sensor.direction);
    out->Float(sensor.range_m);
  }
}

}  // namespace

std::vector<uint8_t> EncodeKinematics(const KinematicsTables& tables, std::string* error) {
  *error = CheckCapacities(tables);
  if (!error->empty()) return {};
  // The header, with what is known only at the end left open.
  Writer out;
  out.U32(layout::kMagic);
  out.U16(layout::kVersion);
  out.U16(0);
  out.U32(0);  // Size, patched below.
  out.U32(static_cast<uint32_t>(tables.connections.size()));
  out.U64(0);  // Hash, patched below.
  out.U64(tables.model_hash);
  out.U8(static_cast<int>(tables.links.size()));
  out.U8(static_cast<int>(tables.joints.size()));
  out.U8(static_cast<int>(tables.connectors.size()));
  out.U8(static_cast<int>(tables.sensors.size()));
  WriteTables(tables, &out);
  WriteConnections(tables, &out);
  // Only connections can be too many: everything else is bounded by the capacities.
  if (out.bytes().size() > kMaxImageBytes) {
    *error = "module type " + tables.type_name + " has " +
             std::to_string(tables.connections.size()) +
             " connections, more than a kinematics image holds";
    return {};
  }
  // Size first, because the hash covers it.
  const auto size = static_cast<uint32_t>(out.bytes().size());
  out.Patch(layout::kSizeAt, size, 4);
  out.Patch(layout::kHashAt, image::HashOf(out.bytes().data(), size), 8);
  // Tables that contradict each other are found by the check that every module makes.
  VerifiedKinematics verified;
  const VerifyError check = VerifyKinematics(out.bytes().data(), size, &verified);
  if (check.message != nullptr) {
    *error = "module type " + tables.type_name + ": " + check.message;
    return {};
  }
  return out.bytes();
}

}  // namespace morphbus::vm
