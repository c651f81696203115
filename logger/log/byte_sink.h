#pragma once
// Where the writers of files put their bytes: a file, a stream, or a test's memory.

#include <cstdint>
#include <functional>
#include <span>

#include "compiler/base/result.h"

namespace morphbus::logger {

/// Takes the next bytes of an output; fails if they cannot be written.
using ByteSink = std::function<Result<void>(std::span<const uint8_t>)>;

}  // namespace morphbus::logger
