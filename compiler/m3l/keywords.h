#pragma once
// The words of M3L, and where statements begin: what the parser, the formatter and the editors'
// grammars must agree on.

#include <string_view>
#include <vector>

#include "compiler/m3l/lexer.h"

namespace morphbus::m3l {

/// Words that begin statements, and those that stand between or before operands.
const std::vector<std::string_view>& Keywords();
const std::vector<std::string_view>& OperatorWords();
bool IsKeyword(std::string_view word);
bool IsOperatorWord(std::string_view word);

/// True where a statement begins: `keyword name`, `keyword :`, `import`, or `word word :`, the
/// last being a misspelt keyword. `(point x: ...)` is a part of a statement, not one. `tokens` end
/// with kEnd.
bool StartsStatement(const std::vector<Token>& tokens, size_t i);

}  // namespace morphbus::m3l
