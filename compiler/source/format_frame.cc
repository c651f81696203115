#include "compiler/source/format_frame.h"

namespace morphbus::source {
namespace {

/// What formatting must leave as it is.
std::string Content(std::string_view text, const std::vector<Span>& tokens, bool hash_comments) {
  const std::vector<GapComments> gaps = ReadGaps(text, tokens, hash_comments);
  std::string content;
  for (size_t i = 0; i < gaps.size(); ++i) {
    content += CommentContent(gaps[i]) + '\n';
    if (i < tokens.size()) content += text.substr(tokens[i].begin, tokens[i].end - tokens[i].begin);
  }
  return content;
}

}  // namespace

std::vector<GapComments> ReadGaps(std::string_view text, const std::vector<Span>& tokens,
                                  bool hash_comments) {
  std::vector<GapComments> gaps;
  size_t begin = 0;
  for (const Span& token : tokens) {
    gaps.push_back(ReadGap(text, begin, token.begin, hash_comments));
    begin = token.end;
  }
  gaps.push_back(ReadGap(text, begin, text.size(), hash_comments));
  return gaps;
}

std::optional<std::string> IfUnchanged(const SourceSet& sources, int file, const Lexis& lexis,
                                       std::string formatted, Diagnostics& diagnostics) {
  SourceSet again;
  Diagnostics found;
  const int copy = again.AddText(sources.name(file), formatted);
  const std::string before =
      Content(sources.text(file), lexis.tokens(sources, file, found), lexis.hash_comments);
  const std::string after =
      Content(again.text(copy), lexis.tokens(again, copy, found), lexis.hash_comments);
  if (!found.had_errors() && before == after) return formatted;
  diagnostics.Error({file, 0, 0}, "cannot be laid out without changing it; please report this");
  return std::nullopt;
}

}  // namespace morphbus::source
