#pragma once
// UTF-8 (RFC 3629), character by character.

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace morphbus {

/// True for the second and later bytes of a character.
[[nodiscard]] constexpr bool ContinuesCharacter(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
}

/// The number of characters of `text`: bytes that continue one do not count.
[[nodiscard]] size_t CountCharacters(std::string_view text);

/// The number of bytes of the character that begins at `at`. It is 0 if none does: at a stray or
/// missing continuation byte, an overlong form, a surrogate, or a code beyond U+10FFFF.
[[nodiscard]] size_t Utf8Length(std::string_view text, size_t at);

/// The code point of the character that begins at `at`; one does, as Utf8Length said.
[[nodiscard]] uint32_t Utf8Code(std::string_view text, size_t at);

/// The place of the first byte of `text`, from `at` on, that begins no character; the size of
/// `text` if all of it is UTF-8.
[[nodiscard]] size_t FirstNotUtf8(std::string_view text, size_t at = 0);

/// True if all of `text` is UTF-8.
[[nodiscard]] bool IsUtf8(std::string_view text);

}  // namespace morphbus
