#pragma once
// Recursive descent with recovery: one slip is reported once, and parsing goes on behind it.

#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// Parses the tokens of one file. The tree holds whatever could be understood; parts that could not
/// are kError. Depth is bounded by kMaxDepth.
Program Parse(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
              source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
