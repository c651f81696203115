#pragma once
// A checked program as code, function by function.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "compiler/dynarole/constants.h"
#include "compiler/dynarole/numbered.h"
#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {

/// State at a target of jumps, as the image tells the verifier: what holds on every way there.
struct JoinCode {
  uint16_t offset = 0;  ///< Of the target in its function, bytes.
  /// Bit i is set if local i has a value on every way to the target; others may not be read behind
  /// it.
  uint16_t set_locals = 0;
  /// Types of the operands on the stack, 4 bits each, the deepest in the lowest bits.
  uint32_t stack_types = 0;
};

/// Where the code of a source line begins, so that a fault can name the line. The entry holds up to
/// the next one.
struct LineCode {
  uint32_t offset = 0;  ///< In the function, bytes.
  /// 1-based; 65535 for all lines beyond, which 16 bits cannot count.
  uint16_t line = 0;
};

/// The code of one routine, as the image writer puts it into the image. Offsets are in bytes from
/// the function's first instruction.
struct FunctionCode {
  std::vector<uint8_t> bytes;   ///< Instructions as vm/image/opcodes.def lays them out.
  std::vector<JoinCode> joins;  ///< Sorted by offset.
  std::vector<LineCode> lines;  ///< Sorted by offset.
  /// The most operands that are on the stack at one time; a frame has room for so many.
  int max_stack = 0;
};

/// An entry in the table of constants.
struct ConstantEntry {
  vm::ValueType type = vm::ValueType::kVoid;
  uint32_t bits = 0;  ///< Of a text its number among the texts.
  /// Of a parameter its index in ProgramModel::constants, so that no two share an entry; else -1.
  int parameter = -1;
  /// Of what a kept field begins with, and of the text behind it, which is the field's name: the
  /// field's index in ProgramModel::fields; else -1.
  int kept = -1;

  auto operator<=>(const ConstantEntry&) const = default;
};

/// Everything an image holds beyond the ProgramModel.
struct ProgramCode {
  /// The function at i is that of the routine i.
  std::vector<FunctionCode> functions;
  /// The table of constants: parameters, periods of timers, and what the code needs.
  Numbered<ConstantEntry> constants;
  /// The texts that are printed.
  Numbered<std::string> texts;
  /// Which constant is the period of a timer, by routine; -1 for all others.
  std::vector<int> periods;
};

/// The entry of a parameter: its value in the source.
inline ConstantEntry EntryOf(const ProgramModel& model, int parameter) {
  const ConstantModel& constant = model.constants[parameter];
  return {ValueTypeOf(constant.type), constant.cell.bits, parameter};
}

/// Translates a program that Check found no errors in. What is too large for the virtual machine is
/// an error in `diagnostics`: a function's code, an expression's operands, the cells that a task
/// needs for nested calls (as the verifier counts them), the number of constants.
/// @param sources  the program's text, for line numbers.
/// @returns        one function a routine, in the order of ProgramModel::routines.
ProgramCode Generate(const source::SourceSet& sources, const ProgramModel& model,
                     source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
