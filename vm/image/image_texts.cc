#include "vm/image/image_texts.h"

namespace morphbus::vm {

// A role that is only extended has no module, and so nothing that could be shown in a color.
std::vector<std::string> PlayableRoles(const VerifiedProgram& program) {
  std::vector<std::string> names;
  for (int i = 0; i < program.num_roles(); ++i) {
    const RoleInfo role = program.role(i);
    if (!role.abstract_role) names.push_back(ToString(role.name));
  }
  return names;
}

}  // namespace morphbus::vm
