#pragma once
// The DynaRole compiler: text in, verified image bytes or diagnostics out. docs/dynarole.md is the
// language reference.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/diagnostics.h"
#include "compiler/source/import_reader.h"
#include "compiler/source/name_table.h"
#include "compiler/source/source_text.h"

namespace morphbus::dynarole {

/// A stage of the compiler whose result is wanted as text: the tokens, the syntax tree, or the
/// image disassembled.
enum class Dump : uint8_t { kNone, kTokens, kAst, kCode };

/// The stage called "tokens", "ast" or "code"; nothing for other names.
std::optional<Dump> DumpFromName(const std::string& name);

/// What compiling a program yields: an image, or errors that say why there is none. It owns the
/// text, and refers to nothing outside.
struct CompileResult {
  /// The program; absent if there were errors.
  std::optional<std::vector<uint8_t>> image;
  /// The program's text, which is file 0, and those that it imports; the diagnostics refer to them.
  source::SourceSet sources;
  source::Diagnostics diagnostics;  ///< Errors and warnings; never both an error and an image.
  /// The stage asked for, as far as it was reached.
  std::string dump;
  /// The imports of all files.
  std::vector<ImportDecl> imports;
  /// The text declares something and no role, so that it is for others to import: kNoRoles is an
  /// error in it.
  bool is_library = false;
};

/// What is said of a text without roles.
inline constexpr const char* kNoRoles = "program has no roles";

/// Compiles one program. `name` is the file's name for messages; `keywords` are those of all module
/// types that the robot may have: each keyword the program uses must be one of at least one type.
/// Texts over 1 MiB, with all that they import, are refused. A program that compiles is one that
/// vm::Verifier accepts.
/// @param names  if not null, gets the names of the program, as far as they could be made out.
/// @param read   reads what is imported: files whose paths are relative to the folder of `name`.
CompileResult CompileProgram(const std::string& name, const std::string& text,
                             const keywords::KeywordTable& keywords, Dump dump = Dump::kNone,
                             source::NameTable* names = nullptr,
                             source::TextReader read = source::ReadSourceFile);

}  // namespace morphbus::dynarole
