#include "vm/image/verifier.h"

#include "vm/image/image.h"
#include "vm/image/opcodes.h"

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
bool Verifier::Fail(const char* message, uint32_t offset) {
  if (error_.message == nullptr) error_ = {message, offset};
  return false;
}

// Tables before code, because code refers to them; calls last, because they need every function.
bool Verifier::Run() {
  return CheckHeader() && CheckSections() && CheckKeywords() && CheckConstants() &&
         CheckFunctions() && CheckRoles() && CheckJoins() && CheckLines() && CheckCalls() &&
         CheckEffects();
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
  if (ReadU32(bytes_ + image::kSizeAt) != size_) {
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

// Sections follow each other without gaps, so nothing can overlap and all checks stay linear. Where
// the roles end is known only after parsing them; CheckRoles compares.
bool Verifier::CheckSections() {
  constexpr uint32_t kRecordBytes[image::kNumSections] = {
      1, image::kKeywordBytes, image::kConstantBytes, image::kFunctionBytes, 0, image::kJoinBytes,
      1, image::kLineBytes};
  uint32_t expected = image::kHeaderBytes;
  for (int i = 0; i < image::kNumSections; ++i) {
    // Roles have no fixed size, so where the joins begin is not known yet.
    const SectionRange range = SectionOf(bytes_, static_cast<Section>(i));
    const uint32_t at = image::kSectionsAt + 8 * static_cast<uint32_t>(i);
    if (i != static_cast<int>(Section::kJoins) && range.begin != expected) {
      return Fail("sections leave a gap or overlap", at);
    }
    if (range.begin > size_ || range.begin < expected) {
      return Fail("section begins outside the image", at);
    }
    if (range.count > size_) return Fail("section is larger than the image", at + 4);
    // The sum is wider than its parts, so it cannot wrap.
    const uint64_t end = range.begin + uint64_t{kRecordBytes[i]} * range.count;
    if (end > size_) return Fail("section ends outside the image", at + 4);
    expected = static_cast<uint32_t>(end);
  }
  if (expected != size_) return Fail("bytes after the last section", expected);

  // Where the running VM looks things up.
  const SectionRange code = SectionOf(bytes_, Section::kCode);
  const SectionRange lines = SectionOf(bytes_, Section::kLines);
  const SectionRange constants = SectionOf(bytes_, Section::kConstants);
  out_.code_begin_ = code.begin;
  out_.lines_begin_ = lines.begin;
  out_.num_lines_ = lines.count;
  out_.constants_begin_ = constants.begin;
  out_.num_constants_ = constants.count;
  return CheckText(image::kSourceNameAt, &out_.source_name_);
}

// Texts are printed to terminals and logs, so control characters are refused.
bool Verifier::CheckText(uint32_t at, Text* text) {
  const SectionRange strings = SectionOf(bytes_, Section::kStrings);
  // The text must lie within the strings, and be printable.
  const uint32_t offset = ReadU16(bytes_ + at);
  const uint32_t size = ReadU16(bytes_ + at + 2);
  if (offset + size > strings.count) return Fail("text lies outside the strings", at);
  if (size > 255) return Fail("text is too long", at);
  const uint8_t* begin = bytes_ + strings.begin + offset;
  for (uint32_t i = 0; i < size; ++i) {
    if (begin[i] < 0x20 || begin[i] == 0x7f) return Fail("control character in a text", at);
  }
  *text = {reinterpret_cast<const char*>(begin), static_cast<uint16_t>(size)};
  return true;
}

bool Verifier::CheckKeywords() {
  const SectionRange range = SectionOf(bytes_, Section::kKeywords);
  if (range.count > kMaxKeywords) return Fail("too many keywords", range.begin);
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kKeywordBytes;
    if (bytes_[at] > static_cast<uint8_t>(KeywordKind::kConnectorState)) {
      // Kinds are numbers here; only known ones become a KeywordKind.
      return Fail("unknown kind of keyword", at);
    }
    out_.keywords_[i].kind = static_cast<KeywordKind>(bytes_[at]);
    if (!CheckText(at + 1, &out_.keywords_[i].name)) return false;
    if (out_.keywords_[i].name.size == 0) return Fail("keyword without a name", at);
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
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!CheckFunction(i, range.begin + static_cast<uint32_t>(i) * image::kFunctionBytes)) {
      return false;
    }
  }
  return true;
}

bool Verifier::CheckFunction(int index, uint32_t at) {
  FunctionInfo& info = out_.functions_[index];
  info = {};
  if (!CheckText(at, &info.name)) return false;
  if (bytes_[at + image::kFunctionRoleAt] >= SectionOf(bytes_, Section::kRoles).count) {
    return Fail("function of a role that does not exist", at + image::kFunctionRoleAt);
  }
  // Types are numbers here; only known ones become a ValueType.
  const uint8_t return_type = bytes_[at + image::kFunctionReturnAt];
  info.num_arguments = bytes_[at + image::kFunctionArgumentsAt];
  info.num_locals = bytes_[at + image::kFunctionLocalsAt];
  if (return_type >= kNumValueTypes) {
    return Fail("unknown return type", at + image::kFunctionReturnAt);
  }
  info.return_type = static_cast<ValueType>(return_type);
  if (info.num_locals > image::kMaxLocals || info.num_arguments > info.num_locals) {
    return Fail("too many locals or arguments", at + image::kFunctionLocalsAt);
  }
  for (int i = 0; i < image::kMaxLocals; ++i) {
    const uint32_t type_at = at + image::kFunctionTypesAt + static_cast<uint32_t>(i);
    const uint8_t type = bytes_[type_at];
    // A local has a type, and what is no local has none.
    const bool used = i < info.num_locals;
    if (type >= kNumValueTypes || (type != 0) != used) {
      return Fail("bad type of a local", type_at);
    }
    info.local_types[i] = static_cast<ValueType>(type);
  }
  // Functions share no code and leave no gaps.
  const SectionRange code = SectionOf(bytes_, Section::kCode);
  const uint32_t begin = ReadU32(bytes_ + at + image::kFunctionCodeAt);
  info.code_size = ReadU32(bytes_ + at + image::kFunctionCodeSizeAt);
  const FunctionInfo* previous = index > 0 ? &out_.functions_[index - 1] : nullptr;
  const uint32_t expected =
      previous != nullptr ? previous->code_begin - code.begin + previous->code_size : 0;
  if (begin != expected || info.code_size > code.count - begin ||
      info.code_size > image::kMaxFunctionBytes) {
    return Fail("code of a function is out of place", at + image::kFunctionCodeAt);
  }
  info.code_begin = code.begin + begin;
  if (index == out_.num_functions_ - 1 && begin + info.code_size != code.count) {
    return Fail("code after the last function", at + image::kFunctionCodeAt);
  }
  return true;
}

// Joins of the functions follow each other like their code; each function's are sorted.
bool Verifier::CheckJoins() {
  const SectionRange range = SectionOf(bytes_, Section::kJoins);
  const SectionRange functions = SectionOf(bytes_, Section::kFunctions);
  uint32_t expected = 0;
  for (uint32_t i = 0; i < functions.count; ++i) {
    const uint32_t at = functions.begin + i * image::kFunctionBytes;
    // A function's joins are a run of the table.
    const uint32_t first = ReadU16(bytes_ + at + image::kFunctionFirstJoinAt);
    const uint32_t count = ReadU16(bytes_ + at + image::kFunctionJoinsAt);
    if (first != expected || count > range.count - first) {
      return Fail("joins of a function are out of place", at + image::kFunctionFirstJoinAt);
    }
    expected += count;
    for (uint32_t j = 0; j < count; ++j) {
      const uint32_t join = range.begin + (first + j) * image::kJoinBytes;
      if (j > 0 && ReadU16(bytes_ + join) <= ReadU16(bytes_ + join - image::kJoinBytes)) {
        return Fail("joins are not sorted", join);
      }
      // Types lie from the bottom of the stack up; above its top there are none.
      bool above_top = false;
      for (uint32_t types = ReadU32(bytes_ + join + 4), k = 0; k < 8; ++k, types >>= 4) {
        const uint32_t type = types & 15;
        if (type >= kNumValueTypes || (above_top && type != 0)) {
          return Fail("bad stack types of a join", join);
        }
        above_top = above_top || type == 0;
      }
    }
  }
  if (expected != range.count) return Fail("joins of no function", range.begin);
  // The code is checked against the joins, so all of them must be sound by now.
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!CheckCode(i)) return false;
  }
  return true;
}

// Lines are sorted by the code that they begin at, so that LineOf can search by halving.
bool Verifier::CheckLines() {
  const SectionRange range = SectionOf(bytes_, Section::kLines);
  const SectionRange code = SectionOf(bytes_, Section::kCode);
  for (uint32_t i = 0; i < range.count; ++i) {
    const uint32_t at = range.begin + i * image::kLineBytes;
    // A line begins at a byte of the code.
    if (ReadU32(bytes_ + at) >= code.count) return Fail("line of no instruction", at);
    if (i > 0 && ReadU32(bytes_ + at) <= ReadU32(bytes_ + at - image::kLineBytes)) {
      return Fail("lines are not sorted", at);
    }
  }
  return true;
}

}  // namespace morphbus::vm
