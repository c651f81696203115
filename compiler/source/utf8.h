#pragma once
// Source files are UTF-8; what is not is reported before anything is made of it, so that names,
// strings and excerpts can go to JSON, XML and terminals as they are.

#include "compiler/source/diagnostics.h"

namespace morphbus::source {

/// Reports one error at the first byte of file `file` that is not UTF-8, if there is one.
void CheckUtf8(const SourceSet& sources, int file, Diagnostics* diagnostics);

}  // namespace morphbus::source
