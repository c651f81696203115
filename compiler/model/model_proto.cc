#include "compiler/model/model_proto.h"

#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/text_format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/looks_proto.h"

namespace morphbus::model {
namespace {

// Each Write fills in one message. Indices are never negative in a sound model. The messages have
// the fields of the model's structs under nearly the same names, so the functions follow the order
// of the structs (model.proto says what each field means).
void Write(const Eigen::Vector3d& v, proto::Vector3* out) {
  out->set_x(v.x());
  out->set_y(v.y());
  out->set_z(v.z());
}

/// The rotation is written row by row.
void Write(const Pose& X, proto::Pose* out) {
  Write(Eigen::Vector3d(X.translation()), out->mutable_position());
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out->add_rotation_row_major(X(row, column));
  }
}

/// A value has one of three kinds, and the message keeps which.
void Write(const AttributeValue& value, proto::AttributeValue* out) {
  if (const auto* flag = std::get_if<bool>(&value)) out->set_flag(*flag);
  if (const auto* number = std::get_if<double>(&value)) out->set_number(*number);
  if (const auto* text = std::get_if<std::string>(&value)) out->set_text(*text);
}

/// Names and positions of the sub-points stand apart in the model and together in the message.
void Write(const Connector& connector, proto::Connector* out) {
  out->set_name(connector.name);
  out->set_link(connector.link);
  Write(connector.p_MoCo_M, out->mutable_position_in_module());
  for (size_t i = 0; i < connector.subpoints.size(); ++i) {
    proto::SubPoint* point = out->add_subpoints();
    point->set_name(connector.subpoint_names[i]);
    Write(connector.subpoints[i], point->mutable_position_in_module());
  }
  // Attributes come sorted by name, as the map has them, so that equal models give equal bytes.
  for (const auto& [name, value] : connector.attributes) {
    proto::Attribute* attribute = out->add_attributes();
    attribute->set_name(name);
    Write(value, attribute->mutable_value());
  }
  for (const StateVariable& state : connector.states) {
    proto::StateVariable* variable = out->add_states();
    variable->set_name(state.name);
    for (const AttributeValue& value : state.values) Write(value, variable->add_values());
  }
  for (const auto& [point, direction] : connector.normals) {
    proto::Normal* normal = out->add_normals();
    normal->set_point(point);
    Write(direction, normal->mutable_direction_in_module());
  }
}

// The message's enumerators are the model's in the same order, one further: 0 says nothing.
template <typename To, typename From>
To Enumerator(From value) {
  return static_cast<To>(static_cast<int>(value) + 1);
}
static_assert(static_cast<int>(JointType::kFixed) + 1 == proto::JOINT_TYPE_FIXED);
static_assert(static_cast<int>(AxisRelation::kCoplanar) + 1 == proto::AXIS_RELATION_COPLANAR);

// Here 0 is the default of M3L, too, so that the numbers are the same.
static_assert(static_cast<int>(OnLoss::kHold) == proto::ON_LOSS_HOLD);

/// Limits of continuous joints are infinite, which a message can hold.
void Write(const Joint& joint, proto::Joint* out) {
  out->set_name(joint.name);
  out->set_type(Enumerator<proto::JointType>(joint.type));
  out->set_link_a(joint.link_a);
  out->set_link_b(joint.link_b);
  Write(joint.p_MoJo_M, out->mutable_origin_in_module());
  Write(joint.axis, out->mutable_direction_in_module());
  out->set_lower(joint.lower);
  out->set_upper(joint.upper);
  out->set_effort(joint.effort);
  out->set_speed(joint.speed);
  out->set_backlash(joint.backlash);
  out->set_delay_s(joint.delay_s);
}

/// The links come first: joints and connectors refer to them by index.
void Write(const ModuleType& type, proto::ModuleType* out) {
  out->set_name(type.name);
  out->set_unit_m(type.unit_m);
  out->set_on_loss(static_cast<proto::OnLoss>(type.on_loss));
  for (const Link& link : type.links) {
    proto::Link* message = out->add_links();
    message->set_name(link.name);
    for (const Eigen::Vector3d& p : link.hull) Write(p, message->add_hull());
    for (const int end : link.part_ends) message->add_part_ends(static_cast<uint32_t>(end));
    message->set_mass_kg(link.mass_kg);
    if (link.friction) message->set_friction(*link.friction);
    message->set_mass_spread(link.mass_spread);
  }
  for (const Joint& joint : type.joints) Write(joint, out->add_joints());
  for (const Connector& connector : type.connectors) Write(connector, out->add_connectors());
  for (const Sensor& sensor : type.sensors) {
    proto::Sensor* message = out->add_sensors();
    message->set_name(sensor.name);
    // As Enumerator: 0 says nothing.
    message->set_type(static_cast<proto::SensorType>(static_cast<int>(sensor.type) + 1));
    message->set_link(sensor.link);
    Write(sensor.p_MoSo_M, message->mutable_origin_in_module());
    Write(sensor.direction, message->mutable_direction_in_module());
    message->set_range_m(sensor.range_m);
    message->set_noise(sensor.noise);
  }
}

/// A setting of state variables; requirements keep their order.
void Write(const StateSetting& setting,
           google::protobuf::RepeatedPtrField<proto::StateRequirement>* out) {
  for (const StateRequirement& state : setting) {
    proto::StateRequirement* requirement = out->Add();
    requirement->set_of_a(state.of_a);
    requirement->set_variable(state.variable);
    Write(state.value, requirement->mutable_value());
  }
}

/// Options keep their order, which is that of their numbers.
void Write(const ConnectionType& connection, proto::ConnectionType* out) {
  out->set_name(connection.name);
  out->set_type_a(connection.type_a);
  out->set_type_b(connection.type_b);
  out->set_candidates(connection.candidates);
  for (const ConnectionOption& option : connection.options) {
    proto::ConnectionOption* message = out->add_options();
    message->set_number(option.number);
    message->set_connector_a(option.connector_a);
    message->set_connector_b(option.connector_b);
    Write(option.X_AB, message->mutable_x_ab());
    // What the connectors' states must be belongs to the option.
    Write(option.states, message->mutable_states());
    for (const StateSetting& setting : option.other_states) {
      Write(setting, message->add_other_states()->mutable_states());
    }
  }
  // The reasons are kept, so that a reader can explain a pair without solving anew.
  for (const PairRejection& rejection : connection.rejections) {
    proto::PairRejection* message = out->add_rejections();
    message->set_connector_a(rejection.connector_a);
    message->set_connector_b(rejection.connector_b);
    message->set_reason(rejection.reason);
  }
}

/// The graph, so that readers in other languages need not work it out.
void Write(const KinematicGraph& graph, proto::KinematicGraph* out) {
  for (const Body& body : graph.bodies) {
    proto::Body* message = out->add_bodies();
    message->set_degree(body.degree);
    for (const LinkRef& ref : body.links) {
      proto::LinkRef* link = message->add_links();
      link->set_module(ref.module);
      link->set_link(ref.link);
    }
  }
  // An adjacent joint and the relation of the axes stand apart in the graph and together here.
  for (const GraphJoint& joint : graph.joints) {
    proto::GraphJoint* message = out->add_joints();
    message->set_module(joint.module);
    message->set_joint(joint.joint);
    message->set_body_a(joint.body_a);
    message->set_body_b(joint.body_b);
    Write(joint.p_RoJo_R, message->mutable_axis_point_in_robot());
    Write(joint.axis_R, message->mutable_axis_in_robot());
    for (size_t i = 0; i < joint.adjacent.size(); ++i) {
      proto::AdjacentJoint* adjacent = message->add_adjacent();
      adjacent->set_joint(joint.adjacent[i]);
      adjacent->set_relation(Enumerator<proto::AxisRelation>(joint.adjacent_axes[i]));
    }
    message->set_locked(joint.locked);
  }
  // Mobility is left out where it was not computed.
  if (graph.mobility) out->set_mobility(*graph.mobility);
  out->set_locked_computed(graph.locked_computed);
}

/// A robot with its kinematic graph at the start values.
void Write(const Model& model, const Robot& robot, proto::Robot* out) {
  out->set_name(robot.name);
  for (const ModuleInstance& module : robot.modules) {
    proto::ModuleInstance* message = out->add_modules();
    message->set_name(module.name);
    message->set_type(module.type);
    for (const double start : module.start) message->add_start(start);
  }
  // A docking names its connectors too, although its option does, for readers that have no use for
  // options.
  for (const Docking& docking : robot.dockings) {
    proto::Docking* message = out->add_dockings();
    message->set_module_a(docking.module_a);
    message->set_connector_a(docking.connector_a);
    message->set_module_b(docking.module_b);
    message->set_connector_b(docking.connector_b);
    message->set_connection_type(docking.connection_type);
    message->set_option(docking.option);
  }
  out->set_root_module(robot.root_module);
  out->set_root_link(robot.root_link);
  Write(robot.X_LR, out->mutable_x_lr());
  Write(BuildKinematicGraph(model, robot), out->mutable_graph());
}

}  // namespace

proto::Model ToProto(const Model& model) {
  // The order is that of the model, as indices in the message refer to it.
  proto::Model message;
  for (const ModuleType& type : model.module_types) Write(type, message.add_module_types());
  for (const ConnectionType& connection : model.connection_types) {
    Write(connection, message.add_connection_types());
  }
  for (const Robot& robot : model.robots) Write(model, robot, message.add_robots());
  WriteLooks(model, &message);
  return message;
}

std::string SerializeModel(const Model& model) {
  // The schema has no maps, whose order is the one thing that protobuf leaves open.
  return ToProto(model).SerializeAsString();
}

std::string ModelText(const Model& model) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(ToProto(model), &text);
  return text;
}

std::string WithoutLooks(std::string_view bytes) {
  // What is no model is refused where it is read.
  const google::protobuf::LogSilencer silence;
  proto::Model message;
  const bool read = message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  if (!read || message.looks_size() == 0) return std::string(bytes);
  message.clear_looks();
  return message.SerializeAsString();
}

uint64_t ModelHash(std::string_view bytes) {
  const std::string counted = WithoutLooks(bytes);
  return XXH64(counted.data(), counted.size(), 0);
}

}  // namespace morphbus::model
