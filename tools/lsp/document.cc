#include "tools/lsp/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "compiler/base/utf8.h"

namespace morphbus::tools {
namespace {

/// The characters of a URI's path that stand for themselves (RFC 3986).
bool IsPlain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("/-._~").find(c) != std::string_view::npos;
}

/// How many characters of the protocol the character of `bytes` bytes counts as: beyond the first
/// plane, which takes four bytes, UTF-16 has two units.
size_t UnitsOf(size_t bytes, PositionEncoding encoding) {
  if (encoding == PositionEncoding::kUtf8) return bytes;
  return bytes == 4 ? 2 : 1;
}

/// The bytes of the character at `at`; a byte that begins none counts by itself.
size_t LengthAt(std::string_view text, size_t at) {
  return std::max<size_t>(Utf8Length(text, at), 1);
}

}  // namespace

std::optional<Position> PositionOf(const Json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto number = [&](const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_number_integer() ? found->get<int64_t>() : -1;
  };
  constexpr int64_t kMost = 1'000'000'000;
  const int64_t line = number("line"), character = number("character");
  if (line < 0 || character < 0) return std::nullopt;
  return Position{static_cast<int>(std::min(line, kMost)),
                  static_cast<int>(std::min(character, kMost))};
}

size_t OffsetAt(const source::SourceSet& sources, int file, Position position,
                PositionEncoding encoding) {
  const std::string_view text = sources.text(file);
  // The line is found by halving: LineOf grows with the offset.
  size_t low = 0, high = text.size();
  while (low < high) {
    const size_t middle = (low + high) / 2;
    if (sources.LineOf(file, middle) - 1 < position.line) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (sources.LineOf(file, low) - 1 < position.line) return text.size();
  const std::string_view line = sources.LineAt(file, low);
  size_t at = static_cast<size_t>(line.data() - text.data());
  const size_t end = at + line.size();
  for (size_t units = 0; at < end && units < static_cast<size_t>(position.character);) {
    const size_t length = LengthAt(text, at);
    units += UnitsOf(length, encoding);
    // A place within a character is its beginning.
    if (units > static_cast<size_t>(position.character)) break;
    at += length;
  }
  return std::min(at, end);
}

Json PositionJson(const source::SourceSet& sources, int file, size_t offset,
                  PositionEncoding encoding) {
  const std::string_view text = sources.text(file);
  offset = std::min(offset, text.size());
  const std::string_view line = sources.LineAt(file, offset);
  size_t units = 0;
  for (size_t at = static_cast<size_t>(line.data() - text.data()); at < offset;) {
    const size_t length = LengthAt(text, at);
    units += UnitsOf(length, encoding);
    at += length;
  }
  return {{"line", sources.LineOf(file, offset) - 1}, {"character", units}};
}

Json RangeJson(const source::SourceSet& sources, const source::Span& span,
               PositionEncoding encoding) {
  return {{"start", PositionJson(sources, span.file, span.begin, encoding)},
          {"end", PositionJson(sources, span.file, span.end, encoding)}};
}

std::optional<std::string> PathOfUri(std::string_view uri) {
  constexpr std::string_view kScheme = "file://";
  if (!uri.starts_with(kScheme)) return std::nullopt;
  uri.remove_prefix(kScheme.size());
  // A host may stand before the path; only this one has files for us.
  if (uri.starts_with("localhost/")) uri.remove_prefix(std::string_view("localhost").size());
  if (!uri.starts_with("/")) return std::nullopt;
  std::string path;
  for (size_t i = 0; i < uri.size(); ++i) {
    unsigned byte = 0;
    const bool escape =
        uri[i] == '%' && i + 2 < uri.size() &&
        std::from_chars(&uri[i + 1], &uri[i + 1] + 2, byte, 16).ptr == &uri[i + 1] + 2;
    path += escape ? static_cast<char>(byte) : uri[i];
    if (escape) i += 2;
  }
  // A zero byte would silently name another file.
  return path.find('\0') == std::string::npos ? std::optional(path) : std::nullopt;
}

std::string UriOfPath(std::string_view path) {
  std::string uri = "file://";
  for (const char c : path) {
    uri += IsPlain(c)
               ? std::string(1, c)
               : fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  }
  return uri;
}

void Document::Set(std::string text) {
  sources = source::SourceSet();
  sources.AddText(path, std::move(text));
}

bool Document::Change(const Json& change, PositionEncoding encoding) {
  if (!change.is_object() || !change.contains("text") || !change["text"].is_string()) return false;
  const std::string& text = change["text"].get_ref<const std::string&>();
  if (!change.contains("range")) {
    Set(text);
    return true;
  }
  const Json& range = change["range"];
  if (!range.is_object()) return false;
  const std::optional<Position> from = PositionOf(range.value("start", Json()));
  const std::optional<Position> to = PositionOf(range.value("end", Json()));
  if (!from || !to) return false;
  const size_t begin = OffsetAt(sources, 0, *from, encoding);
  const size_t end = std::max(begin, OffsetAt(sources, 0, *to, encoding));
  std::string all(this->text());
  all.replace(begin, end - begin, text);
  Set(std::move(all));
  return true;
}

}  // namespace morphbus::tools
