#pragma once
// Which roles of a program extend which, as a tree that is gone through without recursion.

#include <cstdint>

#include "vm/image/program.h"

namespace morphbus::vm {

/// The tree of a program's roles: below each the roles that extend it. Empty until it is planted.
class RoleTree {
 public:
  /// Learns the roles of a program, whose parents exist and form no circles. Takes time in
  /// proportion to the roles.
  void Plant(const VerifiedProgram& program);
  /// True if the first role is the second or extends it, directly or not; in one step, so that
  /// all checks that ask it stay linear.
  [[nodiscard]] bool IsA(int role, int ancestor) const {
    return (ancestors_[role] >> ancestor & 1) != 0;
  }
  /// One of the roles that extend this one directly; -1 if there is none.
  [[nodiscard]] int FirstChild(int role) const { return RoleOf(first_child_[role]); }
  /// Another role that extends the same one, until each has been named; -1 behind the last.
  [[nodiscard]] int NextSibling(int role) const { return RoleOf(next_sibling_[role]); }

 private:
  static constexpr uint8_t kNoRole = 255;
  static_assert(kMaxRoles < kNoRole);
  /// What an entry of the tables below stands for; -1 for none.
  static int RoleOf(uint8_t entry) { return entry == kNoRole ? -1 : entry; }

  /// For each role, the bits of itself and of those that it extends.
  uint64_t ancestors_[kMaxRoles] = {};
  /// Of those that extend a role the first, and of those that extend the same one the next.
  uint8_t first_child_[kMaxRoles];
  uint8_t next_sibling_[kMaxRoles];
};

}  // namespace morphbus::vm
