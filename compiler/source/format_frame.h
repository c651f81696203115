#pragma once
// What the formatters of the languages have in common: comments between tokens, and the proof that
// formatting changed nothing.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/source/layout.h"

namespace morphbus::source {

/// How a language is cut up.
struct Lexis {
  /// The tokens of a file without an end mark, in order; errors go to the diagnostics.
  std::function<std::vector<Span>(const SourceSet&, int file, Diagnostics&)> tokens;
  bool hash_comments = false;  ///< `#` begins a comment too.
};

/// The comments before each of `tokens`, and last those before the end of `text`.
std::vector<GapComments> ReadGaps(std::string_view text, const std::vector<Span>& tokens,
                                  bool hash_comments);

/// `formatted`, if it has the tokens and comments of file `file`; else an error: a formatter that
/// changes what it formats is worse than none.
std::optional<std::string> IfUnchanged(const SourceSet& sources, int file, const Lexis& lexis,
                                       std::string formatted, Diagnostics& diagnostics);

}  // namespace morphbus::source
