#pragma once
// What an editor has open, what lies beside it, and what the compilers make of both. Everything is
// worked out when it is first asked for, and again only when a text that it rests on has changed.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/dynarole/compile.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/keywords/module_keywords.h"
#include "compiler/m3l/compile.h"
#include "compiler/source/import_reader.h"
#include "compiler/source/name_table.h"
#include "tools/lsp/document.h"

namespace morphbus::tools {

/// The state of a text: of one that is open its revision, else what the disk says of the file.
struct TextStamp {
  std::string path;
  int64_t revision = 0;
  int64_t modified_ns = 0;
  int64_t size = -1;

  bool operator==(const TextStamp&) const = default;
};

/// An M3L file with all that it imports.
struct ModelFile {
  std::string path;
  m3l::CompileOutput compiled;
  source::NameTable names;
  /// The words that its module types add to programs; none where these clash.
  std::vector<keywords::ModuleKeywords> keywords;
  std::vector<TextStamp> stamps;
};

/// A DynaRole program, compiled for the module types of the models that belong to it.
struct ProgramFile {
  std::string path;
  /// The models, by their paths.
  std::vector<std::string> models;
  keywords::KeywordTable keywords;
  dynarole::CompileResult compiled;
  source::NameTable names;
  std::vector<TextStamp> stamps;
};

/// The texts and the analyses of them. References are good until the next call that is not const.
class Workspace {
 public:
  /// The folders that the editor has open, and models that the user has chosen for all programs
  /// (paths, relative to the first folder; empty: those beside the programs).
  void SetFolders(std::vector<std::string> folders) { folders_ = std::move(folders); }
  void SetModels(std::vector<std::string> models) { models_ = std::move(models); }

  // Texts that are open, by their URIs.
  /// `language` is what the editor calls the text's, by which one without a file is known.
  Document& Open(const std::string& uri, const std::string& language, int version,
                 std::string text);
  /// Notes that a text that is open has changed.
  void Changed(Document* document);
  void Close(const std::string& uri);
  [[nodiscard]] Document* Find(const std::string& uri);
  [[nodiscard]] const std::map<std::string, Document>& documents() const { return documents_; }

  /// A workspace of the same folders and texts, but for some of which the text is another, by path.
  [[nodiscard]] Workspace WithTexts(const std::map<std::string, std::string>& texts) const;

  /// The URI of a file: of one that is open as the editor writes it.
  [[nodiscard]] std::string UriOf(const std::string& path) const;

  /// Reads what is open as the editor has it, and everything else from disk.
  [[nodiscard]] source::TextReader Reader() const { return source::ReaderOf(&open_); }

  /// What the compiler makes of a file now; a file that cannot be read is an error in it.
  const ModelFile& Model(const std::string& path);
  const ProgramFile& Program(const std::string& path);

  /// The models that a program belongs to: those that the user has chosen; else all in the nearest
  /// folder, from that of the program up to that of the workspace, that has any.
  [[nodiscard]] std::vector<std::string> ModelsFor(const std::string& program) const;
  /// All files of the workspace that end so, and those that are open, at most kMostFiles; by path.
  [[nodiscard]] std::vector<std::string> Files(std::string_view ending) const;
  static constexpr size_t kMostFiles = 200;

  /// Whether the text at `path` still is as it was.
  [[nodiscard]] bool IsCurrent(const std::vector<TextStamp>& stamps) const;
  [[nodiscard]] TextStamp StampOf(const std::string& path) const;

 private:
  std::vector<std::string> folders_, models_;
  std::map<std::string, Document> documents_;
  /// The texts of the documents, as the compilers take them.
  source::OpenTexts open_;
  int64_t revision_ = 0;
  std::map<std::string, ModelFile> model_files_;
  std::map<std::string, ProgramFile> program_files_;
};

/// The canonical path of what an import names.
std::string PathOf(const dynarole::CompileResult& program, const dynarole::ImportDecl& import);

/// The path by which a file is known, however it is written.
std::string CanonicalPath(const std::string& path);

}  // namespace morphbus::tools
