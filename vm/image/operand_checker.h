#pragma once
// Operands of instructions by their parts (vm/image/operands.def). No instruction is known by name
// here.

#include <cstdint>

#include "vm/image/code_facts.h"
#include "vm/image/code_state.h"
#include "vm/image/join_table.h"
#include "vm/image/operands.h"
#include "vm/image/program.h"
#include "vm/image/role_tree.h"

namespace morphbus::vm {

/// What the operand of an instruction names.
struct NamedOperand {
  /// The type of what each part names; kVoid where it is no value.
  ValueType types[kMostParts] = {};
  /// The function that is called, the text, or the join: no operand names two of these.
  uint32_t number = 0;
};

/// Checks the operands in one function's code. Its functions return what is wrong in a few words,
/// nullptr if nothing is.
class OperandChecker {
 public:
  /// All arguments must outlive the checker. What the function calls and which keywords it names is
  /// noted in `facts`.
  OperandChecker(const VerifiedProgram& program, const RoleTree& tree, const JoinTable& joins,
                 const FunctionInfo& function, CodeFacts* facts)
      : program_(program), tree_(tree), joins_(joins), function_(function), facts_(*facts) {}

  /// What the parts of an operand name must exist and be of a type that will do; it goes to
  /// `named`. `at` is the operand's first byte. Locals that are read must have been set in `state`,
  /// where those that are written are set from here on.
  const char* Check(OperandKind kind, const uint8_t* at, CodeState* state, NamedOperand* named);

 private:
  /// The same for one part: whether what it names exists.
  const char* CheckPart(OperandPart part, const uint8_t* at, CodeState* state, NamedOperand* named);
  /// Whether the type of what a part names will do.
  static const char* CheckType(OperandPart part, ValueType type);
  const char* CheckArray(OperandPart part, uint32_t number, const CodeState& state) const;
  /// A keyword by its number, which is of the kind that the part wants.
  const char* CheckKeyword(OperandPart part, uint32_t number);
  /// The function that this one replaces, which stands in a role that the own one extends.
  const char* CheckSuper(uint32_t callee);
  /// A byte offset in the function, where a join is.
  const char* CheckTarget(uint32_t target, NamedOperand* named) const;

  const VerifiedProgram& program_;
  const RoleTree& tree_;
  const JoinTable& joins_;
  const FunctionInfo& function_;
  CodeFacts& facts_;
};

}  // namespace morphbus::vm
