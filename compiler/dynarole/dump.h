#pragma once
// Stages of the compiler as text, for --dump and golden tests. The formats are for people and may
// change with the compiler.

#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// One token a line, `line:column kind text`, in the order of the text. `tokens` are those of one
/// file of `sources`.
std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens);

/// The tree as parsed, before the checker has seen it: a member or statement a line and indented by
/// their depth; expressions have all their parentheses, so that what binds tighter can be seen.
std::string DumpAst(const Program& program);

}  // namespace morphbus::dynarole
