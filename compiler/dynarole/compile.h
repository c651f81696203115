#pragma once
// The DynaRole compiler: text in, verified image bytes or diagnostics out. docs/dynarole.md is the
// language reference.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/keywords/keyword_table.h"
#include "compiler/source/diagnostics.h"
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
  source::SourceSet sources;        ///< The program's text, to which the diagnostics refer.
  source::Diagnostics diagnostics;  ///< Errors and warnings; never both an error and an image.
  /// The stage asked for, as far as it was reached.
  std::string dump;
};

/// Compiles one program. `name` is the file's name for messages; `keywords` are those of all module
/// types that the robot may have: each keyword the program uses must be one of at least one type.
/// Texts over 1 MiB are refused. A program that compiles is one that vm::Verifier accepts.
/// @param names  if not null, gets the names of the program, as far as they could be made out.
CompileResult CompileProgram(const std::string& name, const std::string& text,
                             const keywords::KeywordTable& keywords, Dump dump = Dump::kNone,
                             source::NameTable* names = nullptr);

}  // namespace morphbus::dynarole
