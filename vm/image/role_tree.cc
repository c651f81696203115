#include "vm/image/role_tree.h"

namespace morphbus::vm {

void RoleTree::Plant(const VerifiedProgram& program) {
  const int num_roles = program.num_roles();
  for (int i = 0; i < num_roles; ++i) first_child_[i] = next_sibling_[i] = kNoRole;
  for (int i = num_roles - 1; i >= 0; --i) {
    const int parent = program.role(i).parent;
    if (parent < 0) continue;
    next_sibling_[i] = first_child_[parent];
    first_child_[parent] = static_cast<uint8_t>(i);
  }
  // Each role below one that extends none is come to after the one that it extends: down first,
  // then to the side, then up until there is a way to the side.
  for (int top = 0; top < num_roles; ++top) {
    if (program.role(top).parent >= 0) continue;
    for (int i = top; i >= 0;) {
      const int parent = program.role(i).parent;
      ancestors_[i] = uint64_t{1} << i | (parent < 0 ? 0 : ancestors_[parent]);
      if (first_child_[i] != kNoRole) {
        i = first_child_[i];
        continue;
      }
      while (i != top && next_sibling_[i] == kNoRole) i = program.role(i).parent;
      i = i == top ? -1 : next_sibling_[i];
    }
  }
}

}  // namespace morphbus::vm
