#include "tools/program.h"

#include <fmt/format.h>

#include <cstring>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/module_keywords.h"
#include "vm/image.h"
#include "vm/verifier.h"

namespace morphbus::tools {
namespace {

const uint8_t* Bytes(const std::string& text) {
  return reinterpret_cast<const uint8_t*>(text.data());
}

bool IsImage(const std::string& bytes) {
  return bytes.size() >= 4 && vm::image::ReadU32(Bytes(bytes)) == vm::image::kMagic;
}

Error Damaged(const char* what, const vm::VerifyError& error) {
  return {fmt::format("the {} image is damaged: {} (byte {})", what, error.message, error.offset)};
}

}  // namespace

Result<dynarole::KeywordTable> KeywordTableOf(const std::vector<emit::ModuleKeywords>& types) {
  if (types.size() > 64) return Fail("a program can know at most 64 module types");
  return dynarole::KeywordTableOf(types);
}

Result<dynarole::KeywordTable> KeywordTableOf(const model::Model& model) {
  std::vector<emit::ModuleKeywords> types;
  for (const model::ModuleType& type : model.module_types) {
    Result<emit::ModuleKeywords> keywords = emit::KeywordsOf(type);
    if (!keywords) return Fail(keywords.error().message);
    types.push_back(std::move(*keywords));
  }
  return KeywordTableOf(types);
}

std::optional<CompiledProgram> CompileProgram(const std::string& path,
                                              const dynarole::KeywordTable& keywords) {
  Result<std::string> text = ReadFile(path, size_t{64} << 20);
  if (!text) {
    Unusable(text.error().message);
    return std::nullopt;
  }
  CompiledProgram program;
  if (IsImage(*text)) {
    program.image = std::move(*text);
  } else {
    const dynarole::CompileResult result = dynarole::CompileProgram(path, *text, keywords);
    PrintDiagnostics(result.diagnostics, result.sources);
    if (!result.image) return std::nullopt;
    program.image.assign(result.image->begin(), result.image->end());
  }
  const Result<std::unique_ptr<vm::VerifiedProgram>> verified = VerifyProgram(program.image);
  if (!verified) {
    Unusable(path + ": " + verified.error().message);
    return std::nullopt;
  }
  program.hash = (*verified)->hash();
  return program;
}

std::optional<CompiledProgram> CompileProgram(const std::string& path, const model::Model& model) {
  const Result<dynarole::KeywordTable> keywords = KeywordTableOf(model);
  if (keywords) return CompileProgram(path, *keywords);
  Unusable(keywords.error().message);
  return std::nullopt;
}

Result<std::unique_ptr<vm::VerifiedProgram>> VerifyProgram(const std::string& image) {
  auto program = std::make_unique<vm::VerifiedProgram>();
  const vm::VerifyError error =
      vm::Verifier::Verify(Bytes(image), static_cast<uint32_t>(image.size()), program.get());
  if (error.message != nullptr) return tl::unexpected(Damaged("program", error));
  return program;
}

Result<std::unique_ptr<vm::VerifiedKinematics>> VerifyKinematicsImage(const std::string& image) {
  auto kinematics = std::make_unique<vm::VerifiedKinematics>();
  const vm::VerifyError error =
      vm::VerifyKinematics(Bytes(image), static_cast<uint32_t>(image.size()), kinematics.get());
  if (error.message != nullptr) return tl::unexpected(Damaged("kinematics", error));
  return kinematics;
}

Result<uint64_t> KinematicsHash(const std::string& image) {
  const Result<std::unique_ptr<vm::VerifiedKinematics>> kinematics = VerifyKinematicsImage(image);
  if (!kinematics) return Fail(kinematics.error().message);
  return (*kinematics)->hash();
}

std::string ToString(const vm::Text& text) { return {text.data, text.size}; }

vm::PoseF ToVmPose(const model::Pose& X) {
  Eigen::Quaterniond q(X.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const Eigen::Vector3d& p = X.translation();
  // No negative zeros: the same pose must be the same bytes, however it was come by.
  const auto plain = [](double v) {
    return static_cast<float>(v) == 0.0F ? 0.0F : static_cast<float>(v);
  };
  vm::PoseF out;
  out.p = {plain(p.x()), plain(p.y()), plain(p.z())};
  out.q = {plain(q.w()), plain(q.x()), plain(q.y()), plain(q.z())};
  return out;
}

}  // namespace morphbus::tools
