#include "bridge/module/program_roles.h"

namespace morphbus::bridge {

std::vector<std::string> PlayableRoles(const vm::VerifiedProgram& program) {
  std::vector<std::string> names;
  for (int i = 0; i < program.num_roles(); ++i) {
    const vm::RoleInfo role = program.role(i);
    if (!role.abstract_role) names.emplace_back(role.name.data, role.name.size);
  }
  return names;
}

}  // namespace morphbus::bridge
