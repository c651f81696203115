#pragma once
// Where names are declared and used, over all files of a workspace and both languages: a joint of a
// model is `JOINT_1` in programs.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// A place where a name stands.
struct Occurrence {
  /// Canonical path of the file.
  std::string path;
  /// The range in it, as the editor counts.
  Json range;
  /// The bytes at the range, which may have a sign before the name: "$Head".
  std::string text;
  bool declares = false;
  /// The name that stands there; of a thing of a model, in a program, its keyword.
  std::string name;
};

/// Finds names. References to the workspace, which must outlive it.
class Navigation {
 public:
  Navigation(Workspace* workspace, PositionEncoding encoding)
      : workspace_(*workspace), encoding_(encoding) {}

  /// Where the name at a byte of a file is declared; of a keyword in each module type that has it,
  /// of an import of a program the beginning of the file.
  std::vector<Occurrence> Declarations(const std::string& path, size_t offset);
  /// Everywhere in the workspace where the name at a byte of a file stands, by file and place.
  std::vector<Occurrence> Everywhere(const std::string& path, size_t offset);
  /// Those in the file alone.
  std::vector<Occurrence> InFile(const std::string& path, size_t offset);

  /// The place of the name at a byte, if it may have another one; the error says why it may not.
  Result<Occurrence> Renamable(const std::string& path, size_t offset);
  /// The edits that give the name at a byte another one, as a WorkspaceEdit; the error says why it
  /// cannot have that name.
  Result<Json> Rename(const std::string& path, size_t offset, const std::string& name);

  /// The outline of a file, as DocumentSymbols.
  Json Outline(const std::string& path);
  /// Definitions, roles and robots of the workspace whose names have `query` in them, as
  /// SymbolInformation.
  Json Search(const std::string& query);

 private:
  /// What is known of the names of one file.
  struct Names {
    const source::NameTable* table = nullptr;
    const source::SourceSet* sources = nullptr;
  };
  /// A declaration by its place, the same in all compilations that read the file.
  struct Declaration {
    std::string path;
    size_t begin = 0;
    auto operator<=>(const Declaration&) const = default;
  };

  Names NamesOf(const std::string& path);
  [[nodiscard]] Occurrence OccurrenceOf(const Names& names, const source::NameUse& use) const;
  /// The declaration of a thing; one without a path for what no text declares.
  [[nodiscard]] static Declaration DeclarationOf(const Names& names, int thing);
  /// Where the thing stands in one compilation.
  void Collect(const Names& names, int thing, std::vector<Occurrence>* found) const;
  /// Where the thing that is declared there stands in all files that end so and know it.
  void CollectFromFiles(const Declaration& declaration, std::string_view ending,
                        std::vector<Occurrence>* found);
  /// Where the thing that is declared there stands in all models, and by its keyword in programs.
  void CollectFromModels(const Declaration& declaration, const std::string& keyword,
                         std::vector<Occurrence>* found);
  /// The file that an import of a program names, if one stands at the byte.
  std::vector<Occurrence> ImportedAt(const std::string& path, size_t offset);
  /// Everything that has the name at a byte of the file; of a keyword all its parts.
  std::vector<Occurrence> Find(const std::string& path, size_t offset);
  /// What hinders the edits ({path: [TextEdit]}) of a renaming: a name that would mean another
  /// thing than before, or a new error. Nothing if each name keeps its meaning.
  [[nodiscard]] std::optional<std::string> WhyMeaningsChange(
      const std::map<std::string, Json>& edits);

  Workspace& workspace_;
  PositionEncoding encoding_;
};

}  // namespace morphbus::tools
