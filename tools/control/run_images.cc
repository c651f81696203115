#include "tools/control/run_images.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "compiler/dynarole/parameters.h"
#include "tools/base/files.h"
#include "tools/base/program.h"
#include "tools/plan/control_script.h"
#include "vm/limits.h"

namespace morphbus::tools {
namespace {

/// More than modules run at one time.
constexpr size_t kMostKept = 8;

}  // namespace

RunImages::RunImages(uint64_t own, std::map<uint64_t, std::string> images, std::string folder)
    : own_(own), images_(std::move(images)), folder_(std::move(folder)) {}

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

Result<CompiledProgram> RunImages::WithParameter(uint64_t hash, const std::string& name,
                                                 const std::string& value) {
  const vm::VerifiedProgram* program = Find(hash);
  if (program == nullptr) return Fail("nobody knows the program that runs");
  return dynarole::WithParameter(*program, name, value).map([](std::string image) {
    CompiledProgram compiled;
    compiled.hash = HashOfImage(image);
    compiled.image = std::move(image);
    return compiled;
  });
}

void RunImages::Keep(const CompiledProgram& program) {
  // What the run has from elsewhere, its own image among them, stays as long as it does.
  if (Find(program.hash) != nullptr) return;
  images_.emplace(program.hash, program.image);
  kept_.push_back(program.hash);
  // Who asks a module what it holds looks there for the name of its source; without it the answer
  // has no name.
  if (!folder_.empty()) (void)WriteFile(ImagePath(folder_, program.hash), program.image);
  while (kept_.size() > kMostKept) {
    std::error_code ignored;
    if (!folder_.empty()) std::filesystem::remove(ImagePath(folder_, kept_.front()), ignored);
    verified_.erase(kept_.front());
    images_.erase(kept_.front());
    kept_.pop_front();
  }
}

}  // namespace morphbus::tools
