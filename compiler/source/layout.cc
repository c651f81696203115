#include "compiler/source/layout.h"

#include <algorithm>

namespace morphbus::source {
namespace {

/// White space within a line.
bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

/// `text` without white space at the ends of its lines, which end with newlines.
std::string TrimLineEnds(std::string_view text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    // Blanks are taken back once the end of their line is seen.
    const bool ends = EndsLine(text, i);
    while (ends && !out.empty() && IsBlank(out.back())) out.pop_back();
    out += ends ? '\n' : text[i];
  }
  while (!out.empty() && IsBlank(out.back())) out.pop_back();
  return out;
}

/// One comment as found: on which line of the gap it begins and ends.
struct Found {
  std::string text;
  int first_line = 0;
  int last_line = 0;
  bool blank_before = false;
};

}  // namespace

GapComments ReadGap(std::string_view text, size_t begin, size_t end, bool hash_comments) {
  std::vector<Found> found;
  int line = begin == 0 ? 1 : 0;      // Nothing stands before the first token's line.
  int newlines = begin == 0 ? 1 : 0;  // Since the last token or comment.
  // The gap is read line by line: newlines are counted, comments kept, white space passed over.
  size_t i = begin;
  while (i < end) {
    const char c = text[i];
    if (EndsLine(text, i)) {
      ++line;
      ++newlines;
      ++i;
      continue;
    }
    const bool block = text.substr(i, 2) == "/*";
    // Whatever begins no comment is passed over; between tokens that is white space.
    if (!block && text.substr(i, 2) != "//" && !(hash_comments && c == '#')) {
      ++i;
      continue;
    }
    // A block comment ends behind its mark, another before the end of its line.
    size_t stop = block ? text.find("*/", i + 2) : text.find_first_of("\r\n", i);
    stop = stop == std::string_view::npos ? end : std::min(end, stop + (block ? 2 : 0));
    Found comment{TrimLineEnds(text.substr(i, stop - i)), line, line, newlines > 1};
    line += static_cast<int>(std::count(comment.text.begin(), comment.text.end(), '\n'));
    comment.last_line = line;
    found.push_back(std::move(comment));
    newlines = 0;
    i = stop;
  }
  // A comment on the line of the token before the gap trails it, one on the line of the token after
  // it stands within that line; all others have lines of their own.
  const bool at_end = end == text.size();
  GapComments gap;
  gap.blank_after = newlines > 1;
  for (Found& comment : found) {
    const bool one_line = comment.first_line == comment.last_line;
    if (one_line && comment.first_line == line && !at_end) {
      gap.inner.push_back(std::move(comment.text));
    } else if (one_line && comment.first_line == 0) {
      gap.trailing += (gap.trailing.empty() ? "" : " ") + comment.text;
    } else {
      gap.lines.push_back({std::move(comment.text), comment.blank_before});
    }
  }
  return gap;
}

std::string CommentContent(const GapComments& gap) {
  std::string all = gap.trailing;
  for (const CommentLine& line : gap.lines) all += line.text;
  for (const std::string& inner : gap.inner) all += inner;
  std::erase_if(all, [](char c) { return c == '\n' || IsBlank(c); });
  return all;
}

LayoutWriter::LayoutWriter(std::vector<LayoutToken> tokens)
    : tokens_(std::move(tokens)), match_(tokens_.size(), 0) {
  // The partner of each bracket, so that a group can be passed over as a whole.
  std::vector<size_t> open;
  for (size_t i = 0; i < tokens_.size(); ++i) {
    if (tokens_[i].opens) open.push_back(i);
    if (tokens_[i].closes && !open.empty()) {
      match_[open.back()] = i;
      open.pop_back();
    }
  }
}

void LayoutWriter::EndLine() {
  // A line that holds nothing but indentation is taken back: callers may ask for a new line twice.
  if (fresh_) {
    out_.resize(line_begin_);  // Nothing but indentation.
  } else {
    out_ += '\n';
  }
  line_begin_ = out_.size();
  fresh_ = true;
  comment_end_ = false;
}

void LayoutWriter::NewLine(size_t indent) {
  EndLine();
  out_.append(indent, ' ');
}

void LayoutWriter::LinesBefore(const GapComments& gap, size_t indent, bool blank_first,
                               bool blank_last) {
  EndLine();
  // An empty line is kept where there was one, but never at the beginning of the text.
  const auto blank = [&](bool wanted) {
    if (!wanted || out_.empty()) return;
    out_ += '\n';
    line_begin_ = out_.size();
  };
  for (size_t i = 0; i < gap.lines.size(); ++i) {
    blank(gap.lines[i].blank_before && (i > 0 || blank_first));
    out_.append(indent, ' ');
    out_ += gap.lines[i].text;
    fresh_ = false;
    EndLine();
  }
  blank(gap.blank_after && blank_last && (blank_first || !gap.lines.empty()));
}

size_t LayoutWriter::FlatWidth(size_t begin, size_t end) const {
  size_t width = 0;
  // A token on its line is as wide as its text, the comments within the line, and the space before
  // it.
  for (size_t i = begin; i < end; ++i) {
    const LayoutToken& token = tokens_[i];
    // A comment that needs a line of its own, or ends one, makes one line impossible.
    if (i > begin && !token.before.lines.empty()) return kTooLong;
    if (i + 1 < end && !token.trailing.empty()) return kTooLong;
    for (const std::string& inner : token.before.inner) width += inner.size() + 1;
    width += token.text.size() + (i > begin && token.space ? 1 : 0);
    if (width > kLayoutWidth) return kTooLong;
  }
  return width;
}

size_t LayoutWriter::TailWidth(size_t end) const {
  // The tokens up to the next possible break stay on this line, whatever it costs.
  size_t width = 0;
  for (size_t i = end; i < statement_end_ && !tokens_[i].may_break; ++i) {
    width += tokens_[i].text.size() + (tokens_[i].space ? 1 : 0);
    if (width > kLayoutWidth) break;
  }
  return width;
}

bool LayoutWriter::Fits(size_t begin, size_t end) const {
  // What is on the line, the tokens themselves, and what cannot be parted from them.
  const size_t column = out_.size() - line_begin_;
  const size_t space = !fresh_ && tokens_[begin].space ? 1 : 0;
  // A line that ends with a comment cannot go on.
  const bool goes_on = fresh_ || (!comment_end_ && tokens_[begin].before.lines.empty());
  const size_t flat = FlatWidth(begin, end);
  return goes_on && flat != kTooLong && column + space + flat + TailWidth(end) <= kLayoutWidth;
}

void LayoutWriter::Emit(size_t i, size_t indent) {
  const LayoutToken& token = tokens_[i];
  // Comments before the token come first: on lines of their own, or within the line.
  if (comment_end_) NewLine(indent);
  if (!token.before.lines.empty()) {
    for (const CommentLine& line : token.before.lines) {
      if (!fresh_) NewLine(indent);
      out_ += line.text;
      fresh_ = false;
      NewLine(indent);
    }
  } else if (!fresh_ && token.space) {
    out_ += ' ';
  }
  for (const std::string& inner : token.before.inner) {
    if (!fresh_ && out_.back() != ' ') out_ += ' ';
    out_ += inner + ' ';
    fresh_ = false;
  }
  // The token stands behind its comments, and the one that trails it ends the line.
  out_ += token.text;
  fresh_ = false;
  if (!token.trailing.empty()) {
    out_ += "  " + token.trailing;
    comment_end_ = true;
  }
}

void LayoutWriter::EmitFlat(size_t begin, size_t end, size_t indent) {
  for (size_t i = begin; i < end; ++i) Emit(i, indent);
}

void LayoutWriter::Broken(size_t begin, size_t end, size_t indent) {
  // Text aligned beyond this column would have too little room.
  constexpr size_t kDeepestAlignment = 60;
  for (size_t i = begin; i < end; ++i) {
    const size_t close = tokens_[i].opens ? match_[i] : 0;
    Emit(i, indent);
    if (close <= i || close >= end) continue;
    // Empty brackets need no filling.
    if (close == i + 1) continue;
    size_t inside = out_.size() - line_begin_;
    // The inside of a bracket is aligned behind it, unless that leaves no room.
    if (inside > kDeepestAlignment && !comment_end_ && tokens_[i + 1].before.lines.empty()) {
      inside = indent + 4;
      NewLine(inside);
    }
    Fill(i + 1, close, std::min(inside, kDeepestAlignment), false);
    i = close - 1;  // The closing token comes next.
  }
}

void LayoutWriter::Fill(size_t begin, size_t end, size_t indent, bool spread) {
  size_t part = begin;
  while (part < end) {
    // A part ends at the next possible break outside of all brackets that it opens: what is in
    // brackets hangs together, and is broken up only if it fits on no line as a whole.
    size_t next = part;
    int depth = 0;
    do {
      depth += tokens_[next].opens ? 1 : tokens_[next].closes ? -1 : 0;
      ++next;
    } while (next < end && !(depth == 0 && tokens_[next].may_break));
    // A new line is begun where one is asked for, or where the part does not fit.
    if ((spread || tokens_[part].separate) && !fresh_) NewLine(indent);
    if (!Fits(part, next) && !fresh_ && tokens_[part].may_break) NewLine(indent);
    // A part that fits on no line has its brackets broken up.
    if (Fits(part, next)) {
      EmitFlat(part, next, indent);
    } else {
      Broken(part, next, indent);
    }
    part = next;
  }
}

void LayoutWriter::Statement(size_t begin, size_t head, size_t end, size_t indent, size_t hang,
                             bool spread) {
  statement_end_ = end;
  if (fresh_) NewLine(indent);
  tokens_[begin].before.lines.clear();  // LinesBefore has written them.
  if (Fits(begin, end)) {
    EmitFlat(begin, end, hang);
    return;
  }
  // The head stays together; the rest is filled into lines at column `hang`.
  for (size_t i = begin; i < head; ++i) Emit(i, hang);
  Fill(head, end, hang, spread);
}

}  // namespace morphbus::source
