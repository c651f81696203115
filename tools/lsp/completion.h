#pragma once
// What may be typed at a place, and how a call there goes on. Both go by the tokens before the
// place and by the names of the file, as a text that is being typed seldom parses.

#include <span>
#include <string>
#include <string_view>

#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// CompletionItems for byte `offset` of an M3L file.
Json CompleteModel(Workspace* workspace, const std::string& path, size_t offset);
/// CompletionItems for byte `offset` of a DynaRole program.
Json CompleteProgram(Workspace* workspace, const std::string& path, size_t offset);

/// SignatureHelp for the call around byte `offset`; null outside of calls.
Json ModelSignature(const ModelFile& file, size_t offset);
Json ProgramSignature(const ProgramFile& program, size_t offset);

/// The kinds of completion items that are used here (LSP 3.17, CompletionItemKind).
enum class ItemKind {
  kMethod = 2,
  kFunction = 3,
  kField = 5,
  kVariable = 6,
  kClass = 7,
  kProperty = 10,
  kUnit = 11,
  kValue = 12,
  kKeyword = 14,
  kSnippet = 15,
  kFile = 17,
  kConstant = 21,
  kEvent = 23,
};

/// A list of completion items, each label once.
class ItemList {
 public:
  /// @param insert  what is typed, a snippet if it has a '$'; empty for the label itself.
  void Add(const std::string& label, ItemKind kind, const std::string& detail,
           const std::string& insert = "");
  /// The files whose names end in one of `endings`, in the folder of the path `typed`, which
  /// begins at that of the file at `path`; not that file.
  void AddFiles(const std::string& path, std::string_view typed,
                std::span<const std::string_view> endings);
  Json Take() { return std::move(items_); }

 private:
  Json items_ = Json::array();
  std::map<std::string, bool> labels_;
};

}  // namespace morphbus::tools
