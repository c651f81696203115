#pragma once
// Bytes as text. Who includes this links libsodium.

#include <sodium/utils.h>

#include <optional>
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

/// The bytes that such a text stands for; nothing if it is none.
inline std::optional<std::string> FromBase64(const std::string& text) {
  std::string bytes(text.size() / 4 * 3, '\0');
  size_t size = 0;
  const int wrong =
      sodium_base642bin(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), text.data(),
                        text.size(), nullptr, &size, nullptr, sodium_base64_VARIANT_ORIGINAL);
  if (wrong != 0) return std::nullopt;
  bytes.resize(size);
  return bytes;
}

}  // namespace morphbus
