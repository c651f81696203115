#pragma once
// Bytes of which nobody knows what they mean, for people.

#include <cstdint>
#include <vector>

#include "tools/spy/screen.h"

namespace morphbus::tools {

/// Lines of at most `width` cells (as few as 23 are used): where they begin, 16, 8 or 4 bytes in
/// hexadecimal digits, and the same as ASCII, with a point for what cannot be printed. `bytes` are
/// the first ones of a message of `size` bytes, at most 65536; those that are missing are counted.
/// The first eight, LCM's fingerprint of the type, have a style of their own.
Screen HexDump(const std::vector<uint8_t>& bytes, size_t size, int width);

}  // namespace morphbus::tools
