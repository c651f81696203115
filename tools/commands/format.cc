// morphbus format: M3L and DynaRole files in canonical layout.

#include <fmt/format.h>

#include <filesystem>

#include "compiler/dynarole/format.h"
#include "compiler/m3l/format.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus format`.
struct FormatOptions {
  std::vector<std::string> files;
  bool check = false;
  bool json = false;
};

/// Formats one file, or only checks it, and sets `*layout` to what it was found to be, for people
/// and scripts; returns the exit status for it.
int FormatFile(const std::string& path, bool check, std::string* layout) {
  *layout = "unusable";
  // The extension tells the language; a file of another kind is not touched.
  const std::string extension = std::filesystem::path(path).extension();
  if (extension != ".m3l" && extension != ".dyn") {
    return Unusable(fmt::format("{}: expected a file that ends in .m3l or .dyn", path));
  }
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const Result<int> file = sources.AddFile(path);
  if (!file) return Unusable(file.error().message);
  // Both formatters refuse a text that does not parse, and report why.
  const std::optional<std::string> formatted = extension == ".m3l"
                                                   ? m3l::Format(sources, *file, &diagnostics)
                                                   : dynarole::Format(sources, *file, &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  if (!formatted) return Unusable(fmt::format("{}: left as it is", path));
  // A file that is in canonical layout is not written, so its time does not change.
  *layout = "canonical";
  if (*formatted == sources.text(*file)) return kDone;
  // With --check the answer is the exit status.
  *layout = "not in canonical layout";
  if (check) return kNo;
  // WriteFile replaces the file whole, so that there is never half of it.
  const Result<void> written = WriteFile(path, *formatted);
  if (!written) return Unusable(written.error().message);
  *layout = "formatted";
  return kDone;
}

/// All files, even if one of them cannot be formatted; the worst status counts.
int FormatFiles(const FormatOptions& options) {
  int status = kDone;
  Json files = Json::array();
  for (const std::string& file : options.files) {
    std::string layout;
    const int of_file = FormatFile(file, options.check, &layout);
    status = std::max(status, of_file);
    files.push_back({{"file", file}, {"layout", layout}});
    // People want to know of files that are not as they should be, or were not; errors are said.
    const bool told = layout == "formatted" || of_file == kNo;
    if (told && !options.json) Print("{}: {}\n", file, layout);
  }
  if (options.json) PrintJson({{"files", files}});
  return status;
}

}  // namespace

void AddFormat(CommandLine* line) {
  Subcommand sub = line->Add("format", "Lay out M3L and DynaRole files canonically");
  auto options = std::make_shared<FormatOptions>();
  sub.Add("FILE", &options->files, "Files that end in .m3l or .dyn")
      .TypeName("FILE.m3l|FILE.dyn")
      .Required();
  sub.Flag("--check", &options->check, "Change nothing; status 1 if a file would change");
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n  morphbus format models/mtran.m3l models/programs/quadruped.dyn\n"
      "  morphbus format --check models/*.m3l");
  sub.Do([options] { return FormatFiles(*options); });
}

}  // namespace morphbus::tools
