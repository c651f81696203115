#pragma once
// `const NAME = number`: numbers that have a name in all files of a compilation.

#include <vector>

#include "compiler/m3l/ast.h"

namespace morphbus::m3l {

/// Works out the constants of all files, in the order in which they stand (imported files first),
/// each from those above it, and marks every name of one in the trees (Expr::constant). A name that
/// is given twice, or that has a meaning already, is an error. Linear in the trees.
void ResolveConstants(std::vector<FileAst>* files, source::Diagnostics* diagnostics);

}  // namespace morphbus::m3l
