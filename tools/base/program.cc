#include "tools/base/program.h"

#include <fmt/format.h>

#include <cstring>
#include <set>

#include "compiler/dynarole/compile.h"
#include "compiler/keywords/keyword_table.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "vm/image/image.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"

namespace morphbus::tools {
namespace {

/// The bytes of a string as the VM reads them.
const uint8_t* Bytes(const std::string& text) {
  return reinterpret_cast<const uint8_t*>(text.data());
}

/// An image begins with its magic number, which no program text does.
bool IsImage(const std::string& bytes) {
  return bytes.size() >= 4 && vm::image::ReadU32(Bytes(bytes)) == vm::image::kMagic;
}

/// Says which image is damaged, how, and at which byte.
Error Damaged(const char* what, const vm::VerifyError& error) {
  return {fmt::format("the {} image is damaged: {} (byte {})", what, error.message, error.offset)};
}

}  // namespace

std::optional<CompiledProgram> LoadProgram(
    const std::string& path, const Result<std::vector<keywords::ModuleKeywords>>& types) {
  // One table holds the keywords of all types; more than 64 types do not fit it.
  const Result<keywords::KeywordTable> table = types.and_then(keywords::KeywordTable::Of);
  if (!table) return Refuse(table.error().message);
  // The limit of 64 MiB keeps a wrong path, such as a device, from filling the memory.
  Result<std::string> text = ReadFile(path, size_t{64} << 20);
  if (!text) return Refuse(text.error().message);
  CompiledProgram program;
  // Images run as they are; everything else is taken for source.
  if (IsImage(*text)) {
    program.image = std::move(*text);
  } else {
    const dynarole::CompileResult result = dynarole::CompileProgram(path, *text, *table);
    // Errors and warnings of the program have been found in one pass; errors leave no image.
    PrintDiagnostics(result.diagnostics, result.sources);
    if (!result.image) return std::nullopt;
    program.image.assign(result.image->begin(), result.image->end());
  }
  // An image from a file may be damaged; one that was just compiled is verified in the same way.
  const Result<std::unique_ptr<vm::VerifiedProgram>> verified = VerifyProgram(program.image);
  if (!verified) return Refuse(path + ": " + verified.error().message);
  program.hash = (*verified)->hash();
  return program;
}

Result<std::unique_ptr<vm::VerifiedProgram>> VerifyProgram(const std::string& image) {
  // The verifier reports an error by its message; a null message means that the image is sound.
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

InstructionPlaces FindInstructions(const vm::VerifiedProgram& program,
                                   const std::function<bool(vm::Opcode)>& wanted) {
  std::set<int> lines;
  std::set<std::string> mnemonics;
  for (int f = 0; f < program.num_functions(); ++f) {
    const vm::FunctionInfo function = program.function(f);
    const uint8_t* code = program.bytes() + function.code_begin;
    for (uint32_t pc = 0; pc < function.code_size;) {
      const auto op = static_cast<vm::Opcode>(code[pc]);
      if (wanted(op)) {
        lines.insert(program.LineOf(f, pc));
        mnemonics.insert(vm::kOpcodeTexts[code[pc]].mnemonic);
      }
      pc += 1 + vm::OperandBytes(vm::InfoOf(op).operand);
    }
  }
  return {{lines.begin(), lines.end()}, {mnemonics.begin(), mnemonics.end()}};
}

uint64_t HashOfImage(const std::string& image) {
  return vm::image::ReadU64(reinterpret_cast<const uint8_t*>(image.data()) + vm::image::kHashAt);
}

Result<uint64_t> KinematicsHash(const std::string& image) {
  const Result<std::unique_ptr<vm::VerifiedKinematics>> kinematics = VerifyKinematicsImage(image);
  if (!kinematics) return Fail(kinematics.error().message);
  return (*kinematics)->hash();
}

}  // namespace morphbus::tools
