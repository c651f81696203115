#include "compiler/source/utf8.h"

#include <cstdint>
#include <cstdio>

namespace morphbus::source {
namespace {

/// The first byte of `text` from `at` on that begins no character; its size if there is none.
size_t FirstBad(std::string_view text, size_t at) {
  while (at < text.size()) {
    const size_t length = Utf8Length(text, at);
    if (length == 0) return at;
    at += length;
  }
  return text.size();
}

}  // namespace

size_t Utf8Length(std::string_view text, size_t at) {
  const auto byte = [&](size_t i) {
    return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U;
  };
  const uint32_t first = byte(0);
  if (at < text.size() && first < 0x80) return 1;
  // The least code point that needs so many bytes; below it the form is overlong.
  struct Form {
    uint32_t mask, mark, least;
  };
  constexpr Form kForms[] = {{0xE0, 0xC0, 0x80}, {0xF0, 0xE0, 0x800}, {0xF8, 0xF0, 0x10000}};
  for (size_t more = 1; more <= 3; ++more) {
    const Form& form = kForms[more - 1];
    if ((first & form.mask) != form.mark) continue;
    uint32_t code = first & ~form.mask;
    for (size_t i = 1; i <= more; ++i) {
      if ((byte(i) & 0xC0U) != 0x80U) return 0;
      code = code << 6U | (byte(i) & 0x3FU);
    }
    const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
    return code < form.least || code > 0x10FFFF || surrogate ? 0 : more + 1;
  }
  return 0;
}

bool IsUtf8(std::string_view text) { return FirstBad(text, 0) == text.size(); }

void CheckUtf8(const SourceSet& sources, int file, Diagnostics& diagnostics) {
  const std::string_view text = sources.text(file);
  const size_t at = FirstBad(text, 0);
  if (at == text.size()) return;
  char hex[8];
  std::snprintf(hex, sizeof hex, "\\x%02x", unsigned{static_cast<unsigned char>(text[at])});
  const bool more = FirstBad(text, at + 1) < text.size();
  diagnostics
      .Error({file, at, at + 1},
             std::string("byte ") + hex + " is not UTF-8" + (more ? ", nor are others" : ""))
      .hint = "save the file as UTF-8";
}

}  // namespace morphbus::source
