// Any text as .lcm files, and any bytes as a message of their types: never a crash, and no more
// time or memory than the limits allow. The input is the text, a zero byte, then messages, each
// after an unused byte and two for its size. A message is tried as it is, then with the fingerprint
// of each type before it, so that the decoder is reached.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "tools/spy/lcm_parser.h"
#include "tools/spy/lcm_schema.h"

namespace {

using morphbus::tools::LcmSchema;
using morphbus::tools::LcmType;

/// Decode and Fits must agree, whatever the bytes are.
void Try(const LcmSchema& schema, const std::vector<uint8_t>& bytes) {
  const auto json = schema.Decode(bytes.data(), bytes.size());
  if (bytes.size() < 8) return;
  uint64_t fingerprint = 0;
  for (size_t i = 0; i < 8; ++i) fingerprint = fingerprint << 8 | bytes[i];
  const LcmType* type = schema.Find(static_cast<int64_t>(fingerprint));
  const bool fits = type != nullptr && schema.Fits(*type, bytes.data(), bytes.size());
  if (fits != json.has_value()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const auto* end = static_cast<const uint8_t*>(std::memchr(data, 0, size));
  const size_t length = end == nullptr ? size : static_cast<size_t>(end - data);
  const std::string text(reinterpret_cast<const char*>(data), length);
  const auto types = morphbus::tools::ParseLcm(text);
  std::vector<std::string> warnings;
  // The same text twice, as two files: the second adds nothing.
  const auto schema = LcmSchema::ParseFiles({{"a.lcm", text}, {"b.lcm", text}}, &warnings);
  if (schema.has_value() != types.has_value()) std::abort();
  if (!schema || end == nullptr) return 0;
  size -= length + 1;
  const uint8_t* rest = end + 1;
  while (size >= 3) {
    const size_t count = std::min<size_t>(size_t{rest[1]} << 8 | rest[2], size - 3);
    std::vector<uint8_t> bytes(rest + 3, rest + 3 + count);
    Try(*schema, bytes);
    bytes.insert(bytes.begin(), 8, 0);
    size_t tried = 0;
    for (const LcmType& type : *types) {
      if (++tried > 8) break;
      const LcmType* known = schema->FindByName(type.name);
      if (known == nullptr) continue;
      for (size_t i = 0; i < 8; ++i) {
        bytes[i] = static_cast<uint8_t>(static_cast<uint64_t>(known->fingerprint) >> (56 - 8 * i));
      }
      Try(*schema, bytes);
    }
    rest += 3 + count;
    size -= 3 + count;
  }
  return 0;
}
