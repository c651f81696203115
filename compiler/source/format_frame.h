#pragma once
// What the formatters of the languages have in common: cutting a text into tokens and the comments
// between them, and the proof that formatting changed neither.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/source/layout.h"

namespace morphbus::source {

/// How a language is cut into tokens: its formatter fills this in with its lexer.
struct Lexis {
  /// The spans of a file's tokens in order, without the mark at the end; errors go to the
  /// diagnostics.
  std::function<std::vector<Span>(const SourceSet&, int file, Diagnostics*)> tokens;
  /// True if `#` begins a comment too, besides `//` and `/*`.
  bool hash_comments = false;
};

/// The spans of `tokens` but for the last, which marks the end of the file.
template <typename Token>
std::vector<Span> SpansOf(const std::vector<Token>& tokens) {
  std::vector<Span> spans;
  for (size_t i = 0; i + 1 < tokens.size(); ++i) spans.push_back(tokens[i].span);
  return spans;
}

/// A text cut up for its layout. It refers to the text, which must outlive it.
struct CutText {
  /// The comments before each token, and last those before the end of the text.
  std::vector<GapComments> gaps;
  /// The tokens with their texts and comments; how they are spaced is for the language to say.
  std::vector<LayoutToken> tokens;
};

/// Cuts up `text`, whose tokens are at `spans`; the result refers to `text`. `hash_comments` is as
/// in Lexis.
CutText CutUp(std::string_view text, const std::vector<Span>& spans, bool hash_comments);

/// Returns `formatted` if it has the same tokens and comments as file `file`. Otherwise reports an
/// error and returns nothing: a formatter that changes what it formats is worse than none.
std::optional<std::string> IfUnchanged(const SourceSet& sources, int file, const Lexis& lexis,
                                       std::string formatted, Diagnostics* diagnostics);

}  // namespace morphbus::source
