#include "compiler/base/text.h"

#include <cstdio>

#include "compiler/base/utf8.h"

namespace morphbus {
namespace {

/// True for characters beyond ASCII that a terminal obeys instead of showing: C1 controls, the two
/// line separators, and the marks that turn the direction of writing (Unicode 15, Bidi_Control).
bool IsInvisibleControl(uint32_t code) {
  return (code >= 0x80 && code <= 0x9F) || code == 0x061C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string Counted(int64_t count, std::string_view one, std::string_view many) {
  // The plural is regular unless `many` says otherwise.
  std::string text = std::to_string(count) + " ";
  if (count == 1 || many.empty()) {
    text += one;
    if (count != 1) text += "s";
  } else {
    text += many;
  }
  return text;
}

std::string NameFirst(const std::vector<std::string>& names, size_t most) {
  std::string text;
  // The rest is told by its number alone, so that a message stays readable whatever a file names.
  for (size_t i = 0; i < names.size() && i < most; ++i) text += (i > 0 ? ", " : "") + names[i];
  if (names.size() > most) text += " and " + std::to_string(names.size() - most) + " more";
  return text;
}

std::string CsvCell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string cell = "\"";
  for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + "\"";
}

std::string Hex(uint64_t value, int digits) {
  // Sixteen digits are all that a value can have.
  char text[24];
  std::snprintf(text, sizeof text, "%0*llx", digits < 16 ? digits : 16,
                static_cast<unsigned long long>(value));
  return text;
}

std::string EscapeControl(std::string_view text) {
  std::string out;
  for (size_t at = 0; at < text.size();) {
    // Character by character; a byte that begins none counts as one.
    const size_t length = Utf8Length(text, at);
    const auto byte = static_cast<unsigned char>(text[at]);
    if (length <= 1) {
      // An ASCII character, or a byte that begins no character.
      if (byte == '\n') {
        out += "\\n";
      } else if (byte == '\r') {
        out += "\\r";
      } else if (byte == '\t') {
        out += "\\t";
      } else if (length == 0 || byte < 0x20 || byte == 0x7F) {
        out += "\\x" + Hex(byte, 2);
      } else {
        out += text[at];
      }
      ++at;
      continue;
    }
    // A longer character stays as it is unless a terminal would obey it.
    const uint32_t code = Utf8Code(text, at);
    if (IsInvisibleControl(code)) {
      out += "\\u" + Hex(code, 4);
    } else {
      out += text.substr(at, length);
    }
    at += length;
  }
  return out;
}

}  // namespace morphbus
