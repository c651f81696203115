#pragma once
// Source texts and byte spans in them. Lines and columns are computed only when printing.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::source {

/// A half-open byte range [begin, end) of file number `file` of a SourceSet. It is small enough to
/// be kept with every token, name and expression. A file of -1 stands for no file: the command
/// line.
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

/// The bytes of a file of at most 64 MiB (ReadWholeFile); the error names the path and the reason.
Result<std::string> ReadSourceFile(const std::string& path);

/// The texts of one compilation. It is append-only, so views into it stay valid for as long as it
/// or a copy of it lives.
class SourceSet {
 public:
  /// Adds a text under `name`, which diagnostics print as it is, and returns its file number. It
  /// takes one pass over the text.
  int AddText(std::string name, std::string text);
  /// Reads a file (at most 64 MiB); the error names the path and the reason.
  Result<int> AddFile(const std::string& path);

  /// Number of files; they are numbered from 0 in the order in which they were added.
  [[nodiscard]] int size() const { return static_cast<int>(files_.size()); }
  /// Name and text of file number `file`.
  [[nodiscard]] const std::string& name(int file) const { return files_[file]->name; }
  /// The path of a file as it lies from the folder of file 0: "walk.dyn", "lib/gait.dyn"; an
  /// absolute one where only one of both is.
  [[nodiscard]] std::string NameFromFirst(int file) const;
  [[nodiscard]] std::string_view text(int file) const { return files_[file]->text; }
  /// The text that a span covers, as far as it lies within its file.
  [[nodiscard]] std::string_view text(const Span& span) const;
  /// The line, counted from 1, of the byte at `offset`; takes logarithmic time.
  [[nodiscard]] int LineOf(int file, size_t offset) const;
  /// The same counted over all files, in the order of their numbers: that of file 0 is its own, and
  /// each other file begins with the number behind the last line of the one before it.
  [[nodiscard]] int LineOfAll(int file, size_t offset) const {
    return files_[file]->lines_before + LineOf(file, offset);
  }
  /// Number of lines of all files.
  [[nodiscard]] int num_lines() const;
  /// Line and column of the byte at `offset`; beyond the end, those of the end.
  [[nodiscard]] LineColumn Locate(int file, size_t offset) const;
  /// The whole line that holds `offset`, without its newline.
  [[nodiscard]] std::string_view LineAt(int file, size_t offset) const;

 private:
  /// A file is immutable and shared, so that copies of a SourceSet are cheap and views stay good.
  struct File {
    /// The path or name as the caller gave it.
    std::string name;
    /// The bytes as they were read; nothing is converted.
    std::string text;
    /// The offset at which each line begins; the first is 0.
    std::vector<size_t> line_starts;
    /// How many lines the files have that were added before.
    int lines_before = 0;
  };
  /// The files by their numbers.
  std::vector<std::shared_ptr<const File>> files_;
};

}  // namespace morphbus::source
