#pragma once
// The names of M3L files, for editors. It reads the syntax trees alone, so that it finds what there
// is to find in a file that has errors.

#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/source/name_table.h"

namespace morphbus::m3l {

/// Every name in the trees of one compilation and what it means; names that mean nothing are left
/// out. Where a name is declared twice the first declaration counts, as for the checker.
source::NameTable IndexNames(const std::vector<FileAst>& files);

}  // namespace morphbus::m3l
