#include "vm/image/note_checks.h"

#include <initializer_list>

#include "vm/image/image.h"
#include "vm/image/table_checks.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::ReadU64;

namespace {

/// The names whose records begin at this byte of the image.
bool CheckNoteNames(const VerifiedProgram& program, image::SectionRange strings, uint32_t begin,
                    uint32_t count, FirstError* error) {
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t at = begin + i * image::kTextBytes;
    const uint8_t* record = program.bytes() + at;
    if (!CheckText(program, strings, ReadU16(record), record[2], at, error)) return false;
  }
  return true;
}

/// Lines are sorted by the code that they begin at, so that LineOf can search by halving.
bool CheckNoteLines(const VerifiedProgram& program, uint32_t begin, uint32_t count,
                    FirstError* error) {
  const uint8_t* bytes = program.bytes();
  const uint32_t code_size = SectionOf(bytes, image::Section::kCode).count;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t at = begin + i * image::kLineBytes;
    // A line begins at a byte of the code.
    if (ReadU16(bytes + at) >= code_size) return error->Fail("line of no instruction", at);
    if (i > 0 && ReadU16(bytes + at) <= ReadU16(bytes + at - image::kLineBytes)) {
      return error->Fail("lines are not sorted", at);
    }
  }
  return true;
}

/// The files behind the lines: names and where their lines begin, behind those of the program's own
/// file, sorted.
bool CheckFiles(const VerifiedProgram& program, image::SectionRange strings, uint32_t begin,
                uint32_t count, FirstError* error) {
  uint32_t last = 1;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t at = begin + i * image::kImportedFileBytes;
    const uint8_t* record = program.bytes() + at;
    if (ReadU16(record) <= last) return error->Fail("files are not sorted", at);
    last = ReadU16(record);
    if (!CheckText(program, strings, ReadU16(record + 2), record[4], at, error)) return false;
  }
  return true;
}

/// Numbers of a parameter's type, in order.
bool InOrder(ValueType type, Cell least, Cell value, Cell most) {
  if (type == ValueType::kInt) {
    return least.AsInt() <= value.AsInt() && value.AsInt() <= most.AsInt();
  }
  return least.AsFloat() <= value.AsFloat() && value.AsFloat() <= most.AsFloat();
}

/// The ranges of parameters, which begin at this byte: the value of the source and that of the
/// image lie in them.
bool CheckParameters(const VerifiedProgram& program, uint32_t begin, FirstError* error) {
  uint32_t at = begin;
  for (int i = 0; i < program.num_constants(); ++i) {
    if (!program.is_parameter(i)) continue;
    const ValueType type = program.constant_type(i);
    const uint8_t* record = program.bytes() + at;
    const Cell source{ReadU32(record)}, least{ReadU32(record + 4)}, most{ReadU32(record + 8)};
    for (const Cell cell : {source, least, most}) {
      if (!IsValueOf(type, cell, 0)) return error->Fail("range of a parameter is no number", at);
    }
    if (!InOrder(type, least, source, most) || !InOrder(type, least, program.constant(i), most)) {
      return error->Fail("parameter is out of its range", at);
    }
    at += image::kParameterBytes;
  }
  return true;
}

}  // namespace

bool CheckNotes(const VerifiedProgram& program, uint32_t total, NoteLines* lines,
                FirstError* error) {
  const uint32_t at = program.run_size();
  const uint32_t size = total - at;
  if (size == 0) return true;
  // What holds no notes refuses them, as it could not say whether they are sound.
  if constexpr (!kHoldsNotes) return error->Fail("this build takes images without notes only", at);
  // The image has a hash of the notes, so that they can be dropped but not exchanged.
  const uint8_t* notes = program.bytes() + at;
  if (ReadU64(program.bytes() + image::kNotesHashAt) != image::HashOfNotes(notes, size)) {
    return error->Fail("notes are not those of the image", at);
  }
  if (size < image::kNotesHeadBytes) return error->Fail("notes are cut off", at);
  if (ReadU32(notes) != image::kNotesMagic) return error->Fail("not the notes of an image", at);
  // One name for each function, each field of each role, each local of each function and each
  // parameter, then the ranges of parameters, the lines, and the imported files.
  const image::SectionRange strings{at + image::kNotesHeadBytes,
                                    ReadU16(notes + image::kNotesStringsAt)};
  const uint32_t fields = ReadU16(notes + image::kNotesFieldsAt);
  const uint32_t locals = ReadU16(notes + image::kNotesLocalsAt);
  uint32_t parameters = 0;
  for (int i = 0; i < program.num_constants(); ++i) parameters += program.is_parameter(i) ? 1u : 0u;
  const uint32_t num_names =
      static_cast<uint32_t>(program.num_functions()) + fields + locals + parameters;
  const uint32_t names = image::kNotesHeadBytes + strings.count;
  const uint32_t ranges = names + num_names * image::kTextBytes;
  *lines = {ranges + parameters * image::kParameterBytes, ReadU16(notes + image::kNotesLinesAt)};
  // What is behind the lines tells of imported files.
  const uint32_t files = lines->begin + lines->count * image::kLineBytes;
  if (size < files || (size - files) % image::kImportedFileBytes != 0) {
    return error->Fail("notes have another size", at);
  }
  // Names are found by counting; so there must be one for each that is counted.
  uint32_t fields_of_roles = 0;
  for (int i = 0; i < program.num_roles(); ++i) fields_of_roles += program.role(i).num_fields;
  if (fields != fields_of_roles) return error->Fail("notes name other fields", at);
  uint32_t locals_of_functions = 0;
  for (int i = 0; i < program.num_functions(); ++i) {
    locals_of_functions += program.function(i).num_locals;
  }
  if (locals != locals_of_functions) return error->Fail("notes name other locals", at);
  // The head's own name, that of the source, is checked like all others.
  return CheckNoteNames(program, strings, at + image::kNotesSourceAt, 1, error) &&
         CheckNoteNames(program, strings, at + names, num_names, error) &&
         CheckParameters(program, at + ranges, error) &&
         CheckNoteLines(program, at + lines->begin, lines->count, error) &&
         CheckFiles(program, strings, at + files, (size - files) / image::kImportedFileBytes,
                    error);
}

}  // namespace morphbus::vm
