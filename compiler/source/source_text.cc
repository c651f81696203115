#include "compiler/source/source_text.h"

#include <algorithm>
#include <filesystem>

#include "compiler/base/read_file.h"
#include "compiler/base/utf8.h"

namespace morphbus::source {
namespace {

// Sizes are bounded, so that a file named by mistake does not fill the memory.
constexpr size_t kMaxFileBytes = size_t{64} << 20;

}  // namespace

bool EndsLine(std::string_view text, size_t at) {
  return text[at] == '\n' || (text[at] == '\r' && (at + 1 == text.size() || text[at + 1] != '\n'));
}

int SourceSet::AddText(std::string name, std::string text) {
  // Line starts are found once, so that places are found quickly.
  auto file = std::make_shared<File>();
  file->name = std::move(name);
  file->text = std::move(text);
  file->line_starts.push_back(0);
  for (size_t i = 0; i < file->text.size(); ++i) {
    if (EndsLine(file->text, i)) file->line_starts.push_back(i + 1);
  }
  file->lines_before = num_lines();
  files_.push_back(std::move(file));
  return size() - 1;
}

std::string SourceSet::NameFromFirst(int file) const {
  if (file == 0) return name(0).substr(name(0).find_last_of('/') + 1);
  const std::filesystem::path folder = std::filesystem::path(name(0)).parent_path();
  const std::filesystem::path path = std::filesystem::path(name(file)).lexically_normal();
  // Between an absolute path and another there is no way that could be told.
  const std::filesystem::path way = path.lexically_relative(folder.lexically_normal());
  return folder.empty() || way.empty() ? path : way;
}

int SourceSet::num_lines() const {
  if (files_.empty()) return 0;
  return files_.back()->lines_before + static_cast<int>(files_.back()->line_starts.size());
}

Result<int> SourceSet::AddFile(const std::string& path) {
  // Files and texts from elsewhere are alike from here on.
  Result<std::string> text = ReadSourceFile(path);
  if (!text) return Fail(text.error().message);
  return AddText(path, std::move(*text));
}

Result<std::string> ReadSourceFile(const std::string& path) {
  Result<std::string> text = ReadWholeFile(path, kMaxFileBytes);
  if (!text) return Fail("cannot read '" + path + "': " + text.error().message);
  return text;
}

std::string_view SourceSet::text(const Span& span) const {
  // A span made by hand may reach beyond the text.
  const std::string_view whole = text(span.file);
  const size_t begin = std::min(span.begin, whole.size());
  const size_t end = std::clamp(span.end, begin, whole.size());
  return whole.substr(begin, end - begin);
}

int SourceSet::LineOf(int file, size_t offset) const {
  // The line begins at the last start that is not behind the offset.
  const std::vector<size_t>& starts = files_[file]->line_starts;
  return static_cast<int>(std::ranges::upper_bound(starts, offset) - starts.begin());
}

LineColumn SourceSet::Locate(int file, size_t offset) const {
  const File& f = *files_[file];
  offset = std::min(offset, f.text.size());
  const int line = LineOf(file, offset);
  // Columns are characters, not bytes.
  const size_t begin = f.line_starts[line - 1];
  const std::string_view before = std::string_view(f.text).substr(begin, offset - begin);
  return {line, 1 + static_cast<int>(CountCharacters(before))};
}

std::string_view SourceSet::LineAt(int file, size_t offset) const {
  const File& f = *files_[file];
  const int line = LineOf(file, std::min(offset, f.text.size()));
  const size_t begin = f.line_starts[line - 1];
  // The last line need not end with a newline.
  size_t end = line == std::ssize(f.line_starts) ? f.text.size() : f.line_starts[line] - 1;
  if (end > begin && f.text[end - 1] == '\r') --end;  // The first half of "\r\n".
  return std::string_view(f.text).substr(begin, end - begin);
}

}  // namespace morphbus::source
