#include "bridge/module/module_images.h"

#include <utility>

#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"

namespace morphbus::bridge {
namespace {

/// The verifier's verdict on an image.
Result<void> ToResult(const std::string& name, const vm::VerifyError& error) {
  if (error.message == nullptr) return {};
  return Fail(name + " is not a usable image: at byte " + std::to_string(error.offset) + ": " +
              error.message);
}

}  // namespace

Result<void> ModuleImages::AddProgram(const std::string& name, std::vector<uint8_t> bytes) {
  // The bytes are kept first, because what the verifier makes points into them.
  program_bytes_ = std::move(bytes);
  const auto size = static_cast<uint32_t>(program_bytes_.size());
  return ToResult(name, vm::Verifier::Verify(program_bytes_.data(), size, &program_));
}

Result<void> ModuleImages::AddKinematics(const std::string& name, std::vector<uint8_t> bytes) {
  Kinematics& entry = kinematics_[name];
  entry.bytes = std::move(bytes);
  const auto size = static_cast<uint32_t>(entry.bytes.size());
  Result<void> sound =
      ToResult(name, vm::VerifyKinematics(entry.bytes.data(), size, &entry.verified));
  // A type without a sound image is one that nobody knows.
  if (!sound) kinematics_.erase(name);
  return sound;
}

const vm::VerifiedKinematics* ModuleImages::FindKinematics(const std::string& name) const {
  const auto found = kinematics_.find(name);
  return found == kinematics_.end() ? nullptr : &found->second.verified;
}

}  // namespace morphbus::bridge
