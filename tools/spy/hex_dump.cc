#include "tools/spy/hex_dump.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/base/text.h"

namespace morphbus::tools {
namespace {

constexpr size_t kFingerprintBytes = 8;

/// Cells of a line of so many bytes: place, bytes with blanks and a wider gap in their middle,
/// text.
int CellsOf(size_t bytes) {
  return static_cast<int>(4 + 2 + 3 * bytes + (bytes > 4 ? 1 : 0) + 1 + bytes);
}

/// The line of `count` bytes from `begin` on, where a whole line has `most`.
ScreenLine DumpLine(const std::vector<uint8_t>& bytes, size_t begin, size_t most) {
  const size_t count = std::min(most, bytes.size() - begin);
  ScreenLine line = {{fmt::format("{:04x}  ", begin), Style::kDim}};
  std::string text;
  for (size_t i = 0; i < most; ++i) {
    if (most > 4 && i == most / 2) line.push_back({" "});
    // The last line is filled up, so that the texts stand below each other.
    if (i >= count) {
      line.push_back({"   "});
      continue;
    }
    const uint8_t byte = bytes[begin + i];
    line.push_back({fmt::format("{:02x} ", byte),
                    begin + i < kFingerprintBytes ? Style::kKey : Style::kPlain});
    text += byte >= 0x20 && byte < 0x7f ? static_cast<char>(byte) : '.';
  }
  line.push_back({" " + text, Style::kDim});
  return line;
}

}  // namespace

Screen HexDump(const std::vector<uint8_t>& bytes, size_t size, int width) {
  const size_t most = width >= CellsOf(16) ? 16 : width >= CellsOf(8) ? 8 : 4;
  Screen lines;
  for (size_t begin = 0; begin < bytes.size(); begin += most) {
    lines.push_back(DumpLine(bytes, begin, most));
  }
  if (size > bytes.size()) {
    const auto more = static_cast<int64_t>(size - bytes.size());
    lines.push_back({{"and " + Counted(more, "more byte"), Style::kDim}});
  }
  return lines;
}

}  // namespace morphbus::tools
