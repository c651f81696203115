#include "vm/image/set_locals.h"

#include "vm/image/join_table.h"
#include "vm/image/opcodes.h"

namespace morphbus::vm {

uint16_t SetLocals(const VerifiedProgram& program, int function, uint32_t pc) {
  const FunctionInfo info = program.function(function);
  // The joins of the function are those from its first byte on.
  const JoinTable joins(program.bytes());
  uint32_t join = joins.FirstFrom(info.code_begin);
  // As the verifier goes: straight on from the beginning, where the arguments are set.
  unsigned set = CodeState::AtBegin(info.num_arguments).set_locals;
  const uint8_t* code = program.bytes() + info.code_begin;
  for (uint32_t at = 0; at <= pc && at < info.code_size;) {
    if (join < joins.count() && joins.target(join) == info.code_begin + at) {
      set = joins.set_locals(join++);
    }
    if (at == pc) break;
    const OpcodeInfo& row = kOpcodes[code[at++]];
    for (const OperandPart part : InfoOf(row.operand).parts) {
      if (part == OperandPart::kStoredLocal) set |= 1U << code[at];
      at += BytesOf(part);
    }
  }
  return static_cast<uint16_t>(set);
}

}  // namespace morphbus::vm
