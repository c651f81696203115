#include "compiler/source/format_frame.h"

namespace morphbus::source {
namespace {

/// The tokens and comments of a text without the white space between them, which is all that
/// formatting may change.
std::string Content(std::string_view text, const std::vector<Span>& spans, bool hash_comments) {
  const CutText cut = CutUp(text, spans, hash_comments);
  std::string content;
  for (size_t i = 0; i < cut.gaps.size(); ++i) {
    content += CommentContent(cut.gaps[i]) + '\n';
    if (i < cut.tokens.size()) content += cut.tokens[i].text;
  }
  return content;
}

}  // namespace

CutText CutUp(std::string_view text, const std::vector<Span>& spans, bool hash_comments) {
  CutText cut;
  // A gap runs from the end of one token to the beginning of the next.
  size_t begin = 0;
  for (const Span& span : spans) {
    cut.gaps.push_back(ReadGap(text, begin, span.begin, hash_comments));
    LayoutToken& token = cut.tokens.emplace_back();
    token.text = text.substr(span.begin, span.end - span.begin);
    token.before = cut.gaps.back();
    begin = span.end;
  }
  cut.gaps.push_back(ReadGap(text, begin, text.size(), hash_comments));
  // A comment behind a token on its line was read with the gap that follows the token.
  for (size_t i = 0; i < cut.tokens.size(); ++i) cut.tokens[i].trailing = cut.gaps[i + 1].trailing;
  return cut;
}

std::optional<std::string> IfUnchanged(const SourceSet& sources, int file, const Lexis& lexis,
                                       std::string formatted, Diagnostics* diagnostics) {
  // Both texts are cut up anew by the same lexer, so that the proof does not rest on the formatter.
  SourceSet again;
  Diagnostics found;
  const int copy = again.AddText(sources.name(file), formatted);
  const std::string before =
      Content(sources.text(file), lexis.tokens(sources, file, &found), lexis.hash_comments);
  const std::string after =
      Content(again.text(copy), lexis.tokens(again, copy, &found), lexis.hash_comments);
  // Only white space may differ: the same tokens with the same comments in the gaps between them.
  if (!found.had_errors() && before == after) return formatted;
  diagnostics->Error({file, 0, 0}, "cannot be laid out without changing it; please report this");
  return std::nullopt;
}

}  // namespace morphbus::source
