#pragma once
// The DynaRole compiler: text in, verified image bytes or diagnostics out. docs/dynarole.md is the
// language reference.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/dynarole/keyword_table.h"
#include "compiler/source/diagnostics.h"
#include "compiler/source/source_text.h"

namespace morphbus::dynarole {

/// A stage of the compiler whose result is wanted as text.
enum class Dump : uint8_t { kNone, kTokens, kAst, kCode };

/// "tokens", "ast" or "code".
std::optional<Dump> DumpFromName(const std::string& name);

struct CompileResult {
  /// The program; absent if there were errors.
  std::optional<std::vector<uint8_t>> image;
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  /// The stage asked for, as far as it was reached.
  std::string dump;
};

/// Compiles one program. `name` is the file's name for messages; `keywords` are those of all module
/// types that the robot may have (KeywordTableOf in compiler/dynarole/module_keywords.h): each
/// keyword the program uses must be one of at least one type. Texts over 1 MiB are refused. A
/// program that compiles is one that vm::Verifier accepts.
CompileResult CompileProgram(const std::string& name, const std::string& text,
                             const KeywordTable& keywords, Dump dump = Dump::kNone);

}  // namespace morphbus::dynarole
