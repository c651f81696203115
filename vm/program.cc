#include "vm/program.h"

#include "vm/image.h"

namespace morphbus::vm {

static_assert(image::kConstantBytes == 5, "VerifiedProgram::constant reads by it");

bool VerifiedProgram::AcceptsArguments(int function, const Cell* arguments, int count) const {
  if (function < 0 || function >= num_functions_) return false;
  const FunctionInfo& info = functions_[function];
  if (count != info.num_arguments) return false;
  for (int i = 0; i < count; ++i) {
    if (!IsValueOf(info.local_types[i], arguments[i], num_roles_)) return false;
  }
  return true;
}

bool VerifiedProgram::IsA(int role, int ancestor) const {
  // Parents form a forest (the verifier checks depths), so this ends.
  while (role >= 0 && role != ancestor) role = roles_[role].parent;
  return role >= 0;
}

int VerifiedProgram::LineOf(int function, uint32_t pc) const {
  if (function < 0 || function >= num_functions_) return 0;
  const FunctionInfo& info = functions_[function];
  if (pc >= info.code_size) return 0;
  const uint32_t begin = info.code_begin - code_begin_;
  const uint32_t at = begin + pc;
  // Binary search for the last entry that begins at or before the instruction.
  uint32_t low = 0, high = num_lines_;
  while (low < high) {
    const uint32_t middle = low + (high - low) / 2;
    if (image::ReadU32(bytes_ + lines_begin_ + middle * image::kLineBytes) <= at) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == 0) return 0;
  const uint8_t* entry = bytes_ + lines_begin_ + (low - 1) * image::kLineBytes;
  return image::ReadU32(entry) >= begin ? image::ReadU16(entry + 4) : 0;
}

}  // namespace morphbus::vm
