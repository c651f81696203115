#include "tools/control/run_images.h"

#include <utility>

#include "compiler/dynarole/parameters.h"
#include "tools/base/files.h"
#include "tools/base/program.h"
#include "tools/plan/control_script.h"
#include "vm/limits.h"

namespace morphbus::tools {

RunImages::RunImages(uint64_t own, std::map<uint64_t, std::string> images, std::string folder)
    : own_(own), newest_(own), images_(std::move(images)), folder_(std::move(folder)) {}

const vm::VerifiedProgram* RunImages::Find(uint64_t hash) {
  // A module that has not been heard of yet runs what it was started with.
  if (hash == 0) hash = own_;
  const auto known = verified_.find(hash);
  if (known != verified_.end()) return known->second.program.get();
  // What a tool hands over lies in the run's folder, under its hash.
  auto image = std::make_unique<std::string>();
  if (const auto given = images_.find(hash); given != images_.end()) {
    *image = given->second;
  } else if (!folder_.empty()) {
    *image = ReadFile(ImagePath(folder_, hash), vm::kMaxImageBytes).value_or("");
  }
  // The hash is that of the bytes, and the verifier has the last word.
  auto program = VerifyProgram(*image);
  if (!program || (*program)->hash() != hash) return nullptr;
  images_.erase(hash);
  Verified& verified = verified_[hash] = {std::move(image), std::move(*program)};
  return verified.program.get();
}

const std::string& RunImages::Image(uint64_t hash) const {
  static const std::string none;
  const auto known = verified_.find(hash);
  return known == verified_.end() ? none : *known->second.image;
}

Result<uint64_t> RunImages::WithParameter(const std::string& name, const std::string& value) {
  const vm::VerifiedProgram* program = Find(newest_);
  if (program == nullptr) return Fail("nobody knows the program that runs");
  Result<std::string> image = dynarole::WithParameter(*program, name, value);
  if (!image) return tl::unexpected(image.error());
  const auto verified = VerifyProgram(*image);
  if (!verified) return tl::unexpected(verified.error());
  const uint64_t hash = (*verified)->hash();
  if (!verified_.contains(hash)) images_.emplace(hash, std::move(*image));
  // Find verifies it once more, where it stays.
  return Find(hash) == nullptr ? Result<uint64_t>(Fail("its image cannot be verified")) : hash;
}

}  // namespace morphbus::tools
