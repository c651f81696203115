#pragma once
// Files and what they import, lexed and parsed.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "compiler/m3l/ast.h"

namespace morphbus::m3l {

/// Reads each file once, imported files before those that import them. Unreadable files, import
/// cycles and imports nested too deep are reported.
class Loader {
 public:
  Loader(source::SourceSet& sources, source::Diagnostics& diagnostics)
      : sources_(sources), diagnostics_(diagnostics) {}

  void LoadPath(const std::string& path);
  /// A text in memory; its imports are relative to the directory of `name`.
  void LoadText(const std::string& name, const std::string& text);

  /// The trees, in the order in which their definitions count.
  [[nodiscard]] const std::vector<FileAst>& files() const { return files_; }

 private:
  /// A file that is being read, and the import that asked for it.
  struct Frame {
    std::filesystem::path identity;
    source::Span import;
  };

  /// Reads `path`, asked for at `import` (file -1: by the caller).
  void Load(const std::filesystem::path& path, const source::Span& import);
  void ParseFile(int file, const std::filesystem::path& directory);
  void ReportCycle(const std::filesystem::path& identity, const source::Span& import);

  source::SourceSet& sources_;
  source::Diagnostics& diagnostics_;
  std::vector<FileAst> files_;
  std::vector<Frame> stack_;
  std::map<std::filesystem::path, bool> seen_;
  size_t tokens_ = 0;
};

}  // namespace morphbus::m3l
