// Reading a model back. Nothing here trusts the message: see FromProto.

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "compiler/model/attributes.h"
#include "compiler/model/looks_proto.h"
#include "compiler/model/model_proto.h"

namespace morphbus::model {
namespace {

constexpr size_t kMaxModelBytes = size_t{64} << 20;
/// Directions and rotations may be off by this much, far more than a double loses on its way
/// through a file.
constexpr double kUnitTolerance = 1e-6;
/// Far above any robot, low enough that what is derived from a model stays in memory.
constexpr int kMaxItems = 1 << 20;
constexpr size_t kMaxNameBytes = 255;

/// Reads part after part and keeps the first error; after one, what it returns means nothing.
class Reader {
 public:
  Result<Model> Read(const proto::Model& message) {
    // Connections follow the indices of module types, robots those of both, so each stage is read
    // only if the one before it is sound.
    for (const proto::ModuleType& type : message.module_types()) {
      model_.module_types.push_back(ReadType(type));
    }
    CheckNames(model_.module_types, "module types");
    if (error_.empty()) {
      for (const proto::ConnectionType& connection : message.connection_types()) {
        model_.connection_types.push_back(ReadConnection(connection));
      }
      CheckNames(model_.connection_types, "connections");
    }
    if (error_.empty()) {
      for (const proto::Robot& robot : message.robots()) {
        model_.robots.push_back(ReadRobot(robot));
        if (!error_.empty()) break;
      }
      place_.clear();
      CheckNames(model_.robots, "robots");
    }
    if (error_.empty()) Bad(ReadLooks(message, &model_));
    if (!error_.empty()) return Fail("damaged model: " + error_);
    return std::move(model_);
  }

 private:
  /// Records the first error, with the part of the model that is being read; none if it is empty.
  void Bad(const std::string& what) {
    if (error_.empty() && !what.empty()) error_ = place_.empty() ? what : place_ + ": " + what;
  }

  /// An index below `count`; 0 and an error if it is not.
  int Index(uint32_t index, size_t count, const char* what) {
    if (index < count) return static_cast<int>(index);
    Bad(fmt::format("{} {} of {}", what, index, count));
    return 0;
  }

  /// Names are neither empty, nor too long, nor used twice.
  template <typename T>
  void CheckNames(const std::vector<T>& items, const char* what) {
    if (items.size() > kMaxItems) Bad(fmt::format("more than {} {}", kMaxItems, what));
    std::set<std::string> seen;
    for (const T& item : items) {
      if (item.name.empty() || item.name.size() > kMaxNameBytes) {
        Bad(fmt::format("a name among the {} is empty or too long", what));
      }
      if (!seen.insert(item.name).second) {
        Bad(fmt::format("two {} are called '{}'", what, item.name));
      }
    }
  }

  /// A number that is neither infinite nor NaN.
  double Finite(double value, const char* what) {
    if (!std::isfinite(value)) Bad(fmt::format("{} is not finite", what));
    return value;
  }

  /// Sets an attribute that M3L bounds on both sides, and that the engine wants so.
  template <class Part>
  void Set(const char* name, double value, Part* part) {
    const NumericAttribute<Part>& attribute = AttributeNamed<Part>(name);
    if (!attribute.Allows(value)) Bad(fmt::format("{} {}", name, value));
    attribute.set(part, value);
  }

  /// A vector of three finite numbers.
  Eigen::Vector3d Vector(const proto::Vector3& v, const char* what) {
    return {Finite(v.x(), what), Finite(v.y(), what), Finite(v.z(), what)};
  }

  /// A vector of length 1, to the tolerance.
  Eigen::Vector3d Unit(const proto::Vector3& v, const char* what) {
    const Eigen::Vector3d direction = Vector(v, what);
    if (!(std::abs(direction.norm() - 1.0) <= kUnitTolerance)) {
      Bad(fmt::format("{} is not a unit vector", what));
    }
    return direction;
  }

  /// A pose whose nine entries make a rotation without a mirror image. The position has no bounds
  /// but must be finite.
  Pose ReadPose(const proto::Pose& message, const char* what) {
    Pose X = Pose::Identity();
    X.translation() = Vector(message.position(), what);
    if (message.rotation_row_major_size() != 9) {
      Bad(fmt::format("{} has {} entries in its rotation, not 9", what,
                      message.rotation_row_major_size()));
      return X;
    }
    Eigen::Matrix3d R;
    for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = message.rotation_row_major(i);
    // Orthonormal and right-handed, to what a double keeps through a file.
    const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(error <= kUnitTolerance) || !(R.determinant() > 0.0)) {
      Bad(fmt::format("{} is not a rotation", what));
    }
    X.linear() = R;
    return X;
  }

  /// The value of an attribute or state, whichever kind it has.
  AttributeValue Value(const proto::AttributeValue& message, const char* what) {
    switch (message.value_case()) {
      case proto::AttributeValue::kFlag:
        return message.flag();
      case proto::AttributeValue::kNumber:
        return Finite(message.number(), what);
      case proto::AttributeValue::kText:
        return message.text();
      default:
        Bad(fmt::format("{} has no value", what));
        return false;
    }
  }

  /// A connector of a module with `num_links` links.
  Connector ReadConnector(const proto::Connector& message, size_t num_links) {
    // The link is looked up at once, as the module's links are read first.
    Connector connector;
    connector.name = message.name();
    connector.link = Index(message.link(), num_links, "link");
    connector.p_MoCo_M = Vector(message.position_in_module(), "position");
    // The sub-points keep their order, which the numbering of connections depends on.
    for (const proto::SubPoint& point : message.subpoints()) {
      connector.subpoint_names.push_back(point.name());
      connector.subpoints.push_back(Vector(point.position_in_module(), "sub-point"));
    }
    // An attribute has one value.
    for (const proto::Attribute& attribute : message.attributes()) {
      const AttributeValue value = Value(attribute.value(), "attribute");
      const bool fresh = connector.attributes.emplace(attribute.name(), value).second;
      if (!fresh) Bad(fmt::format("attribute '{}' twice", attribute.name()));
    }
    // All values of a state are of one kind, as a comparison takes them to be.
    for (const proto::StateVariable& state : message.states()) {
      StateVariable variable{state.name(), {}};
      for (const proto::AttributeValue& value : state.values()) {
        variable.values.push_back(Value(value, "state"));
        if (variable.values.front().index() != variable.values.back().index()) {
          Bad(fmt::format("state '{}' mixes kinds of values", state.name()));
        }
      }
      if (variable.values.empty()) Bad(fmt::format("state '{}' has no values", state.name()));
      connector.states.push_back(std::move(variable));
    }
    CheckNames(connector.states, "states");
    // A key of "" stands for the connector's centre.
    for (const proto::Normal& normal : message.normals()) {
      connector.normals[normal.point()] = Unit(normal.direction_in_module(), "normal");
    }
    return connector;
  }

  /// A joint of a module with `num_links` links.
  Joint ReadJoint(const proto::Joint& message, size_t num_links) {
    Joint joint;
    joint.name = message.name();
    // A type that a later version may add is refused, as it could not be moved.
    joint.type = static_cast<JointType>(message.type() - 1);
    if (message.type() < proto::JOINT_TYPE_REVOLUTE || message.type() > proto::JOINT_TYPE_FIXED) {
      Bad(fmt::format("joint type {}", static_cast<int>(message.type())));
    }
    // A joint holds two different links of the module together.
    joint.link_a = Index(message.link_a(), num_links, "link");
    joint.link_b = Index(message.link_b(), num_links, "link");
    if (joint.link_a == joint.link_b) Bad("a joint from a link to itself");
    joint.p_MoJo_M = Vector(message.origin_in_module(), "origin");
    joint.axis = Unit(message.direction_in_module(), "axis");
    // Limits may be infinite, as those of continuous joints are, but not NaN.
    joint.lower = message.lower();
    joint.upper = message.upper();
    if (!(joint.lower <= joint.upper)) Bad("limits the wrong way round");
    // Motors have limits that are not negative.
    joint.effort = Finite(message.effort(), "torque");
    joint.speed = Finite(message.speed(), "speed");
    if (joint.effort < 0.0 || joint.speed < 0.0) Bad("negative torque or speed");
    Set("backlash", message.backlash(), &joint);
    Set("delay", message.delay_s(), &joint);
    return joint;
  }

  /// A sensor; its direction has length 1.
  Sensor ReadSensor(const proto::Sensor& message, size_t num_links) {
    Sensor sensor;
    sensor.name = message.name();
    if (message.type() < proto::SENSOR_TYPE_DISTANCE || message.type() > proto::SENSOR_TYPE_TILT) {
      Bad(fmt::format("sensor type {}", static_cast<int>(message.type())));
    } else {
      sensor.type = static_cast<SensorType>(static_cast<int>(message.type()) - 1);
    }
    sensor.link = Index(message.link(), num_links, "link");
    sensor.p_MoSo_M = Vector(message.origin_in_module(), "origin");
    sensor.direction = Vector(message.direction_in_module(), "direction");
    if (std::abs(sensor.direction.norm() - 1.0) > 1e-6) Bad("direction is no unit vector");
    sensor.range_m = Finite(message.range_m(), "range");
    sensor.noise = Finite(message.noise(), "noise");
    if (sensor.range_m < 0.0 || sensor.noise < 0.0) Bad("negative range or noise");
    return sensor;
  }

  /// Where the parts of a link's shape end: each behind the one before it, the last at the end.
  void ReadPartEnds(const proto::Link& link, Link* read) {
    for (const uint32_t end : link.part_ends()) {
      const int begin = read->part_ends.empty() ? 0 : read->part_ends.back();
      if (end <= static_cast<uint32_t>(begin) || end > read->hull.size()) {
        return Bad(fmt::format("part_ends {}", end));
      }
      read->part_ends.push_back(static_cast<int>(end));
    }
    const bool whole = read->part_ends.empty() || read->part_ends.back() == std::ssize(read->hull);
    if (!whole || read->part_ends.size() == 1) Bad("part_ends");
  }

  /// A module type; place_ follows the part that is being read.
  ModuleType ReadType(const proto::ModuleType& message) {
    ModuleType type;
    type.name = message.name();
    place_ = fmt::format("module type '{}'", type.name);
    type.unit_m = Finite(message.unit_m(), "unit");
    if (!(type.unit_m > 0.0)) Bad("unit is not positive");
    type.on_loss = static_cast<OnLoss>(message.on_loss());
    if (message.on_loss() < proto::ON_LOSS_LIMP || message.on_loss() > proto::ON_LOSS_HOLD) {
      Bad(fmt::format("on_loss {}", static_cast<int>(message.on_loss())));
    }
    // Links first, as joints and connectors refer to them.
    for (const proto::Link& link : message.links()) {
      Link read;
      read.name = link.name();
      for (const proto::Vector3& p : link.hull()) read.hull.push_back(Vector(p, "hull"));
      ReadPartEnds(link, &read);
      read.mass_kg = Finite(link.mass_kg(), "mass");
      if (read.mass_kg < 0.0) Bad("negative mass");
      if (link.has_friction()) Set("friction", link.friction(), &read);
      Set("mass_spread", link.mass_spread(), &read);
      type.links.push_back(std::move(read));
    }
    CheckNames(type.links, "links");
    // The part that is read is told together with its module type.
    const std::string at_type = place_;
    for (const proto::Joint& joint : message.joints()) {
      place_ = fmt::format("{}, joint '{}'", at_type, joint.name());
      type.joints.push_back(ReadJoint(joint, type.links.size()));
    }
    for (const proto::Connector& connector : message.connectors()) {
      place_ = fmt::format("{}, connector '{}'", at_type, connector.name());
      type.connectors.push_back(ReadConnector(connector, type.links.size()));
    }
    for (const proto::Sensor& sensor : message.sensors()) {
      place_ = fmt::format("{}, sensor '{}'", at_type, sensor.name());
      type.sensors.push_back(ReadSensor(sensor, type.links.size()));
    }
    place_ = at_type;
    // Each kind of part has a space of names of its own, in which M3L allows no two alike.
    CheckNames(type.joints, "joints");
    CheckNames(type.connectors, "connectors");
    CheckNames(type.sensors, "sensors");
    place_.clear();
    return type;
  }

  /// One option of a connection between module types `a` and `b`.
  ConnectionOption ReadOption(const proto::ConnectionOption& message, const ModuleType& a,
                              const ModuleType& b) {
    ConnectionOption option;
    option.number = static_cast<int>(message.number());
    option.connector_a = Index(message.connector_a(), a.connectors.size(), "connector");
    option.connector_b = Index(message.connector_b(), b.connectors.size(), "connector");
    option.X_AB = ReadPose(message.x_ab(), "X_AB");
    if (!error_.empty()) return option;
    const Connector& on_a = a.connectors[option.connector_a];
    const Connector& on_b = b.connectors[option.connector_b];
    option.states = ReadSetting(message.states(), on_a, on_b);
    for (const proto::StateSetting& setting : message.other_states()) {
      option.other_states.push_back(ReadSetting(setting.states(), on_a, on_b));
    }
    return option;
  }

  /// A setting of the state variables of connectors `a` and `b`, which must have them.
  StateSetting ReadSetting(
      const google::protobuf::RepeatedPtrField<proto::StateRequirement>& message,
      const Connector& a, const Connector& b) {
    StateSetting setting;
    // Every state asked for is compared with the states of its connector.
    for (const proto::StateRequirement& state : message) {
      const AttributeValue value = Value(state.value(), "state");
      const Connector& connector = state.of_a() ? a : b;
      // The state must be one that the connector has, with a value that it can take.
      const bool known = std::ranges::any_of(connector.states, [&](const StateVariable& s) {
        return s.name == state.variable() && std::ranges::count(s.values, value) > 0;
      });
      if (!known) Bad(fmt::format("no such state '{}' or value of it", state.variable()));
      setting.push_back({state.of_a(), state.variable(), value});
    }
    return setting;
  }

  /// A connection; the module types have been read.
  ConnectionType ReadConnection(const proto::ConnectionType& message) {
    ConnectionType connection;
    connection.name = message.name();
    place_ = fmt::format("connection '{}'", connection.name);
    const size_t num_types = model_.module_types.size();
    // Without both module types there is nothing to compare the options with.
    connection.type_a = Index(message.type_a(), num_types, "module type");
    connection.type_b = Index(message.type_b(), num_types, "module type");
    if (!error_.empty()) return connection;
    const ModuleType& a = model_.module_types[connection.type_a];
    const ModuleType& b = model_.module_types[connection.type_b];
    // The count is only told, but must fit an int.
    if (message.candidates() > kMaxItems) Bad("too many candidates");
    connection.candidates = static_cast<int>(message.candidates());
    const std::string at_connection = place_;
    for (const proto::ConnectionOption& option : message.options()) {
      place_ = fmt::format("{}, option {}", at_connection, option.number());
      // Numbers run from 1 without gaps, as dockings refer to them by index.
      if (option.number() != connection.options.size() + 1) Bad("out of order");
      connection.options.push_back(ReadOption(option, a, b));
      if (!error_.empty()) return connection;
    }
    place_ = at_connection;
    // Rejections are kept for explanations; only their connectors are checked.
    for (const proto::PairRejection& rejection : message.rejections()) {
      connection.rejections.push_back(
          {Index(rejection.connector_a(), a.connectors.size(), "connector"),
           Index(rejection.connector_b(), b.connectors.size(), "connector"), rejection.reason()});
    }
    place_.clear();
    return connection;
  }

  /// The modules of a robot, each with a start value for every joint of its type.
  void ReadModules(const proto::Robot& message, Robot& robot) {
    for (const proto::ModuleInstance& module : message.modules()) {
      ModuleInstance instance;
      instance.name = module.name();
      instance.type = Index(module.type(), model_.module_types.size(), "module type");
      // Whether a start value lies within its limits is for the checker to say, not for a file.
      for (const double start : module.start()) {
        instance.start.push_back(Finite(start, "start value"));
      }
      if (!error_.empty()) return;
      const ModuleType& type = model_.module_types[instance.type];
      if (instance.start.size() != type.joints.size()) {
        Bad(fmt::format("module '{}' has {} start values for {} joints", instance.name,
                        instance.start.size(), type.joints.size()));
      }
      if (type.links.empty()) Bad(fmt::format("module '{}' has no links", instance.name));
      robot.modules.push_back(std::move(instance));
    }
    // Modules are found by name, so names are unique.
    CheckNames(robot.modules, "modules");
    if (robot.modules.empty()) Bad("no modules");
  }

  /// A docking, whose connectors must be those of the option that it names.
  Docking ReadDocking(const proto::Docking& message, const Robot& robot) {
    Docking docking;
    // Modules and connection are looked up first, then the option among those of the connection.
    docking.module_a = Index(message.module_a(), robot.modules.size(), "module");
    docking.module_b = Index(message.module_b(), robot.modules.size(), "module");
    docking.connection_type =
        Index(message.connection_type(), model_.connection_types.size(), "connection type");
    if (!error_.empty()) return docking;
    const ConnectionType& connection = model_.connection_types[docking.connection_type];
    docking.option = Index(message.option(), connection.options.size(), "option");
    if (!error_.empty()) return docking;
    const ConnectionOption& option = connection.options[docking.option];
    docking.connector_a = option.connector_a;
    docking.connector_b = option.connector_b;
    // The message repeats the connectors; they must agree with the option.
    const bool fits = message.connector_a() == static_cast<uint32_t>(option.connector_a) &&
                      message.connector_b() == static_cast<uint32_t>(option.connector_b) &&
                      robot.modules[docking.module_a].type == connection.type_a &&
                      robot.modules[docking.module_b].type == connection.type_b;
    if (!fits) Bad("the option is of other connectors");
    if (docking.module_a == docking.module_b) Bad("a module connected to itself");
    return docking;
  }

  /// A robot; module types and connections have been read.
  Robot ReadRobot(const proto::Robot& message) {
    Robot robot;
    robot.name = message.name();
    const std::string at_robot = fmt::format("robot '{}'", robot.name);
    place_ = at_robot;
    ReadModules(message, robot);
    if (!error_.empty()) return robot;
    // A connector is used once.
    std::set<std::pair<int, int>> used;
    for (const proto::Docking& docking : message.dockings()) {
      place_ = fmt::format("{}, connection {}", at_robot, robot.dockings.size() + 1);
      const Docking read = ReadDocking(docking, robot);
      if (!error_.empty()) return robot;
      if (!used.insert({read.module_a, read.connector_a}).second ||
          !used.insert({read.module_b, read.connector_b}).second) {
        Bad("a connector used twice");
      }
      robot.dockings.push_back(read);
    }
    place_ = at_robot;
    // The robot frame hangs from a link of one of the modules.
    robot.root_module = Index(message.root_module(), robot.modules.size(), "root module");
    const ModuleType& root = model_.module_types[robot.modules[robot.root_module].type];
    robot.root_link = Index(message.root_link(), root.links.size(), "root link");
    robot.X_LR = ReadPose(message.x_lr(), "X_LR");
    CheckGraph(message.graph(), robot);
    return robot;
  }

  /// The graph is worked out anew where it is needed; here its indices only have to be good.
  void CheckGraph(const proto::KinematicGraph& graph, const Robot& robot) {
    place_ += ", kinematic graph";
    const size_t num_bodies = static_cast<size_t>(graph.bodies_size());
    const size_t num_joints = static_cast<size_t>(graph.joints_size());
    // Index reports what is too large and gives 0 for it; there is a module 0, as the modules were
    // read without errors.
    const auto type_of = [&](uint32_t module) -> const ModuleType& {
      return model_.module_types[robot.modules[Index(module, robot.modules.size(), "module")].type];
    };
    for (const proto::Body& body : graph.bodies()) {
      for (const proto::LinkRef& ref : body.links()) {
        Index(ref.link(), type_of(ref.module()).links.size(), "link");
      }
    }
    for (const proto::GraphJoint& joint : graph.joints()) {
      Index(joint.joint(), type_of(joint.module()).joints.size(), "joint");
      Index(joint.body_a(), num_bodies, "body");
      Index(joint.body_b(), num_bodies, "body");
      for (const proto::AdjacentJoint& adjacent : joint.adjacent()) {
        Index(adjacent.joint(), num_joints, "joint");
      }
    }
  }

  Model model_;
  std::string place_;
  std::string error_;
};

}  // namespace

Result<Model> FromProto(const proto::Model& message) { return Reader().Read(message); }

Result<Model> ParseModel(std::string_view bytes) {
  if (bytes.size() > kMaxModelBytes) return Fail("model is larger than 64 MiB");
  // What is wrong is in the Result; protobuf would print it too.
  const google::protobuf::LogSilencer silence;
  proto::Model message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return Fail("not a serialized model, or cut short");
  }
  return FromProto(message);
}

}  // namespace morphbus::model
