#include "compiler/emit/c_tables.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "compiler/base/check.h"
#include "compiler/emit/kinematics.h"
#include "compiler/emit/shipped_sources.h"
#include "vm/image/image_texts.h"
#include "vm/image/kinematics_verifier.h"

namespace morphbus::emit {
namespace {

/// "{0.0f, 1.0f}"
std::string Braced(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + CFloat(value);
  return "{" + text + "}";
}

std::string Braced(const vm::Vec3& v) { return Braced({v.x, v.y, v.z}); }
std::string Braced(const Eigen::Vector3d& v) { return Braced({v.x(), v.y(), v.z()}); }

// Writes the tables of vm/image/kinematics_c.h as initialised constants.
class Writer {
 public:
  Writer(const vm::VerifiedKinematics& kinematics, const model::ModuleType& type,
         std::string prefix)
      : kinematics_(kinematics), type_(type), prefix_(std::move(prefix)) {}

  std::string Definitions() {
    // Names are collected while the tables are written, but must be defined before them.
    const std::string links = Links();
    const std::string joints = Joints();
    const std::string connectors = Connectors();
    const std::string connections = Connections();
    const std::string sensors = Sensors();
    const std::string all = All();
    return "\n" + names_ + links + joints + connectors + connections + sensors + all;
  }

  // What the header of the module shows of the tables.
  [[nodiscard]] std::string Declarations() const {
    std::vector<std::string> names;
    for (int c = 0; c < kinematics_.num_connectors(); ++c) {
      names.push_back(ToString(kinematics_.connector(c).name));
    }
    return "/* Indices of connectors. */\n" + CEnumeration(prefix_, "connector", names) +
           fmt::format(
               "enum {{ {0}_num_connections = {1} }};\n\n"
               "/* What a virtual machine knows of its module. */\n"
               "extern const MORPHBUS_FLASH morphbus_kinematics {0}_kinematics;\n\n",
               prefix_, kinematics_.num_connections());
  }

 private:
  /// Defines a name as an array of its own, which may lie in flash; returns what it is called.
  std::string Name(const vm::Text& text) {
    const std::string name = fmt::format("name_{}", num_names_++);
    names_ +=
        fmt::format("static const MORPHBUS_FLASH char {}[] = \"{}\";\n", name, ToString(text));
    return name;
  }

  /// An array, and what to point to it with: C has no empty arrays.
  static std::string Array(const char* type, const std::string& name, const std::string& rows) {
    if (rows.empty()) return "";
    return fmt::format("\nstatic const MORPHBUS_FLASH {} {} = {{\n{}}};\n", type, name, rows);
  }

  // The tables hold nothing of a link but its name; shapes and masses stay with the compiler.
  std::string Links() {
    std::string rows;
    for (int i = 0; i < kinematics_.num_links(); ++i) {
      rows += fmt::format("  {{{}}},\n", Name(kinematics_.link(i).name));
    }
    return Array("morphbus_link", "links[]", rows);
  }

  std::string Joints() {
    // The order is that of vm::JointKind.
    // The header with the types defines these names.
    constexpr const char* kKinds[] = {"MORPHBUS_REVOLUTE", "MORPHBUS_CONTINUOUS",
                                      "MORPHBUS_PRISMATIC", "MORPHBUS_FIXED"};
    std::string rows;
    for (int i = 0; i < kinematics_.num_joints(); ++i) {
      const vm::KinJoint& joint = kinematics_.joint(i);
      rows += fmt::format("  {{{}, {}, {}, {}, {}, {},\n   {}, {}, {}}},\n", Name(joint.name),
                          kKinds[static_cast<int>(joint.kind)], joint.link_a, joint.link_b,
                          Braced(joint.origin_m), Braced(joint.axis), CFloat(joint.lower_rad),
                          CFloat(joint.upper_rad), CFloat(joint.speed_rad_s));
    }
    return Array("morphbus_joint", "joints[]", rows);
  }

  std::string Connectors() {
    std::string parts;
    std::string rows;
    for (int i = 0; i < kinematics_.num_connectors(); ++i) {
      // A connector points to its states and sub-points, which are arrays of their own.
      const vm::KinConnector& connector = kinematics_.connector(i);
      const model::Connector& features = type_.connectors[i];
      std::string states;
      for (int s = 0; s < connector.num_states; ++s) {
        states += fmt::format("  {{{}, {}}},\n", Name(connector.states[s].name),
                              connector.states[s].num_values);
      }
      std::string points;
      for (const Eigen::Vector3d& p : features.subpoints) points += "  " + Braced(p) + ",\n";
      parts += Array("morphbus_state", fmt::format("states_{}[]", i), states);
      parts += Array("float", fmt::format("points_{}[][3]", i), points);
      rows +=
          fmt::format("  {{{}, {}, {}, {}, {}, {}, {}}},\n", Name(connector.name), connector.link,
                      connector.num_states, features.subpoints.size(), Braced(features.p_MoCo_M),
                      states.empty() ? "0" : fmt::format("states_{}", i),
                      points.empty() ? "0" : fmt::format("points_{}", i));
    }
    return parts + Array("morphbus_connector", "connectors[]", rows);
  }

  std::string Connections() {
    std::string rows;
    for (int i = 0; i < kinematics_.num_connections(); ++i) {
      // Each connection from this type's side, with the pose of the neighbour as position and
      // quaternion.
      const vm::KinConnection c = kinematics_.connection(i);
      const vm::Quat& q = c.X_MN.q;
      rows += fmt::format("  {{{}, {}, {}, {}, {}, {}, {}}},\n", c.connection_type,
                          c.is_member_b ? 1 : 0, c.number, c.connector, c.mate_connector,
                          Braced(c.X_MN.p), Braced({q.w, q.x, q.y, q.z}));
    }
    return Array("morphbus_connection", "connections[]", rows);
  }

  std::string Sensors() {
    // The order is that of vm::SensorKind.
    constexpr const char* kKinds[] = {"MORPHBUS_DISTANCE", "MORPHBUS_CONTACT", "MORPHBUS_TILT"};
    std::string rows;
    for (int i = 0; i < kinematics_.num_sensors(); ++i) {
      const vm::KinSensor& sensor = kinematics_.sensor(i);
      rows += fmt::format("  {{{}, {}, {}, {}, {}, {}}},\n", Name(sensor.name),
                          kKinds[static_cast<int>(sensor.kind)], sensor.link,
                          Braced(type_.sensors[i].p_MoSo_M), Braced(sensor.direction),
                          CFloat(sensor.range_m));
    }
    return Array("morphbus_sensor", "sensors[]", rows);
  }

  std::string All() {
    // The hashes are those of the image, so that machines with tables and with images know each
    // other.
    const std::string name = Name(kinematics_.type_name());
    const auto pointer = [](int count, const char* array) { return count > 0 ? array : "0"; };
    return fmt::format(
        "\nconst MORPHBUS_FLASH morphbus_kinematics {}_kinematics = {{\n"
        "  {}, UINT64_C({:#018x}), UINT64_C({:#018x}), {}, {}, {}, {},\n  links, {}, {}, {}, {}, "
        "{}\n}};\n",
        prefix_, name, kinematics_.hash(), kinematics_.model_hash(), kinematics_.num_links(),
        kinematics_.num_joints(), kinematics_.num_connectors(), kinematics_.num_connections(),
        pointer(kinematics_.num_joints(), "joints"),
        pointer(kinematics_.num_connectors(), "connectors"),
        pointer(kinematics_.num_connections(), "connections"), kinematics_.num_sensors(),
        pointer(kinematics_.num_sensors(), "sensors"));
  }

  const vm::VerifiedKinematics& kinematics_;
  const model::ModuleType& type_;
  std::string prefix_;
  std::string names_;
  int num_names_ = 0;
};

}  // namespace

Result<CTables> TablesInC(const model::Model& model, int type, uint64_t model_hash,
                          const std::string& prefix, const std::string& stem) {
  constexpr size_t kMaxPoints = 255;
  const model::ModuleType& module = model.module_types[type];
  // The tables count sub-points in a byte.
  for (const model::Connector& connector : module.connectors) {
    if (connector.subpoints.size() <= kMaxPoints) continue;
    return Fail(
        fmt::format("connector {} of module type {} has {} sub-points; a table holds at most {}",
                    connector.name, module.name, connector.subpoints.size(), kMaxPoints));
  }
  const Result<std::string> image = KinematicsImage(model, type, model_hash);
  if (!image) return Fail(image.error().message);
  // Tables are written from the verified image, so that both say the same.
  vm::VerifiedKinematics kinematics;
  const vm::VerifyError error =
      vm::VerifyKinematics(reinterpret_cast<const uint8_t*>(image->data()),
                           static_cast<uint32_t>(image->size()), &kinematics);
  MORPHBUS_CHECK(error.message == nullptr);
  Writer writer(kinematics, module, prefix);
  CTables tables;
  CompanionFile types = {"morphbus_kinematics.h",
                         std::string(ShippedSource("vm/image/kinematics_c.h"))};
  // The module's own header keeps the name it was asked for.
  if (types.path == stem + ".h") types.path = "morphbus_kinematics_types.h";
  tables.companions.push_back(std::move(types));
  tables.include = fmt::format("#include \"{}\"\n\n", tables.companions[0].path);
  tables.declarations = writer.Declarations();
  tables.definitions = writer.Definitions();
  return tables;
}

std::string CFloat(double value) {
  // The shortest text that reads back the same float.
  std::string text = fmt::format("{}", static_cast<float>(value));
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + "f";
}

std::string CIdentifier(std::string name) {
  // Names of links hold dots, which C does not know.
  for (char& c : name) {
    const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!good) c = '_';
  }
  return name;
}

std::string CModulePrefix(const std::string& name) {
  return name == "morphbus" ? name + "_" : CIdentifier(name);
}

std::string CEnumeration(const std::string& prefix, const std::string& kind,
                         const std::vector<std::string>& names) {
  std::string text = "enum {\n";
  std::set<std::string> used;
  for (size_t i = 0; i < names.size(); ++i) {
    // m_1.a and m.1_a would be the same identifier.
    std::string name = CIdentifier(names[i]);
    // Underscores are added until no name before is the same.
    while (!used.insert(name).second) name += '_';
    text += fmt::format("  {}_{}_{} = {},  /* {} */\n", prefix, kind, name, i, names[i]);
  }
  return text + fmt::format("  {}_num_{}s = {}\n}};\n", prefix, kind, names.size());
}

}  // namespace morphbus::emit
