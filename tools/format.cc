// morphbus format: M3L and DynaRole files in canonical layout.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "compiler/dynarole/format.h"
#include "compiler/m3l/format.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::vector<std::string> files;
  bool check = false;
};

/// One file; returns its exit status.
int FormatFile(const std::string& path, bool check) {
  const std::string extension = std::filesystem::path(path).extension();
  if (extension != ".m3l" && extension != ".dyn") {
    return Unusable(fmt::format("{}: expected a file that ends in .m3l or .dyn", path));
  }
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const Result<int> file = sources.AddFile(path);
  if (!file) return Unusable(file.error().message);
  const std::optional<std::string> formatted = extension == ".m3l"
                                                   ? m3l::Format(sources, *file, diagnostics)
                                                   : dynarole::Format(sources, *file, diagnostics);
  PrintDiagnostics(diagnostics, sources);
  if (!formatted) return Unusable(fmt::format("{}: left as it is", path));
  if (*formatted == sources.text(*file)) return kDone;
  if (check) {
    fmt::print("{}: not in canonical layout\n", path);
    return kNo;
  }
  const Result<void> written = WriteFile(path, *formatted);
  if (!written) return Unusable(written.error().message);
  fmt::print("{}: formatted\n", path);
  return kDone;
}

int Format(const Options& options) {
  int status = kDone;
  for (const std::string& file : options.files) {
    status = std::max(status, FormatFile(file, options.check));
  }
  return status;
}

}  // namespace

void AddFormat(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("format", "Lay out M3L and DynaRole files canonically");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->files, "Files that end in .m3l or .dyn")->required();
  sub->add_flag("--check", options->check, "Change nothing; status 1 if a file would change");
  sub->footer(
      "Examples:\n  morphbus format models/mtran.m3l models/programs/quadruped.dyn\n"
      "  morphbus format --check models/*.m3l");
  sub->callback([options, action] { *action = [options] { return Format(*options); }; });
}

}  // namespace morphbus::tools
