#pragma once
// Texts that an editor has open, and places in them as it counts: lines and characters from 0.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "compiler/source/source_text.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// What a character of a line counts as (LSP 3.17, PositionEncodingKind): bytes of UTF-8, or units
/// of UTF-16, which every client knows.
enum class PositionEncoding { kUtf8, kUtf16 };

/// A place in a text.
struct Position {
  int line = 0;
  int character = 0;
};

/// The position of a JSON object with "line" and "character"; nothing if it is none.
std::optional<Position> PositionOf(const Json& json);

/// The byte of file `file` at a position; beyond the end of a line or of the text, that end.
size_t OffsetAt(const source::SourceSet& sources, int file, Position position,
                PositionEncoding encoding);
/// The position of a byte.
Json PositionJson(const source::SourceSet& sources, int file, size_t offset,
                  PositionEncoding encoding);
/// The range of a span, {"start": ..., "end": ...}.
Json RangeJson(const source::SourceSet& sources, const source::Span& span,
               PositionEncoding encoding);

/// The path that a `file:` URI names; nothing for other URIs.
std::optional<std::string> PathOfUri(std::string_view uri);
/// The URI of an absolute path.
std::string UriOfPath(std::string_view path);

/// A text that is open.
struct Document {
  std::string uri;
  /// The canonical path; of a text that is no file yet, one that is made of its URI.
  std::string path;
  /// The number that the editor gives to each state of the text.
  int version = 0;
  /// Grows with each state of any document: what was made of this one is good while it is the same.
  int64_t revision = 0;
  /// The text alone, for its lines.
  source::SourceSet sources;

  [[nodiscard]] std::string_view text() const { return sources.text(0); }
  [[nodiscard]] bool is_model() const { return path.ends_with(".m3l"); }
  [[nodiscard]] bool is_program() const { return path.ends_with(".dyn"); }
  /// Replaces the whole text.
  void Set(std::string text);
  /// Carries out one of the "contentChanges" of a change; false if it is none.
  bool Change(const Json& change, PositionEncoding encoding);
};

}  // namespace morphbus::tools
