#pragma once
// Which variables have a value at an instruction, as the verifier has found. Host side only, for
// tools that show them to people.

#include <cstdint>

#include "vm/image/program.h"

namespace morphbus::vm {

/// A bit for each local of the function that has been set on every way to the instruction at byte
/// offset `pc` of it; arguments always are. A variable whose scope has ended may still have its
/// bit, until the next place that can be jumped to.
uint16_t SetLocals(const VerifiedProgram& program, int function, uint32_t pc);

}  // namespace morphbus::vm
