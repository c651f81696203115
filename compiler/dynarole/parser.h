#pragma once
// Recursive descent with recovery: one slip is reported once, and parsing goes on behind it.

#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// Parses the tokens of a file. What is wrong is an error in `diagnostics`, and reading goes on at
/// the next statement or member, so that one slip hides no other. The tree holds whatever could be
/// understood; parts that could not are kError. No tree is deeper than kMaxDepth.
/// @param file    index of the file in `sources`, whose text the tokens refer to.
/// @param tokens  what Tokenize made of it.
Program Parse(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
              source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
