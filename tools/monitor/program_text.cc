#include "tools/monitor/program_text.h"

#include <algorithm>
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
  return Compile(name, text, [this](const std::string& path) { return ReadImported(path); });
}

Result<std::string> ProgramTexts::ReadImported(const std::string& path) const {
  // A viewer may know no more than the name of the run's program.
  const std::filesystem::path folder = std::filesystem::path(program_file_).parent_path();
  const auto wanted = {source::CanonicalPath(path), source::CanonicalPath(folder / path)};
  const Result<std::string> own = ReadFile(program_file_, kMostTextBytes);
  if (own) {
    // Words that modules have or lack are of no account for what is imported.
    const dynarole::CompileResult program = dynarole::CompileProgram(program_file_, *own, {});
    for (int file = 1; file < program.sources.size(); ++file) {
      const std::filesystem::path known = source::CanonicalPath(program.sources.name(file));
      if (std::ranges::count(wanted, known) > 0) return std::string(program.sources.text(file));
    }
  }
  return Fail("the run's program does not import '" + path +
              "', and a text that comes from outside may import nothing else");
}

Result<CompiledProgram> ProgramTexts::Compile(const std::string& name, const std::string& text,
                                              const source::TextReader& read) {
  // The language has the keywords of this run's module types.
  const auto table = keywords::KeywordsOf(model_).and_then(keywords::KeywordTable::Of);
  if (!table) return Fail(table.error().message);
  const dynarole::CompileResult result =
      dynarole::CompileProgram(name, text, *table, dynarole::Dump::kNone, nullptr, read);
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
  if (compiled_.size() < kMostTexts) {
    bridge::SourceTexts& texts = compiled_[program.hash];
    texts.own = text;
    for (int file = 1; file < result.sources.size(); ++file) {
      texts.imported[result.sources.NameFromFirst(file)] = result.sources.text(file);
    }
  }
  return program;
}

bridge::SourceTexts ProgramTexts::Find(uint64_t hash, const std::string& path) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = compiled_.find(hash);
    if (found != compiled_.end()) return found->second;
  }
  // The path comes from a log or from the bus, and may lead anywhere: only a file is opened.
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return {};
  const Result<std::string> text = ReadFile(path, kMostTextBytes);
  if (!text) return {};
  // The file may have changed since: it is the program's only if it compiles to the same image.
  const Result<CompiledProgram> program = Compile(path, *text, source::ReadSourceFile);
  if (!program || program->hash != hash) return {};
  const std::lock_guard lock(mutex_);
  const auto found = compiled_.find(hash);
  return found == compiled_.end() ? bridge::SourceTexts{*text, {}} : found->second;
}

}  // namespace morphbus::tools
