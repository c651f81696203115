#pragma once
// What `self` offers, and what joints and connectors offer behind a dot: one table.

#include <string>
#include <vector>

#include "vm/opcodes.h"

namespace morphbus::dynarole {

struct Builtin {
  const char* name;
  const char* arguments;  ///< Letters of vm/opcodes.def, without the base.
  vm::Opcode opcode;
  bool property;      ///< May stand without parentheses.
  const char* usage;  ///< For messages.
};

/// Forms of `self.NAME`; several may share a name (self.connected).
const std::vector<Builtin>& SelfBuiltins();
/// Forms of `JOINT.NAME`.
const std::vector<Builtin>& JointBuiltins();

/// Names of a table, each once, for suggestions.
std::vector<std::string> NamesOf(const std::vector<Builtin>& builtins);

}  // namespace morphbus::dynarole
