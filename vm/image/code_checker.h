#pragma once
// One pass over each function's instructions. The image states the stack's types and the set locals
// at every target of a jump, so no jump has to be followed and nothing has to be remembered.

#include <cstdint>

#include "vm/image/code_facts.h"
#include "vm/image/code_state.h"
#include "vm/image/join_table.h"
#include "vm/image/operand_checker.h"
#include "vm/image/program.h"
#include "vm/image/role_tree.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// Checks the code of a program whose tables are sound, function by function, in the order of their
/// numbers, which is that of their code.
class CodeChecker {
 public:
  /// All arguments must outlive the checker.
  CodeChecker(const VerifiedProgram& program, const RoleTree& tree, FirstError* error)
      : program_(program), tree_(tree), joins_(program.bytes()), error_(*error) {}

  /// Checks the next function, of this index: every instruction is known, whole, reachable and fed
  /// with operands of its types, and none goes on behind the last. Fills in `facts`, which are
  /// new. False after it has noted an error.
  bool Check(int index, CodeFacts* facts);
  /// Whether each join has been met at an instruction, once all functions have been checked; else
  /// false after it has noted an error.
  bool CheckAllJoinsMet();

 private:
  /// What of a join at this instruction holds there; `reachable` says whether something arrives
  /// from above.
  bool MeetJoin(uint32_t at, bool* reachable, CodeState* state);
  /// One instruction, whose effect on the types goes to `state`; returns what is wrong.
  const char* CheckInstruction(const FunctionInfo& function, const uint8_t* code,
                               OperandChecker* operands, CodeState* state) const;

  const VerifiedProgram& program_;
  const RoleTree& tree_;
  const JoinTable joins_;
  FirstError& error_;
  /// Joins are met in the order of the code: the first one that has not been.
  uint32_t next_join_ = 0;
};

}  // namespace morphbus::vm
