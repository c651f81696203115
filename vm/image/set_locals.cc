#include "vm/image/set_locals.h"

#include "vm/image/image.h"
#include "vm/image/opcodes.h"

namespace morphbus::vm {

using image::ReadU16;
using image::Section;

uint16_t SetLocals(const VerifiedProgram& program, int function, uint32_t pc) {
  const FunctionInfo info = program.function(function);
  const uint8_t* bytes = program.bytes();
  // The joins of the function are those from its first byte on.
  const uint32_t begin = info.code_begin - SectionOf(bytes, Section::kCode).begin;
  const image::SectionRange joins = SectionOf(bytes, Section::kJoins);
  const auto join_at = [&](uint32_t i) { return bytes + joins.begin + i * image::kJoinBytes; };
  uint32_t join =
      image::FirstNot(joins.count, [&](uint32_t i) { return ReadU16(join_at(i)) < begin; });
  const uint8_t* states = bytes + SectionOf(bytes, Section::kStates).begin;
  // As the verifier goes: straight on from the beginning, where the arguments are set.
  unsigned set = (1U << info.num_arguments) - 1;
  const uint8_t* code = bytes + info.code_begin;
  for (uint32_t at = 0; at <= pc && at < info.code_size;) {
    if (join < joins.count && ReadU16(join_at(join)) == begin + at) {
      set = ReadU16(states + ReadU16(join_at(join) + 2) * image::kStateBytes);
      ++join;
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
