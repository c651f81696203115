#include "vm/image/verifier.h"

#include "vm/image/call_checker.h"
#include "vm/image/code_checker.h"
#include "vm/image/image.h"
#include "vm/image/join_table.h"
#include "vm/image/note_checks.h"
#include "vm/image/role_checker.h"
#include "vm/image/table_checks.h"

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
    return verifier.error_.error();
  }
  out->size_ = size;
  return {};
}

bool Verifier::Run() {
  // The first that fails is the one that is told.
  return CheckHeader() && CheckSections() && CheckKeywords(out_, &error_) &&
         CheckConstants(out_, &error_) && CheckFunctions(out_, &error_) && CheckRoles() &&
         CheckCode() && CheckCalls() && CheckNotes();
}

// Is it an image of ours, whole and unchanged? The hash is no signature: it tells damage only.
bool Verifier::CheckHeader() {
  // The sizes come first, as everything below reads the header.
  if (size_ < image::kHeaderBytes) return error_.Fail("shorter than a header", size_);
  if (size_ > kMaxImageBytes) return error_.Fail("larger than any image may be", 0);
  if (ReadU32(bytes_) != image::kMagic) return error_.Fail("not a program image", 0);
  if (ReadU16(bytes_ + image::kVersionAt) != image::kVersion) {
    return error_.Fail("image version is not known", image::kVersionAt);
  }
  // What is behind the part that runs are its notes; the checks up to CheckNotes are of that part.
  const uint32_t run_size = ReadU32(bytes_ + image::kSizeAt);
  if (run_size < image::kHeaderBytes || run_size > size_) {
    return error_.Fail("size in the header is not that of the image", image::kSizeAt);
  }
  if (ReadU64(bytes_ + image::kHashAt) != image::HashOf(bytes_, run_size)) {
    return error_.Fail("hash does not fit the content", image::kHashAt);
  }
  // What the program is known and run by.
  out_.bytes_ = bytes_;
  out_.hash_ = ReadU64(bytes_ + image::kHashAt);
  out_.budget_ = ReadU32(bytes_ + image::kBudgetAt);
  out_.settle_ticks_ = ReadU16(bytes_ + image::kSettleTicksAt);
  // A budget must let the dearest instruction run and fit the interpreter's signed counter.
  if (out_.budget_ < 100 || out_.budget_ > 10000000) {
    return error_.Fail("instruction budget is out of range", image::kBudgetAt);
  }
  return true;
}

// Nothing can overlap, so all checks stay linear. Roles have no fixed size: they fill what the
// others leave, and CheckRoles finds out whether they do.
bool Verifier::CheckSections() {
  const SectionRange roles = SectionOf(bytes_, Section::kRoles);
  uint64_t behind = 0;
  for (int i = static_cast<int>(Section::kStates); i < image::kNumSections; ++i) {
    constexpr uint32_t kBytes[] = {image::kStateBytes, image::kJoinBytes, 1};
    behind += uint64_t{kBytes[i - static_cast<int>(Section::kStates)]} *
              SectionOf(bytes_, static_cast<Section>(i)).count;
  }
  // The sums are of 16-bit counts, so they cannot wrap.
  if (roles.begin + behind > out_.run_size()) {
    return error_.Fail("sections are larger than the image", image::kCountsAt);
  }

  // Where the checks and the running VM look things up. What there are too many of is refused
  // before any of it is read.
  const SectionRange code = SectionOf(bytes_, Section::kCode);
  const SectionRange constants = SectionOf(bytes_, Section::kConstants);
  const SectionRange functions = SectionOf(bytes_, Section::kFunctions);
  const SectionRange keywords = SectionOf(bytes_, Section::kKeywords);
  out_.code_begin_ = code.begin;
  out_.code_size_ = code.count;
  out_.constants_begin_ = constants.begin;
  out_.num_constants_ = constants.count;
  out_.functions_begin_ = functions.begin;
  out_.num_functions_ = static_cast<int>(functions.count);
  out_.keywords_begin_ = keywords.begin;
  out_.num_keywords_ = static_cast<int>(keywords.count);
  out_.types_begin_ = SectionOf(bytes_, Section::kTypes).begin;
  out_.num_roles_ = static_cast<int>(roles.count);
  return true;
}

bool Verifier::CheckRoles() {
  const SectionRange range = SectionOf(bytes_, Section::kRoles);
  if (range.count > kMaxRoles) return error_.Fail("too many roles", range.begin);
  // Each record says its own size, so that the next one is found behind it.
  RoleChecker roles(out_, &error_);
  uint32_t at = range.begin;
  for (int i = 0; i < out_.num_roles_; ++i) {
    out_.role_at_[i] = static_cast<uint16_t>(at);
    if (!roles.CheckRecord(i, &at)) return false;
  }
  // Where the last role ends must be where the next section begins.
  if (at != SectionOf(bytes_, Section::kStates).begin) {
    return error_.Fail("roles leave a gap or overlap", at);
  }
  // Only without circles is there a tree, and only with it can be told whose functions a role may
  // use.
  if (!roles.CheckDepths() || !roles.CheckInheritance()) return false;
  tree_.Plant(out_);
  return roles.CheckOwners(tree_);
}

bool Verifier::CheckCode() {
  // The code is checked against the joins, so all of them must be sound by then.
  if (!CheckJoins(out_, &error_)) return false;
  CodeChecker code(out_, tree_, &error_);
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!code.Check(i, &facts_[i])) return false;
  }
  return code.CheckAllJoinsMet();
}

bool Verifier::CheckCalls() {
  CallChecker calls(out_, tree_, facts_, &error_);
  if (!calls.CheckCalls() || !calls.CheckEffects()) return false;
  // Which keywords a role needs is found here and not read, so that it cannot be wrong.
  for (int i = 0; i < out_.num_roles_; ++i) {
    uint64_t used = 0;
    out_.role(i).ForEachFunction([&](int function) { used |= facts_[function].keywords; });
    out_.role_keywords_[i] = used;
  }
  return true;
}

bool Verifier::CheckNotes() {
  NoteLines lines;
  if (!vm::CheckNotes(out_, size_, &lines, &error_)) return false;
  if (out_.run_size() == size_) return true;
  out_.notes_ = bytes_ + out_.run_size();
  out_.lines_begin_ = lines.begin;
  out_.num_lines_ = lines.count;
  return true;
}

}  // namespace morphbus::vm
