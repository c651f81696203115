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

/// A comment that stands on a line of its own, or several if it is a block comment.
struct CommentLine {
  /// The text from `//`, `#` or `/*` on; white space at the ends of its lines is cut off.
  std::string text;
  /// True if an empty line stands before it.
  bool blank_before = false;
};
/// The comments between two tokens, and how they stand. ReadGap makes it.
struct GapComments {
  /// The comments on the line of the token before the gap; they end that line.
  std::string trailing;
  /// The comments on lines of their own.
  std::vector<CommentLine> lines;
  /// Comments `/* */` on the line of the token after the gap.
  std::vector<std::string> inner;
  /// True if an empty line stands before the token after the gap.
  bool blank_after = false;
};

/// Comments in [begin, end) of `text`, which lies between two tokens (or at an end of the file).
/// `hash_comments`: `#` begins a comment too.
GapComments ReadGap(std::string_view text, size_t begin, size_t end, bool hash_comments);

/// All comments of a gap joined, white space left out: what no formatting may change.
std::string CommentContent(const GapComments& gap);

/// A token of the source and how it may be laid out. CutUp fills in the text and the comments, the
/// formatter of the language the rest.
struct LayoutToken {
  /// The characters of the token; they belong to the source text, which must outlive the layout.
  std::string_view text;
  /// True if a space stands before it where the line goes on.
  bool space = false;
  /// True if it may begin a line.
  bool may_break = false;
  /// True if it must begin a line where its statement has more than one.
  bool separate = false;
  /// True for an opening bracket, ( or [.
  bool opens = false;
  /// True for a closing bracket, ) or ].
  bool closes = false;
  /// The comments before it; `trailing` in them belongs to the token before and is not read here.
  GapComments before;
  /// The comment behind it on its line, or "".
  std::string trailing;
};

/// Writes statements one after another. A formatter makes one for each file, calls LinesBefore and
/// Statement in the order of the source, and takes the text at the end.
class LayoutWriter {
 public:
  /// `tokens` are those of the whole file, in order; the functions below refer to them by index.
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

  /// The text that was written. The writer must not be used after that.
  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  /// Ends the current line if one is begun, and indents the next by `indent` columns.
  void NewLine(size_t indent);
  /// Writes token `i` with its comments; lines that they need are indented by `indent`.
  void Emit(size_t i, size_t indent);
  /// Writes tokens [begin, end) with Emit, without line breaks of its own.
  void EmitFlat(size_t begin, size_t end, size_t indent);
  /// Writes tokens [begin, end) part by part, each beginning where a break is possible, and starts
  /// a new line where a part does not fit or, if `spread`, before each.
  void Fill(size_t begin, size_t end, size_t indent, bool spread);
  /// Writes a part that does not fit on a line: the insides of its brackets are filled into lines
  /// of their own.
  void Broken(size_t begin, size_t end, size_t indent);
  /// The width of the tokens that follow token `end` up to the next possible break.
  [[nodiscard]] size_t TailWidth(size_t end) const;
  /// True if tokens [begin, end) and what cannot be parted from them fit on the current line.
  [[nodiscard]] bool Fits(size_t begin, size_t end) const;

  std::vector<LayoutToken> tokens_;
  /// match_[i] is the index of the token that closes the bracket which token `i` opens.
  std::vector<size_t> match_;
  /// The end of the statement that is being written, as an index into tokens_.
  size_t statement_end_ = 0;
  std::string out_;
  /// The place in out_ where the current line begins.
  size_t line_begin_ = 0;
  /// True while nothing but indentation stands on the line.
  bool fresh_ = true;
  /// True if the line ended with a comment and must not go on.
  bool comment_end_ = false;
};

}  // namespace morphbus::source
