#include "bridge/outward/scene.h"
#include "vm/image/image_texts.h"
#include "vm/image/values.h"

namespace morphbus::bridge {
namespace {

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
    described.set_name(ToString(role.name));
    if (role.parent >= 0) described.set_extends(ToString(program.role(role.parent).name));
    described.set_abstract(role.abstract_role);
    if (!role.abstract_role) described.set_color(CssColor(colors.Of(described.name())));
    for (int c = 0; c < role.num_commands; ++c) {
      morphbus::DescribedCommand& command = *described.add_commands();
      command.set_name(ToString(program.member_name(role.commands[c])));
      // Of the parameters only the types are in the image.
      const vm::FunctionInfo function = program.function(role.commands[c]);
      for (int a = 0; a < function.num_arguments; ++a) {
        command.add_parameter_types(vm::InfoOf(function.local_types[a]).word);
      }
    }
    for (int l = 0; l < role.num_labels; ++l)
      described.add_labels(ToString(program.member_name(role.labels[l])));
  }
}

}  // namespace

morphbus::Description DescriptionOf(const RunModel& run, const RoleColors& colors) {
  // What ran, as the run's own description has it.
  morphbus::Description out;
  out.set_run(run.run);
  out.set_robot(run.robot_name);
  out.set_model_file(run.model_file);
  out.set_program_file(run.program_file);
  out.set_mode(run.mode);
  out.set_build(run.build);
  out.set_started(run.started);
  out.set_tick_us(run.tick_us);
  out.set_root_module(run.root_module);
  out.set_world_hash(run.world_hash);
  out.set_still(run.still);
  out.set_model_hash(run.model_hash);
  out.set_program_hash(run.program_hash);
  // Modules and roles, for lists and for dialogues that invoke commands.
  for (size_t m = 0; m < run.robot->modules.size(); ++m) {
    const int id = static_cast<int>(m);
    Describe(run.robot->modules[m], id, run.TypeOf(id), out.add_modules());
  }
  for (const dynarole::ProgramParameter& parameter : run.parameters) {
    morphbus::DescribedParameter& described = *out.add_parameters();
    described.set_name(parameter.name);
    described.set_is_int(parameter.is_int);
    described.set_value(parameter.value);
    described.set_least(parameter.least);
    described.set_most(parameter.most);
  }
  if (run.has_program) DescribeRoles(run.images.program(), colors, &out);
  return out;
}

}  // namespace morphbus::bridge
