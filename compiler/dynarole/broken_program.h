#pragma once
// The names of a program that does not parse, which editors ask for while it is typed.

#include "compiler/dynarole/ast.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/name_table.h"

namespace morphbus::dynarole {

/// The names of a program of which parts could not be read, without a word of what else is wrong
/// with it. What is missing in the tree is filled with nodes that mean nothing.
source::NameTable NamesOfBroken(const source::SourceSet& sources,
                                const keywords::KeywordTable& keywords, Program* program);

}  // namespace morphbus::dynarole
