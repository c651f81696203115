#pragma once
// Stages of the compiler as text, for --dump and golden tests.

#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// One token a line: `line:column kind text`.
std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens);

/// The tree as parsed, indented; expressions with all their parentheses.
std::string DumpAst(const Program& program);

}  // namespace morphbus::dynarole
