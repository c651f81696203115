#include "vm/image/verifier.h"

#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/print_text.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::ReadU64;
using image::Section;
using image::SectionOf;
using image::SectionRange;

VerifyError Verifier::Verify(const uint8_t* bytes, uint32_t size, VerifiedProgram* out) {
  Verifier verifier(bytes, size, out);
  // The output counts as empty until everything has been checked, and a refused image leaves
  // nothing behind that could be run.
  const auto clear = [out] {
    out->bytes_ = nullptr;
    out->size_ = 0;
    out->notes_ = nullptr;
    out->num_roles_ = out->num_functions_ = out->num_keywords_ = 0;
  };
  clear();
  if (!verifier.Run()) {
    clear();
    return verifier.error_;
  }
  out->size_ = size;
  return {};
}

// The first error is the one that counts; later ones may follow from it.
bool Verifier::Note(const char* message, uint32_t offset) {
  if (error_.message == nullptr) error_ = {message, offset};
  return false;
}

bool Verifier::Refuse(uint32_t offset) { return Note("refused", offset); }

// Tables before code, because code refers to them; calls last, because they need every function.
bool Verifier::Run() {
  return CheckHeader() && CheckSections() && CheckKeywords() && CheckConstants() &&
         CheckFunctions() && CheckRoles() && CheckJoins() && CheckCalls() && CheckEffects() &&
         CheckNotes();
}

// Is it an image of ours, whole and unchanged? The hash is no signature: it tells damage only.
bool Verifier::CheckHeader() {
  // The sizes come first, as everything below reads the header.
  if (size_ < image::kHeaderBytes) return Fail("shorter than a header", size_);
  if (size_ > kMaxImageBytes) return Fail("larger than any image may be", 0);
  if (ReadU32(bytes_) != image::kMagic) return Fail("not a program image", 0);
  if (ReadU16(bytes_ + image::kVersionAt) != image::kVersion) {
    return Fail("image version is not known", image::kVersionAt);
  }
  // What is behind the part that runs are its notes; the checks up to CheckNotes are of that part.
  total_ = size_;
  size_ = ReadU32(bytes_ + image::kSizeAt);
  if (size_ < image::kHeaderBytes || size_ > total_) {
    return Fail("size in the header is not that of the image", image::kSizeAt);
  }
  if (ReadU64(bytes_ + image::kHashAt) != image::HashOf(bytes_, size_)) {
    return Fail("hash does not fit the content", image::kHashAt);
  }
  // What the program is known and run by.
  out_.bytes_ = bytes_;
  out_.hash_ = ReadU64(bytes_ + image::kHashAt);
  out_.budget_ = ReadU32(bytes_ + image::kBudgetAt);
  out_.settle_ticks_ = ReadU16(bytes_ + image::kSettleTicksAt);
  // A budget must let the dearest instruction run and fit the interpreter's signed counter.
  if (out_.budget_ < 100 || out_.budget_ > 10000000) {
    return Fail("instruction budget is out of range", image::kBudgetAt);
  }
  return true;
}

// Sections follow each other without gaps, so nothing can overlap and all checks stay linear. Roles
// have no fixed size: they fill what the others leave, and CheckRoles finds out whether they do.
bool Verifier::CheckSections() {
  const SectionRange roles = SectionOf(bytes_, Section::kRoles);
  uint64_t behind = 0;
  for (int i = static_cast<int>(Section::kStates); i < image::kNumSections; ++i) {
    constexpr uint32_t kBytes[] = {image::kStateBytes, image::kJoinBytes, 1};
    behind += uint64_t{kBytes[i - static_cast<int>(Section::kStates)]} *
              SectionOf(bytes_, static_cast<Section>(i)).count;
  }
  // The sums are of 16-bit counts, so they cannot wrap.
  if (roles.begin + behind > size_)
    return Fail("sections are larger than the image", image::kCountsAt);

  // Where the running VM looks things up.
  const SectionRange code = SectionOf(bytes_, Section::kCode);
  const SectionRange constants = SectionOf(bytes_, Section::kConstants);
  out_.code_begin_ = code.begin;
  out_.code_size_ = code.count;
  out_.constants_begin_ = constants.begin;
  out_.num_constants_ = constants.count;
  out_.keywords_begin_ = SectionOf(bytes_, Section::kKeywords).begin;
  out_.types_begin_ = SectionOf(bytes_, Section::kTypes).begin;
  out_.functions_begin_ = SectionOf(bytes_, Section::kFunctions).begin;
  return true;
}

// Texts are printed to terminals and logs, so control characters are refused.
bool Verifier::CheckText(uint32_t strings, uint32_t count, uint32_t offset, uint32_t size,
                         uint32_t at) {
  // The text must lie within the strings, and be printable.
  if (offset + size > count) return Fail("text lies outside the strings", at);
  const uint8_t* begin = bytes_ + strings + offset;
  for (uint32_t i = 0; i < size; ++i) {
    if (begin[i] < 0x20 || begin[i] == 0x7f) return Fail("control character in a text", at);
  }
  return true;
}

bool Verifier::CheckName(uint32_t at) {
  const SectionRange strings = SectionOf(bytes_, Section::kStrings);
  if (bytes_[at + 2] == 0) return Fail("empty name", at);
  return CheckText(strings.begin, strings.count, ReadU16(bytes_ + at), bytes_[at + 2], at);
}

bool Verifier::CheckKeywords() {
  const SectionRange range = SectionOf(bytes_, Section::kKeywords);
  if (range.count > kMaxKeywords) return Fail("too many keywords", range.begin);
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kKeywordBytes;
    if (bytes_[at] > static_cast<uint8_t>(KeywordKind::kSensorKind)) {
      // Kinds are numbers here; only known ones become a KeywordKind.
      return Fail("unknown kind of keyword", at);
    }
    if (!CheckName(at + 1)) return false;
  }
  out_.num_keywords_ = static_cast<int>(range.count);
  return true;
}

bool Verifier::CheckConstants() {
  const SectionRange range = SectionOf(bytes_, Section::kConstants);
  // A role is a value too, so the number of roles is needed.
  const int num_roles = static_cast<int>(SectionOf(bytes_, Section::kRoles).count);
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kConstantBytes;
    if (bytes_[at] == static_cast<uint8_t>(ValueType::kText)) {
      // Texts are printed with values, whose places must be sound.
      const SectionRange strings = SectionOf(bytes_, Section::kStrings);
      const uint32_t size = ReadU16(bytes_ + at + 3);
      if (size > 255) return Fail("text is too long", at);
      if (!CheckText(strings.begin, strings.count, ReadU16(bytes_ + at + 1), size, at)) {
        return false;
      }
      PrintPlaces places;
      if (!FindPlaces(out_.text(static_cast<int>(i)), &places)) {
        return Fail("bad place of a value in a text", at);
      }
      continue;
    }
    if (!IsValueOf(static_cast<ValueType>(bytes_[at]), Cell{ReadU32(bytes_ + at + 1)}, num_roles)) {
      return Fail("constant is not a value of its type", at);
    }
  }
  return true;
}

bool Verifier::CheckFunctions() {
  const SectionRange range = SectionOf(bytes_, Section::kFunctions);
  if (range.count > kMaxFunctions) return Fail("too many functions", range.begin);
  // Each function's code must follow that of the one before it, so they are checked in order.
  out_.num_functions_ = static_cast<int>(range.count);
  if (range.count == 0 && out_.code_size_ > 0) return Fail("code of no function", range.begin);
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!CheckFunction(i, range.begin + static_cast<uint32_t>(i) * image::kFunctionBytes)) {
      return false;
    }
  }
  return true;
}

bool Verifier::CheckFunction(int index, uint32_t at) {
  if (bytes_[at + image::kFunctionRoleAt] >= SectionOf(bytes_, Section::kRoles).count) {
    return Fail("function of a role that does not exist", at + image::kFunctionRoleAt);
  }
  // Functions share no code and leave no gaps: each ends where the next begins.
  const SectionRange code = SectionOf(bytes_, Section::kCode);
  const uint32_t begin = ReadU16(bytes_ + at);
  const bool last = index == out_.num_functions_ - 1;
  const uint32_t end = last ? code.count : ReadU16(bytes_ + at + image::kFunctionBytes);
  if ((index == 0 && begin != 0) || end < begin || end > code.count) {
    return Fail("code of a function is out of place", at);
  }
  // Types are numbers here; only known ones become a ValueType.
  const FunctionInfo info = out_.function(index);
  if (ReadU16(bytes_ + at + image::kFunctionSignatureAt) >> 14 != 0 ||
      static_cast<int>(info.return_type) >= kNumValueTypes) {
    return Fail("unknown return type", at + image::kFunctionSignatureAt);
  }
  if (info.num_locals > image::kMaxLocals || info.num_arguments > info.num_locals) {
    return Fail("too many locals or arguments", at + image::kFunctionSignatureAt);
  }
  const SectionRange types = SectionOf(bytes_, Section::kTypes);
  if (ReadU16(bytes_ + at + image::kFunctionTypesAt) + uint32_t{info.num_locals} > types.count) {
    return Fail("types of locals lie outside the types", at + image::kFunctionTypesAt);
  }
  for (int i = 0; i < info.num_locals; ++i) {
    const auto type = static_cast<int>(info.local_types[i]);
    if (type == 0 || type >= kNumValueTypes) {
      return Fail("bad type of a local", at + image::kFunctionTypesAt);
    }
  }
  return true;
}

// The states that joins name, then the joins, sorted by the code that they lie in; each belongs to
// the function around it.
bool Verifier::CheckJoins() {
  const SectionRange states = SectionOf(bytes_, Section::kStates);
  for (uint32_t i = 0; i < states.count; ++i) {
    const uint32_t at = states.begin + i * image::kStateBytes;
    // Types lie from the bottom of the stack up; above its top there are none.
    bool above_top = false;
    for (uint32_t types = ReadU32(bytes_ + at + 2), k = 0; k < 8; ++k, types >>= 4) {
      const uint32_t type = types & 15;
      if (type >= kNumValueTypes || (above_top && type != 0)) {
        return Fail("bad stack types of a join", at);
      }
      above_top = above_top || type == 0;
    }
  }
  const SectionRange range = SectionOf(bytes_, Section::kJoins);
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kJoinBytes;
    if (ReadU16(bytes_ + at + 2) >= states.count) return Fail("join of no state", at);
    if (i > 0 && ReadU16(bytes_ + at) <= ReadU16(bytes_ + at - image::kJoinBytes)) {
      return Fail("joins are not sorted", at);
    }
  }
  // The code is checked against the joins, so all of them must be sound by now.
  uint32_t next_join = 0;
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!CheckCode(i, &next_join)) return false;
  }
  return next_join == range.count || Fail("jump outside the function", range.begin);
}

}  // namespace morphbus::vm
