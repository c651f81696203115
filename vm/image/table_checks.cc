#include "vm/image/table_checks.h"

#include "vm/image/print_text.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::Section;
using image::SectionOf;
using image::SectionRange;

bool CheckText(const VerifiedProgram& program, SectionRange strings, uint32_t offset, uint32_t size,
               uint32_t at, FirstError* error) {
  // The text must lie within the strings, and be printable.
  if (offset + size > strings.count) return error->Fail("text lies outside the strings", at);
  const uint8_t* begin = program.bytes() + strings.begin + offset;
  for (uint32_t i = 0; i < size; ++i) {
    if (begin[i] < 0x20 || begin[i] == 0x7f) {
      return error->Fail("control character in a text", at);
    }
  }
  return true;
}

bool CheckName(const VerifiedProgram& program, uint32_t at, FirstError* error) {
  // Texts of print may be empty, what is called by a name may not.
  const uint8_t* record = program.bytes() + at;
  if (record[2] == 0) return error->Fail("empty name", at);
  return CheckText(program, SectionOf(program.bytes(), Section::kStrings), ReadU16(record),
                   record[2], at, error);
}

bool CheckKeywords(const VerifiedProgram& program, FirstError* error) {
  // Each keyword has a bit in what roles need.
  const SectionRange range = SectionOf(program.bytes(), Section::kKeywords);
  if (range.count > kMaxKeywords) return error->Fail("too many keywords", range.begin);
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kKeywordBytes;
    // Kinds are numbers here; only known ones become a KeywordKind.
    if (program.bytes()[at] > static_cast<uint8_t>(KeywordKind::kSensorKind)) {
      return error->Fail("unknown kind of keyword", at);
    }
    if (!CheckName(program, at + 1, error)) return false;
  }
  return true;
}

bool CheckConstants(const VerifiedProgram& program, FirstError* error) {
  // Code pushes constants without a look at them, so that each must be sound here.
  const SectionRange range = SectionOf(program.bytes(), Section::kConstants);
  int parameters = 0;
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kConstantBytes;
    const uint8_t* record = program.bytes() + at;
    if (record[0] == static_cast<uint8_t>(ValueType::kText)) {
      // Texts are printed with values, whose places must be sound.
      const uint32_t size = ReadU16(record + 3);
      if (size > 255) return error->Fail("text is too long", at);
      if (!CheckText(program, SectionOf(program.bytes(), Section::kStrings), ReadU16(record + 1),
                     size, at, error)) {
        return false;
      }
      PrintPlaces places;
      if (!FindPlaces(program.text(static_cast<int>(i)), &places)) {
        return error->Fail("bad place of a value in a text", at);
      }
      continue;
    }
    // What a run may choose is a number.
    const ValueType type = program.constant_type(static_cast<int>(i));
    if (program.is_parameter(static_cast<int>(i))) {
      if (type != ValueType::kInt && type != ValueType::kFloat) {
        return error->Fail("parameter is no number", at);
      }
      if (++parameters > image::kMaxParameters) return error->Fail("too many parameters", at);
    }
    // A role is a value too, so the number of roles is needed.
    if (!IsValueOf(type, Cell{ReadU32(record + 1)}, program.num_roles())) {
      return error->Fail("constant is not a value of its type", at);
    }
  }
  return true;
}

namespace {

/// The function of this index, whose record is at `at`.
bool CheckFunction(const VerifiedProgram& program, int index, uint32_t at, FirstError* error) {
  // A function belongs to one role, whose slots its code means.
  const uint8_t* record = program.bytes() + at;
  if (record[image::kFunctionRoleAt] >= program.num_roles()) {
    return error->Fail("function of a role that does not exist", at + image::kFunctionRoleAt);
  }
  // Functions share no code and leave no gaps: each ends where the next begins.
  const SectionRange code = SectionOf(program.bytes(), Section::kCode);
  const uint32_t begin = ReadU16(record);
  const bool last = index == program.num_functions() - 1;
  const uint32_t end = last ? code.count : ReadU16(record + image::kFunctionBytes);
  if ((index == 0 && begin != 0) || end < begin || end > code.count) {
    return error->Fail("code of a function is out of place", at);
  }
  // Types are numbers here; only known ones become a ValueType.
  const FunctionInfo info = program.function(index);
  if (ReadU16(record + image::kFunctionSignatureAt) >> 14 != 0 ||
      static_cast<int>(info.return_type) >= kNumValueTypes) {
    return error->Fail("unknown return type", at + image::kFunctionSignatureAt);
  }
  if (info.num_locals > image::kMaxLocals || info.num_arguments > info.num_locals) {
    return error->Fail("too many locals or arguments", at + image::kFunctionSignatureAt);
  }
  // Functions may share their lists of types, which so need no order.
  const SectionRange types = SectionOf(program.bytes(), Section::kTypes);
  if (ReadU16(record + image::kFunctionTypesAt) + uint32_t{info.num_locals} > types.count) {
    return error->Fail("types of locals lie outside the types", at + image::kFunctionTypesAt);
  }
  for (int i = 0; i < info.num_locals; ++i) {
    const auto type = static_cast<int>(info.local_types[i]);
    // A variable without a type could hold anything.
    if (type == 0 || type >= kNumValueTypes) {
      return error->Fail("bad type of a local", at + image::kFunctionTypesAt);
    }
  }
  return true;
}

}  // namespace

bool CheckFunctions(const VerifiedProgram& program, FirstError* error) {
  const SectionRange range = SectionOf(program.bytes(), Section::kFunctions);
  if (range.count > kMaxFunctions) return error->Fail("too many functions", range.begin);
  // All bytes of code are some function's, so that none escapes the checks.
  if (range.count == 0 && SectionOf(program.bytes(), Section::kCode).count > 0) {
    return error->Fail("code of no function", range.begin);
  }
  // Each function's code must follow that of the one before it, so they are checked in order.
  for (int i = 0; i < program.num_functions(); ++i) {
    const uint32_t at = range.begin + static_cast<uint32_t>(i) * image::kFunctionBytes;
    if (!CheckFunction(program, i, at, error)) return false;
  }
  return true;
}

}  // namespace morphbus::vm
