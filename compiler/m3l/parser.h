#pragma once
// M3L tokens to syntax tree, by recursive descent with recovery: one slip is reported once, and all
// independent errors are found in one go.

#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/m3l/lexer.h"

namespace morphbus::m3l {

/// Deepest nesting of parentheses and operators that is accepted; bounds every recursion.
constexpr int kMaxNesting = 100;

/// Parses the tokens of one file. Always returns what could be made out; parts that did not parse
/// are reported, left out, and their surroundings marked `broken`. Linear in the tokens.
FileAst Parse(const std::vector<Token>& tokens, source::Diagnostics* diagnostics);

}  // namespace morphbus::m3l
