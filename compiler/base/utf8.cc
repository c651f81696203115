#include "compiler/base/utf8.h"

#include <algorithm>

namespace morphbus {

size_t CountCharacters(std::string_view text) {
  return text.size() - static_cast<size_t>(std::ranges::count_if(text, ContinuesCharacter));
}

size_t Utf8Length(std::string_view text, size_t at) {
  // The text counts as followed by zeros, which are no continuation bytes.
  const auto byte = [&](size_t i) {
    return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U;
  };
  const uint32_t first = byte(0);
  if (at < text.size() && first < 0x80) return 1;
  // What the first byte of each longer form looks like, and the least code point that needs so
  // many bytes: below it the form is overlong.
  struct Form {
    uint32_t mask, mark, least;
  };
  constexpr Form kForms[] = {{0xE0, 0xC0, 0x80}, {0xF0, 0xE0, 0x800}, {0xF8, 0xF0, 0x10000}};
  for (size_t more = 1; more <= 3; ++more) {
    const Form& form = kForms[more - 1];
    if ((first & form.mask) != form.mark) continue;
    uint32_t code = first & ~form.mask;
    for (size_t i = 1; i <= more; ++i) {
      // Every further byte has the mark of a continuation and six bits of the code.
      if ((byte(i) & 0xC0U) != 0x80U) return 0;
      code = code << 6U | (byte(i) & 0x3FU);
    }
    // Halves of UTF-16's pairs are no characters (RFC 3629), and 0x10FFFF is the last one.
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    return code < form.least || code > 0x10FFFF || surrogate ? 0 : more + 1;
  }
  return 0;
}

uint32_t Utf8Code(std::string_view text, size_t at) {
  const size_t length = Utf8Length(text, at);
  const auto first = static_cast<unsigned char>(text[at]);
  if (length <= 1) return first;
  // The first byte keeps the bits behind its length mark; each further byte adds six.
  uint32_t code = first & 0x7FU >> length;
  for (size_t i = 1; i < length; ++i) {
    code = code << 6U | (static_cast<unsigned char>(text[at + i]) & 0x3FU);
  }
  return code;
}

size_t FirstNotUtf8(std::string_view text, size_t at) {
  while (at < text.size()) {
    const size_t length = Utf8Length(text, at);
    if (length == 0) return at;
    at += length;
  }
  return text.size();
}

bool IsUtf8(std::string_view text) { return FirstNotUtf8(text) == text.size(); }

}  // namespace morphbus
