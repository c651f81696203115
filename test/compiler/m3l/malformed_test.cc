// The corpus of broken and doubtful models: test/malformed/m3l/*.m3l. Each file says in comments
// which diagnostics it has, exactly these: `// expect: LINE: part` an error, `// warning: LINE:
// part` a warning with this part in its message, each followed by its `// hint: all of it` and by a
// `// note: LINE: message` for each note (`// note: FILE: message` where it is in an imported
// file).

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "compiler/m3l/compile.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

std::filesystem::path CorpusDirectory() { return test::SourcePath("test/malformed/m3l"); }

std::vector<std::string> CorpusFiles() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(CorpusDirectory())) {
    if (entry.path().extension() == ".m3l") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// A diagnostic as the corpus states it.
struct Expectation {
  source::Severity severity = source::Severity::kError;
  int line = 0;
  std::string part;                ///< Of the message.
  std::string hint;                ///< All of it.
  std::vector<std::string> notes;  ///< "LINE: message".
};

std::vector<Expectation> ReadExpectations(const std::filesystem::path& path) {
  std::vector<Expectation> expectations;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const auto after = [&](const std::string& marker) {
      const bool there = line.compare(0, marker.size(), marker) == 0;
      return there ? std::optional(line.substr(marker.size())) : std::nullopt;
    };
    const auto error = after("// expect: ");
    const auto warning = after("// warning: ");
    if (error || warning) {
      const std::string text = error ? *error : *warning;
      expectations.push_back({error ? source::Severity::kError : source::Severity::kWarning,
                              std::stoi(text),
                              text.substr(text.find(": ") + 2),
                              "",
                              {}});
    } else if (const auto hint = after("// hint: ")) {
      expectations.at(expectations.size() - 1).hint = *hint;
    } else if (const auto note = after("// note: ")) {
      expectations.at(expectations.size() - 1).notes.push_back(*note);
    }
  }
  return expectations;
}

class MalformedTest : public ::testing::TestWithParam<std::string> {
 protected:
  int LineOf(const source::Span& span) const {
    return output_.sources.Locate(span.file, span.begin).line;
  }

  bool Fits(const source::Diagnostic& d, const Expectation& expected) const {
    if (d.severity != expected.severity || LineOf(d.span) != expected.line ||
        d.message.find(expected.part) == std::string::npos || d.hint != expected.hint) {
      return false;
    }
    std::vector<std::string> notes;
    for (const source::Note& note : d.notes) {
      // Lines of the models that are imported are not for this corpus to hold.
      const std::filesystem::path other = output_.sources.name(note.span.file);
      notes.push_back(
          (note.span.file == 0 ? std::to_string(LineOf(note.span)) : other.filename().string()) +
          ": " + note.message);
    }
    return notes == expected.notes;
  }

  CompileOutput output_;
};

TEST_P(MalformedTest, HasExactlyTheDiagnosticsItExpects) {
  const std::filesystem::path path = CorpusDirectory() / (GetParam() + ".m3l");
  std::vector<Expectation> expected = ReadExpectations(path);
  output_ = CompileFiles({path.string()});
  EXPECT_EQ(output_.model.has_value(),
            std::none_of(expected.begin(), expected.end(), [](const Expectation& e) {
              return e.severity == source::Severity::kError;
            }));
  const std::string text = source::Render(output_.diagnostics, output_.sources, false);
  for (const source::Diagnostic& d : output_.diagnostics.all()) {
    ASSERT_EQ(d.span.file, 0) << text;
    const auto it = std::find_if(expected.begin(), expected.end(),
                                 [&](const Expectation& e) { return Fits(d, e); });
    if (it == expected.end()) {
      ADD_FAILURE() << "unexpected, or not with this hint and these notes, on line "
                    << LineOf(d.span) << ": " << d.message << "\n"
                    << text;
    } else {
      expected.erase(it);
    }
  }
  for (const Expectation& e : expected) {
    ADD_FAILURE() << "missing, on line " << e.line << ": " << e.part << "\n" << text;
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, MalformedTest, ::testing::ValuesIn(CorpusFiles()),
                         [](const auto& test_case) { return test_case.param; });

}  // namespace
}  // namespace morphbus::m3l
