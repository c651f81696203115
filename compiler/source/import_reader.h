#pragma once
// Files and what they import, for the languages that have `import "FILE"`.

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/source/source_text.h"

namespace morphbus::source {

/// Gives the text of a file; the error names the path and the reason.
using TextReader = std::function<Result<std::string>(const std::string& path)>;

/// Texts that count in place of files, by their canonical paths: what an editor has not saved yet.
using OpenTexts = std::map<std::string, std::string>;

/// The path by which a file is known, however it is written.
std::filesystem::path CanonicalPath(const std::filesystem::path& path);

/// Reads from disk (ReadSourceFile) what is not among `open`, which may be null and outlives the
/// reader.
TextReader ReaderOf(const OpenTexts* open);

/// Reads each file once, imported files in the order in which they are asked for. What an import
/// cannot name, unreadable files, cycles, and imports that nest too deep are reported. A language
/// derives from it and says what is done with a text.
class ImportReader {
 public:
  /// All must outlive the reader, to which texts and diagnostics are added.
  ImportReader(TextReader read, SourceSet* sources, Diagnostics* diagnostics)
      : sources_(*sources), diagnostics_(*diagnostics), read_(std::move(read)) {}
  virtual ~ImportReader() = default;
  ImportReader(const ImportReader&) = delete;
  ImportReader& operator=(const ImportReader&) = delete;

  /// Reads a file that the caller names.
  void LoadPath(const std::string& path);
  /// Takes a text in memory for the file `name`: its imports are relative to the directory of that,
  /// and an import of it is a cycle.
  void LoadText(const std::string& name, const std::string& text);

 protected:
  /// Takes source number `file`, which has just been read. It calls Import for each of its imports,
  /// and what is read by then counts before the rest of the file.
  virtual void Parse(int file) = 0;
  /// Whether a text may be taken, before it is; false after an error at `import` (file -1: the
  /// caller named it).
  virtual bool Accepts(const std::string& text, const Span& import);
  /// Reads what the text imports that Parse is called for; `path` is relative to its directory, and
  /// errors are at `span`.
  void Import(const std::string& path, const Span& span);

  SourceSet& sources_;
  Diagnostics& diagnostics_;

 private:
  /// A file that is being read, and the import that asked for it.
  struct Frame {
    /// The canonical path, by which the same file is known under any name.
    std::filesystem::path identity;
    std::filesystem::path directory;
    /// The place of the import's path; its file is -1 for a file that the caller named.
    Span import;
  };

  /// Reads `path`, asked for at `import`.
  void Load(const std::filesystem::path& path, const Span& import);
  /// Reports that `identity` is imported while it is being read, with the imports that led there.
  void ReportCycle(const std::filesystem::path& identity, const Span& import);

  TextReader read_;
  /// The files that are being read, the outermost first.
  std::vector<Frame> stack_;
  /// The files that were begun.
  std::set<std::filesystem::path> seen_;
};

}  // namespace morphbus::source
