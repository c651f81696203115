#pragma once
// Files whole: read with a limit, written so that nobody ever sees half of one.

#include <cstddef>
#include <string>

#include "compiler/base/result.h"

namespace morphbus::tools {

/// The whole content of a file of at most `limit` bytes.
Result<std::string> ReadFile(const std::string& path, size_t limit = size_t{1} << 30);
/// Writes under a temporary name beside `path`, syncs and renames, so that `path` is never half a
/// file. A file that was there keeps its permissions, a symbolic link stays one (its target is
/// written, also where that was not there), a pipe, a device or a stream such as /dev/stdout is
/// written to as it is. `path` "-" is stdout. The error names the path and the reason.
Result<void> WriteFile(const std::string& path, const std::string& bytes);

}  // namespace morphbus::tools
