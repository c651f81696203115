#pragma once
// What an instruction takes from the stack and leaves there, by the letters of
// vm/image/opcodes.def. No instruction is known by name here.

#include "vm/image/code_state.h"
#include "vm/image/opcodes.h"
#include "vm/image/operand_checker.h"
#include "vm/image/program.h"

namespace morphbus::vm {

/// The effect of one instruction on the types of the stack. Its functions return what is wrong in a
/// few words, nullptr if nothing is.
class StackEffect {
 public:
  /// All arguments must outlive it. `info` is the instruction's row, `function` that in whose code
  /// it stands, `named` what its operand names, which has been checked.
  StackEffect(const VerifiedProgram& program, const FunctionInfo& function, const OpcodeInfo& info,
              const NamedOperand& named)
      : program_(program), function_(function), info_(info), named_(named) {}

  /// Takes what the instruction pops, from the top of the stack down, which is from the last
  /// letter.
  const char* Take(CodeState* state);
  /// Puts there what it pushes.
  const char* Leave(CodeState* state) const;

 private:
  /// What one letter stands for.
  const char* Pop(Term term, CodeState* state);
  /// One of two values of one type whose bits tell whether they are the same.
  const char* PopCompared(CodeState* state);
  /// The arguments of the function that is called, and the values that the text has places for.
  const char* PopArguments(CodeState* state) const;
  const char* PopPlaces(CodeState* state) const;

  const VerifiedProgram& program_;
  const FunctionInfo& function_;
  const OpcodeInfo& info_;
  const NamedOperand& named_;
  /// The type of the second of two values that are compared, once it has been popped.
  ValueType compared_ = ValueType::kVoid;
};

}  // namespace morphbus::vm
