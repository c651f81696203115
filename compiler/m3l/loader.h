#pragma once
// Files and what they import, lexed and parsed: the first stages of the compiler (compile.cc makes
// one loader for each compilation).

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/m3l/compile.h"

namespace morphbus::m3l {

/// Reads each file once, imported files before those that import them. Unreadable files, import
/// cycles and imports nested too deep are reported.
class Loader {
 public:
  /// Sources, diagnostics, trees and the text of stage `dump` go into `output`, which outlives the
  /// loader, as do the texts that are read in place of files (`open`, which may be null).
  Loader(Dump dump, CompileOutput* output, const OpenTexts* open = nullptr)
      : dump_(dump),
        open_(open),
        output_(*output),
        sources_(output->sources),
        diagnostics_(output->diagnostics) {}

  /// Reads `path` and, before its own definitions count, what it imports. Errors go to the
  /// diagnostics.
  void LoadPath(const std::string& path);
  /// Parses a text in memory under `name`; its imports are relative to the directory of `name`.
  void LoadText(const std::string& name, const std::string& text);

 private:
  /// A file that is being read, and the import that asked for it.
  struct Frame {
    /// The canonical path, by which the same file is known under any name.
    std::filesystem::path identity;
    /// The place of the import's string; its file is -1 for a file that the caller named.
    source::Span import;
  };

  /// Reads `path`, asked for at `import` (file -1: by the caller).
  void Load(const std::filesystem::path& path, const source::Span& import);
  /// Parses source number `file`; its imports are relative to `directory`.
  void ParseFile(int file, const std::filesystem::path& directory);
  /// Reports that `identity` is imported while it is being read, with the imports that led there.
  void ReportCycle(const std::filesystem::path& identity, const source::Span& import);

  /// Adds the text of a file to the sources, from the editor that has it open, or from disk.
  Result<int> AddFile(const std::filesystem::path& path, const std::filesystem::path& identity);

  Dump dump_;
  const OpenTexts* open_;
  CompileOutput& output_;
  source::SourceSet& sources_;
  source::Diagnostics& diagnostics_;
  /// The files that are being read, the outermost first.
  std::vector<Frame> stack_;
  /// The files that were begun, by their canonical path.
  std::map<std::filesystem::path, bool> seen_;
  /// The number of tokens of all files together, for the bound on them.
  size_t tokens_ = 0;
};

}  // namespace morphbus::m3l
