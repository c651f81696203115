#pragma once
// Source texts and byte spans in them. Lines and columns are computed only when printing.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::source {

/// A half-open byte range [begin, end) of file number `file` of a SourceSet.
struct Span {
  int file = 0;
  size_t begin = 0;
  size_t end = 0;
};

/// True if a line ends with the byte at `at`: a newline, or a carriage return without one.
bool EndsLine(std::string_view text, size_t at);

/// 1-based line and column (in UTF-8 code points) of a byte offset.
struct LineColumn {
  int line = 1;
  int column = 1;
};

/// The texts of one compilation. Append-only, so views into it stay valid.
class SourceSet {
 public:
  /// Adds a text under `name` and returns its file number.
  int AddText(std::string name, std::string text);
  /// Reads a file (at most 64 MiB); the error names the path and the reason.
  Result<int> AddFile(const std::string& path);

  [[nodiscard]] int size() const { return static_cast<int>(files_.size()); }
  [[nodiscard]] const std::string& name(int file) const { return files_[file]->name; }
  [[nodiscard]] std::string_view text(int file) const { return files_[file]->text; }
  [[nodiscard]] std::string_view text(const Span& span) const;
  [[nodiscard]] LineColumn Locate(int file, size_t offset) const;
  /// The whole line that holds `offset`, without its newline.
  [[nodiscard]] std::string_view LineAt(int file, size_t offset) const;

 private:
  struct File {
    std::string name;
    std::string text;
    std::vector<size_t> line_starts;
  };
  std::vector<std::shared_ptr<const File>> files_;
};

}  // namespace morphbus::source
