#pragma once
// Canonical layout of source text: tokens and comments to lines of at most kLayoutWidth columns.
// The languages' formatters say how tokens are spaced and where statements begin; line breaking and
// comments are done here, for all alike.

#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/source_text.h"

namespace morphbus::source {

/// Lines are broken to fit this many bytes, where a break is possible.
constexpr size_t kLayoutWidth = 100;

/// The comments between two tokens, and how they stand.
struct CommentLine {
  std::string text;           ///< From `//`, `#` or `/*` on, white space at line ends cut off.
  bool blank_before = false;  ///< An empty line stands before it.
};
struct GapComments {
  std::string trailing;            ///< On the line of the token before the gap, and ends that line.
  std::vector<CommentLine> lines;  ///< On lines of their own.
  std::vector<std::string> inner;  ///< `/* */` with the token after the gap on the same line.
  bool blank_after = false;        ///< An empty line stands before the token after the gap.
};

/// Comments in [begin, end) of `text`, which lies between two tokens (or at an end of the file).
/// `hash_comments`: `#` begins a comment too.
GapComments ReadGap(std::string_view text, size_t begin, size_t end, bool hash_comments);

/// All comments of a gap joined, white space left out: what no formatting may change.
std::string CommentContent(const GapComments& gap);

struct LayoutToken {
  std::string_view text;
  bool space = false;      ///< A space before it, if the line goes on.
  bool may_break = false;  ///< It may begin a line.
  bool separate = false;   ///< It does begin a line if its statement has more than one.
  bool opens = false;      ///< ( or [
  bool closes = false;     ///< ) or ]
  GapComments before;      ///< `trailing` belongs to the token before it and is not read here.
  std::string trailing;    ///< Comment behind it on its line.
};

/// Writes statements one after another.
class LayoutWriter {
 public:
  explicit LayoutWriter(std::vector<LayoutToken> tokens);

  /// The comment lines of the gap before a statement, and the empty lines round them: `blank_first`
  /// keeps one before all, `blank_last` one after all.
  void LinesBefore(const GapComments& gap, size_t indent, bool blank_first, bool blank_last);

  /// Tokens [begin, end) as one statement: on one line if it fits. Otherwise tokens [begin, head)
  /// stay together and the rest is filled into lines that begin at column `hang`; if `spread`, with
  /// one part (a run without a possible break) on each line.
  void Statement(size_t begin, size_t head, size_t end, size_t indent, size_t hang, bool spread);

  /// Token `i` begins a line if its statement has more than one.
  void Separate(size_t i) { tokens_[i].separate = true; }
  /// The token after the parenthesis that token `i` opens.
  [[nodiscard]] size_t AfterGroup(size_t i) const { return match_[i] + 1; }

  /// Ends the current line, if one is begun.
  void EndLine();
  /// The length of tokens [begin, end) on one line; kTooLong if a comment forces a line break.
  [[nodiscard]] size_t FlatWidth(size_t begin, size_t end) const;
  static constexpr size_t kTooLong = size_t{1} << 30;

  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  void NewLine(size_t indent);
  void Emit(size_t i, size_t indent);
  void EmitFlat(size_t begin, size_t end, size_t indent);
  /// Parts of [begin, end), each beginning where a break is possible.
  void Fill(size_t begin, size_t end, size_t indent, bool spread);
  /// A part that does not fit on a line: its parentheses are broken up.
  void Broken(size_t begin, size_t end, size_t indent);
  /// What follows token `end` without a possible break.
  [[nodiscard]] size_t TailWidth(size_t end) const;
  [[nodiscard]] bool Fits(size_t begin, size_t end) const;

  std::vector<LayoutToken> tokens_;
  std::vector<size_t> match_;  ///< For an opening token: the index of the closing one.
  size_t statement_end_ = 0;
  std::string out_;
  size_t line_begin_ = 0;     ///< Index into out_.
  bool fresh_ = true;         ///< Nothing but indentation on the line yet.
  bool comment_end_ = false;  ///< The line ended with a comment and must not go on.
};

}  // namespace morphbus::source
