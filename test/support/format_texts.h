#pragma once
// What the tests of the languages' formatters share: properties that hold for every text of the
// repository.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "test/support/source_dir.h"

namespace morphbus::test {

/// A language's formatter and what tells its files.
struct FormattedLanguage {
  std::string extension;  ///< ".m3l"
  std::optional<std::string> (*format)(const source::SourceSet&, int file, source::Diagnostics*);
  /// The texts of the tokens of a file, in order.
  std::function<std::vector<std::string>(const source::SourceSet&, int file)> tokens;
};

inline std::string ReadWhole(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The language's files in a folder of the repository, sorted.
inline std::vector<std::filesystem::path> FilesIn(const FormattedLanguage& language,
                                                  const std::string& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath(folder))) {
    if (entry.path().extension() == language.extension) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The canonical layout of `text`; nothing, with errors, if it does not parse.
inline std::optional<std::string> FormatText(const FormattedLanguage& language,
                                             const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("x" + language.extension, text);
  std::optional<std::string> formatted = language.format(sources, file, &diagnostics);
  EXPECT_EQ(formatted.has_value(), !diagnostics.had_errors());
  return formatted;
}

/// Formatting the files changes nothing of `meaning` (of a name and a text), and nothing at all the
/// second time. Files with syntax errors are passed over; returns the number of the others.
template <typename Meaning>
int ExpectFormattingKeeps(const FormattedLanguage& language,
                          const std::vector<std::string>& folders, const Meaning& meaning) {
  int formatted = 0;
  for (const std::string& folder : folders) {
    for (const std::filesystem::path& path : FilesIn(language, folder)) {
      SCOPED_TRACE(path.string());
      const std::string text = ReadWhole(path);
      const std::optional<std::string> once = FormatText(language, text);
      if (!once) continue;
      ++formatted;
      EXPECT_EQ(FormatText(language, *once), *once);
      EXPECT_EQ(meaning(path.string(), *once), meaning(path.string(), text));
    }
  }
  return formatted;
}

/// Any two tokens may come apart or together: each text once with every token on its own line, and
/// once with a comment behind every token. No line is longer than 100 columns.
inline void ExpectTokensAloneDecide(const FormattedLanguage& language, const std::string& folder) {
  for (const std::filesystem::path& path : FilesIn(language, folder)) {
    SCOPED_TRACE(path.string());
    source::SourceSet sources;
    const int file = sources.AddText(path.string(), ReadWhole(path));
    std::string lines, plain, comments;
    for (const std::string& token : language.tokens(sources, file)) {
      lines += token + "\n";
      plain += token + " ";
      comments += token + " // c\n";
    }
    const std::optional<std::string> from_lines = FormatText(language, lines);
    ASSERT_TRUE(from_lines.has_value());
    EXPECT_EQ(from_lines, FormatText(language, plain));
    const std::optional<std::string> commented = FormatText(language, comments);
    ASSERT_TRUE(commented.has_value());
    EXPECT_EQ(FormatText(language, *commented), commented);
    for (size_t at = 0; at < from_lines->size();) {
      const size_t end = from_lines->find('\n', at);
      EXPECT_LE(end - at, 100U) << from_lines->substr(at, end - at);
      at = end + 1;
    }
  }
}

/// The files of the folder are in canonical layout.
inline void ExpectFormatted(const FormattedLanguage& language, const std::string& folder) {
  for (const std::filesystem::path& path : FilesIn(language, folder)) {
    const std::string text = ReadWhole(path);
    EXPECT_EQ(FormatText(language, text), text) << "mend with: morphbus format " << path;
  }
}

}  // namespace morphbus::test
