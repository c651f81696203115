#pragma once
// A checked program as code, function by function.

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "compiler/dynarole/constants.h"
#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {

/// State at a target of jumps, as the image tells the verifier.
struct JoinCode {
  uint16_t offset = 0;
  uint16_t set_locals = 0;
  uint32_t stack_types = 0;
};

struct LineCode {
  uint32_t offset = 0;  ///< In the function.
  uint16_t line = 0;
};

struct FunctionCode {
  std::vector<uint8_t> bytes;
  std::vector<JoinCode> joins;  ///< Sorted by offset.
  std::vector<LineCode> lines;
  int max_stack = 0;
};

/// Everything an image holds beyond the ProgramModel.
struct ProgramCode {
  std::vector<FunctionCode> functions;  ///< One a routine.
  std::vector<std::pair<vm::ValueType, uint32_t>> constants;
};

/// Translates a program that was checked without errors. Reports what is too large for the VM.
ProgramCode Generate(const source::SourceSet& sources, const ProgramModel& model,
                     source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
