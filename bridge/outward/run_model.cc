#include "bridge/outward/run_model.h"

#include <google/protobuf/stubs/logging.h>

#include "bridge/module/program_roles.h"
#include "bridge/outward/monitor.pb.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/run_description.pb.h"
#include "compiler/world/world_proto.h"
#include "vm/image/values.h"

namespace morphbus::bridge {
namespace {

std::vector<uint8_t> BytesOf(const std::string& text) { return {text.begin(), text.end()}; }
std::string StringOf(const vm::Text& text) { return {text.data, text.size}; }

/// A module with its parts, in order of declaration.
void Describe(const model::ModuleInstance& module, int id, const model::ModuleType& type,
              morphbus::DescribedModule* out) {
  out->set_id(static_cast<uint32_t>(id));
  out->set_name(module.name);
  out->set_type(type.name);
  // By their place in these lists messages name links, joints and connectors.
  for (const model::Link& link : type.links) out->add_links(link.name);
  for (const model::Joint& joint : type.joints) {
    morphbus::DescribedJoint& described = *out->add_joints();
    described.set_name(joint.name);
    described.set_type(model::JointTypeName(joint.type));
    described.set_lower(joint.lower);
    described.set_upper(joint.upper);
    described.set_speed(joint.speed);
  }
  for (const model::Connector& connector : type.connectors) out->add_connectors(connector.name);
  out->set_color(CssColor(PaletteColor(id)));
}

/// The roles of a program, with what people may invoke.
void DescribeRoles(const vm::VerifiedProgram& program, const RoleColors& colors,
                   morphbus::Description* out) {
  for (int i = 0; i < program.num_roles(); ++i) {
    // A role by its name, and whom it extends.
    const vm::RoleInfo role = program.role(i);
    morphbus::DescribedRole& described = *out->add_roles();
    described.set_name(StringOf(role.name));
    if (role.parent >= 0) described.set_extends(StringOf(program.role(role.parent).name));
    described.set_abstract(role.abstract_role);
    if (!role.abstract_role) described.set_color(CssColor(colors.Of(described.name())));
    for (int c = 0; c < role.num_commands; ++c) {
      morphbus::DescribedCommand& command = *described.add_commands();
      command.set_name(StringOf(program.member_name(role.commands[c])));
      // Of the parameters only the types are in the image.
      const vm::FunctionInfo function = program.function(role.commands[c]);
      for (int a = 0; a < function.num_arguments; ++a) {
        command.add_parameter_types(vm::InfoOf(function.local_types[a]).word);
      }
    }
    for (int l = 0; l < role.num_labels; ++l)
      described.add_labels(StringOf(program.member_name(role.labels[l])));
  }
}

/// All that viewers are told of the run.
std::shared_ptr<const morphbus::Description> Describe(const proto::RunDescription& d,
                                                      const RunModel& run) {
  // What ran, as the run's own description has it.
  auto out = std::make_shared<morphbus::Description>();
  out->set_run(d.run());
  out->set_robot(d.robot());
  out->set_model_file(d.model_file());
  out->set_program_file(d.program_file());
  out->set_mode(d.mode());
  out->set_build(d.build());
  out->set_started(d.started());
  out->set_tick_us(d.tick_us());
  out->set_root_module(d.root_module());
  out->set_world_hash(d.world_hash());
  out->set_still(d.still());
  out->set_model_hash(d.model_hash());
  out->set_program_hash(d.program_hash());
  // Modules and roles, for lists and for dialogues that invoke commands.
  for (size_t m = 0; m < run.robot->modules.size(); ++m) {
    const int id = static_cast<int>(m);
    Describe(run.robot->modules[m], id, run.TypeOf(id), out->add_modules());
  }
  if (run.has_program) DescribeRoles(run.images.program(), run.colors, out.get());
  return out;
}

}  // namespace

Result<std::shared_ptr<const RunModel>> ReadRunModel(const std::string& description) {
  const google::protobuf::LogSilencer silencer;  // The error below says what is wrong.
  proto::RunDescription d;
  if (!d.ParseFromString(description) || d.run().empty()) {
    return Fail("this is no description of a run");
  }
  // The model must be usable, and the very one that the messages speak of.
  Result<model::Model> model = model::ParseModel(d.model());
  if (!model) {
    return Fail("the model in the run's description cannot be used: " + model.error().message);
  }
  if (model::ModelHash(d.model()) != d.model_hash()) {
    return Fail("the model in the run's description is not the one that its hash names");
  }
  auto run = std::make_shared<RunModel>();
  // What is needed to read messages is taken over.
  run->run = d.run();
  run->model_hash = d.model_hash();
  run->program_hash = d.program_hash();
  run->tick_us = d.tick_us();
  run->speed = d.speed();
  run->root_sensor = d.root_sensor();
  run->program_file = d.program_file();
  run->model = std::move(*model);
  // A world that cannot be read is left out: the robot can be seen without it.
  if (Result<std::vector<world::Obstacle>> obstacles = world::ReadWorld(d)) {
    run->obstacles = *std::move(obstacles);
  }
  run->robot = run->model.FindRobot(d.robot());
  if (run->robot == nullptr) {
    return Fail("the model in the run's description has no robot '" + d.robot() + "'");
  }
  // The root is one of the robot's modules; only the robot's own root says which link is meant.
  run->root_module = run->robot->FindModule(d.root_module()).value_or(run->robot->root_module);
  run->root_link = run->root_module == run->robot->root_module ? run->robot->root_link : 0;
  run->X_RL_start =
      model::ForwardKinematics(run->model, *run->robot, model::StartValues(*run->robot)).X_RL;
  // An image that is damaged leaves its part without names; faults then have numbers.
  run->has_program = run->images.AddProgram("program", BytesOf(d.program_image())).has_value();
  if (run->has_program) run->colors.Add(PlayableRoles(run->images.program()));
  for (const proto::KinematicsImage& type : d.kinematics()) {
    if (!run->images.AddKinematics(type.type_name(), BytesOf(type.image()))) continue;
  }
  run->description = Describe(d, *run);
  return run;
}

}  // namespace morphbus::bridge
