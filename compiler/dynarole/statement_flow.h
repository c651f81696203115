#pragma once
// Where statements lead: what is never reached.

#include "compiler/dynarole/ast.h"

namespace morphbus::dynarole {

/// Whether what stands behind the statement is never reached, in its block: it returns, leaves a
/// loop or goes round in one that nothing ends, whichever way is taken in it.
bool AlwaysReturns(const Stmt& statement);

}  // namespace morphbus::dynarole
