#include "vm/image/program.h"

#include "vm/image/image.h"

namespace morphbus::vm {

static_assert(image::kConstantBytes == 5, "VerifiedProgram::constant reads by it");

// Invocations come from other modules and from people, so nothing is taken for granted.
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
  // Lines are told by offsets in the code section.
  const FunctionInfo& info = functions_[function];
  if (pc >= info.code_size) return 0;
  const uint32_t begin = info.code_begin - code_begin_;
  const uint32_t at = begin + pc;
  // Binary search for the last entry that begins at or before the instruction.
  const uint8_t* lines = bytes_ + lines_begin_;
  const uint32_t after = image::FirstNot(
      num_lines_, [&](uint32_t i) { return image::ReadU32(lines + i * image::kLineBytes) <= at; });
  if (after == 0) return 0;
  // An entry before the function's own code is another function's.
  const uint8_t* entry = lines + (after - 1) * image::kLineBytes;
  return image::ReadU32(entry) >= begin ? image::ReadU16(entry + 4) : 0;
}

int VerifiedProgram::LineOfRole(int role) const {
  // The lowest line among the functions that the role owns.
  const uint8_t* records = bytes_ + image::SectionOf(bytes_, image::Section::kFunctions).begin;
  int first = 0;
  for (int f = 0; f < num_functions_; ++f) {
    const uint32_t record = static_cast<uint32_t>(f) * image::kFunctionBytes;
    if (records[record + image::kFunctionRoleAt] != role) continue;
    const int line = LineOf(f, 0);
    if (line > 0 && (first == 0 || line < first)) first = line;
  }
  return first;
}

}  // namespace morphbus::vm
