// The notes behind the part of an image that runs: names and source lines, for people.
#include "vm/image/image.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::ReadU64;

// They are those that the header names, so that nobody is told the lines of another program; or
// they have been left out.
bool Verifier::CheckNotes() {
  const uint32_t size = total_ - size_;
  if (size == 0) return true;
  // What holds no notes refuses them, as it could not say whether they are sound.
  if constexpr (!kHoldsNotes) return Fail("this build takes images without notes only", size_);
  const uint32_t notes = size_;
  if (ReadU64(bytes_ + image::kNotesHashAt) != image::HashOfNotes(bytes_ + notes, size)) {
    return Fail("notes are not those of the image", notes);
  }
  if (size < image::kNotesHeadBytes) return Fail("notes are cut off", notes);
  if (ReadU32(bytes_ + notes) != image::kNotesMagic)
    return Fail("not the notes of an image", notes);
  // One name for each function, each field of each role and each local of each function, then the
  // lines, and no more.
  const uint32_t strings = ReadU16(bytes_ + notes + image::kNotesStringsAt);
  const uint32_t fields = ReadU16(bytes_ + notes + image::kNotesFieldsAt);
  const uint32_t locals = ReadU16(bytes_ + notes + image::kNotesLocalsAt);
  const uint32_t lines = ReadU16(bytes_ + notes + image::kNotesLinesAt);
  const uint32_t num_names = static_cast<uint32_t>(out_.num_functions_) + fields + locals;
  const uint32_t names = image::kNotesHeadBytes + strings;
  const uint32_t lines_at = names + num_names * image::kTextBytes;
  if (size != lines_at + lines * image::kLineBytes) return Fail("notes have another size", notes);
  uint32_t fields_of_roles = 0;
  for (int i = 0; i < out_.num_roles_; ++i) fields_of_roles += out_.role(i).num_fields;
  if (fields != fields_of_roles) return Fail("notes name other fields", notes);
  uint32_t locals_of_functions = 0;
  for (int i = 0; i < out_.num_functions_; ++i) locals_of_functions += out_.function(i).num_locals;
  if (locals != locals_of_functions) return Fail("notes name other locals", notes);
  if (!CheckNames(notes, strings, notes + image::kNotesSourceAt, 1) ||
      !CheckNames(notes, strings, notes + names, num_names) ||
      !CheckLines(notes + lines_at, lines)) {
    return false;
  }
  out_.notes_ = bytes_ + notes;
  out_.lines_begin_ = lines_at;
  out_.num_lines_ = lines;
  return true;
}

bool Verifier::CheckNames(uint32_t notes, uint32_t strings, uint32_t names, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t at = names + i * image::kTextBytes;
    if (!CheckText(notes + image::kNotesHeadBytes, strings, ReadU16(bytes_ + at), bytes_[at + 2],
                   at)) {
      return false;
    }
  }
  return true;
}

// Lines are sorted by the code that they begin at, so that LineOf can search by halving.
bool Verifier::CheckLines(uint32_t begin, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t at = begin + i * image::kLineBytes;
    // A line begins at a byte of the code.
    if (ReadU16(bytes_ + at) >= out_.code_size_) return Fail("line of no instruction", at);
    if (i > 0 && ReadU16(bytes_ + at) <= ReadU16(bytes_ + at - image::kLineBytes)) {
      return Fail("lines are not sorted", at);
    }
  }
  return true;
}

}  // namespace morphbus::vm
