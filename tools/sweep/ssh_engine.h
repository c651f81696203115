#pragma once
// Runs rows on other machines, over ssh. What they need is the program, and nothing else.

#include "tools/sweep/engine.h"

namespace morphbus::tools {

/// Runs all rows of `source` on the hosts of the settings. A host of another build, or with other
/// arithmetic, is refused, and one that is lost gives its rows to the others; a warning says so.
/// Fails if no host is left, or with an error of `source`.
EngineResult RunOverSsh(const EngineOptions& options, RowSource* source);

}  // namespace morphbus::tools
