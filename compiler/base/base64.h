#pragma once
// Bytes as text. Who includes this links libsodium.

#include <sodium/utils.h>

#include <string>

namespace morphbus {

/// Base64 with padding (RFC 4648).
inline std::string Base64(const std::string& bytes) {
  constexpr int kWithPadding = sodium_base64_VARIANT_ORIGINAL;
  // With a NUL at the end, which a string has of its own.
  std::string text(sodium_base64_ENCODED_LEN(bytes.size(), kWithPadding), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(bytes.data()),
                    bytes.size(), kWithPadding);
  text.pop_back();
  return text;
}

}  // namespace morphbus
