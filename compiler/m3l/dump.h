#pragma once
// Stages of the compiler as text, for `check --dump` and golden tests. The formats are for people
// and may change with the compiler.

#include <string>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/m3l/lexer.h"

namespace morphbus::m3l {

/// One token a line: `line:column kind text`.
std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens);

/// The tree as parsed, indented: a line for each declaration and attribute, expressions in braces
/// with the operator first.
std::string DumpAst(const FileAst& file);

}  // namespace morphbus::m3l
