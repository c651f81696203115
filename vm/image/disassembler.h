#pragma once
// A program image as text: host side only, for `morphbus disasm`, golden tests and people.

#include <cstdint>
#include <string>

#include "vm/image/opcodes.h"
#include "vm/image/program.h"

namespace morphbus::vm {

/// Everything in the image: header, keywords, constants, roles with their members, and each
/// function's instructions with source lines, jump targets as labels, and operands by name.
std::string Disassemble(const VerifiedProgram& program);

/// The same from bytes; for bytes that the verifier refuses, a line that says why and where.
/// `*ok` (if given) tells which it was.
std::string DisassembleImage(const uint8_t* bytes, uint32_t size, bool* ok = nullptr);

/// One instruction as Disassemble prints it, with one space before the operand: "load_field angle".
/// `pc` is the byte offset of an instruction in the function.
std::string InstructionText(const VerifiedProgram& program, int function, uint32_t pc);

/// The values of a comparison as they would stand in a program, "2 against 9"; the requirement's
/// source says how they were compared. Something was compared.
std::string ComparisonText(const Comparison& comparison, const VerifiedProgram& program);

}  // namespace morphbus::vm
