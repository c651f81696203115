// What an image tells people: names and source lines. A microcontroller need not hold them; there
// the profile leaves this out (vm/limits.h).
#include "vm/image/program.h"

namespace morphbus::vm {

using image::ReadU16;

namespace {

/// Text number i of the names behind the notes' strings.
Text NameOf(const uint8_t* notes, uint32_t i) {
  const uint8_t* strings = notes + image::kNotesHeadBytes;
  const uint8_t* names = strings + ReadU16(notes + image::kNotesStringsAt);
  return TextAt(strings, names + i * image::kTextBytes);
}

}  // namespace

Text VerifiedProgram::source_name() const {
  if (notes_ == nullptr) return {};
  return TextAt(notes_ + image::kNotesHeadBytes, notes_ + image::kNotesSourceAt);
}

Text VerifiedProgram::function_name(int function) const {
  if (notes_ == nullptr) return {};
  return NameOf(notes_, static_cast<uint32_t>(function));
}

Text VerifiedProgram::member_name(int function) const {
  Text name = function_name(function);
  int dot = 0;
  while (dot < name.size && name.data[dot] != '.') ++dot;
  if (dot == name.size) return name;
  return {name.data + dot + 1, static_cast<uint16_t>(name.size - dot - 1)};
}

Text VerifiedProgram::field_name(int role, int field) const {
  if (notes_ == nullptr) return {};
  // The fields of the roles before this one come first.
  auto at = static_cast<uint32_t>(num_functions_);
  for (int i = 0; i < role; ++i) at += this->role(i).num_fields;
  return NameOf(notes_, at + static_cast<uint32_t>(field));
}

Text VerifiedProgram::local_name(int function, int local) const {
  if (notes_ == nullptr) return {};
  // The names of functions and fields come first, then the locals of the functions before this one.
  uint32_t at = static_cast<uint32_t>(num_functions_) + ReadU16(notes_ + image::kNotesFieldsAt);
  for (int i = 0; i < function; ++i) at += this->function(i).num_locals;
  return NameOf(notes_, at + static_cast<uint32_t>(local));
}

int VerifiedProgram::num_parameters() const {
  int count = 0;
  for (int i = 0; notes_ != nullptr && i < num_constants(); ++i) count += is_parameter(i) ? 1 : 0;
  return count;
}

ParameterInfo VerifiedProgram::parameter(int i) const {
  // Their names stand behind those of functions, fields and locals, and their ranges behind all
  // names.
  const uint32_t names = static_cast<uint32_t>(num_functions_) +
                         ReadU16(notes_ + image::kNotesFieldsAt) +
                         ReadU16(notes_ + image::kNotesLocalsAt);
  const uint8_t* ranges =
      notes_ + lines_begin_ - static_cast<uint32_t>(num_parameters()) * image::kParameterBytes;
  const uint8_t* range = ranges + static_cast<uint32_t>(i) * image::kParameterBytes;
  ParameterInfo parameter;
  parameter.name = NameOf(notes_, names + static_cast<uint32_t>(i));
  // The constant that is this parameter: as many parameters stand before it.
  while (!is_parameter(parameter.constant) || i-- > 0) ++parameter.constant;
  parameter.type = constant_type(parameter.constant);
  parameter.value = constant(parameter.constant);
  parameter.source_value = Cell{image::ReadU32(range)};
  parameter.least = Cell{image::ReadU32(range + 4)};
  parameter.most = Cell{image::ReadU32(range + 8)};
  return parameter;
}

int VerifiedProgram::num_imported_files() const {
  if (notes_ == nullptr) return 0;
  const uint32_t files = lines_begin_ + num_lines_ * image::kLineBytes;
  return static_cast<int>((size_ - run_size() - files) / image::kImportedFileBytes);
}

ImportedFile VerifiedProgram::imported_file(int i) const {
  const uint8_t* record = notes_ + lines_begin_ + num_lines_ * image::kLineBytes +
                          static_cast<uint32_t>(i) * image::kImportedFileBytes;
  return {TextAt(notes_ + image::kNotesHeadBytes, record + 2), ReadU16(record)};
}

int VerifiedProgram::LineOf(int function, uint32_t pc) const {
  if (notes_ == nullptr || function < 0 || function >= num_functions_) return 0;
  // Lines are told by offsets in the code section.
  const FunctionInfo info = this->function(function);
  if (pc >= info.code_size) return 0;
  const uint32_t begin = info.code_begin - code_begin_;
  const uint32_t at = begin + pc;
  // Binary search for the last entry that begins at or before the instruction.
  const uint8_t* lines = notes_ + lines_begin_;
  const uint32_t after = image::FirstNot(
      num_lines_, [&](uint32_t i) { return ReadU16(lines + i * image::kLineBytes) <= at; });
  if (after == 0) return 0;
  // An entry before the function's own code is another function's.
  const uint8_t* entry = lines + (after - 1) * image::kLineBytes;
  return ReadU16(entry) >= begin ? ReadU16(entry + 2) : 0;
}

int VerifiedProgram::LineOfRole(int role) const {
  // The lowest line among the functions that the role owns.
  int first = 0;
  for (int f = 0; f < num_functions_; ++f) {
    if (function(f).role != role) continue;
    const int line = LineOf(f, 0);
    if (line > 0 && (first == 0 || line < first)) first = line;
  }
  return first;
}

}  // namespace morphbus::vm
