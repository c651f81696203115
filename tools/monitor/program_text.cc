#include "tools/monitor/program_text.h"

#include <filesystem>

#include "compiler/dynarole/compile.h"
#include "compiler/keywords/module_keywords.h"
#include "tools/base/files.h"
#include "tools/plan/control_script.h"

namespace morphbus::tools {
namespace {

/// The compiler takes no longer texts.
constexpr size_t kMostTextBytes = size_t{1} << 20;
constexpr size_t kMostTexts = 64;

}  // namespace

Result<CompiledProgram> ProgramTexts::Compile(const std::string& name, const std::string& text) {
  // The language has the keywords of this run's module types.
  const auto table = keywords::KeywordsOf(model_).and_then(keywords::KeywordTable::Of);
  if (!table) return Fail(table.error().message);
  const dynarole::CompileResult result = dynarole::CompileProgram(name, text, *table);
  if (!result.image) return Fail(source::Render(result.diagnostics, result.sources, false));
  CompiledProgram program;
  program.image.assign(result.image->begin(), result.image->end());
  // What compiles need not fit the robot that runs.
  if (const std::string why = WhyNotFor(model_, program.image); !why.empty()) return Fail(why);
  const auto verified = VerifyProgram(program.image);
  if (!verified) return Fail(verified.error().message);
  program.hash = (*verified)->hash();
  // Its text is kept for the faults that it may have.
  const std::lock_guard lock(mutex_);
  if (compiled_.size() < kMostTexts) compiled_[program.hash] = text;
  return program;
}

std::string ProgramTexts::Find(uint64_t hash, const std::string& path) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = compiled_.find(hash);
    if (found != compiled_.end()) return found->second;
  }
  // The path comes from a log or from the bus, and may lead anywhere: only a file is opened.
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return "";
  const Result<std::string> text = ReadFile(path, kMostTextBytes);
  if (!text) return "";
  // The file may have changed since: it is the program's only if it compiles to the same image.
  const Result<CompiledProgram> program = Compile(path, *text);
  return program && program->hash == hash ? *text : "";
}

}  // namespace morphbus::tools
