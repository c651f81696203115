#include "compiler/dynarole/format.h"

#include "compiler/dynarole/lexer.h"
#include "compiler/dynarole/parser.h"
#include "compiler/source/layout.h"

namespace morphbus::dynarole {
namespace {

using source::GapComments;
using source::LayoutToken;

constexpr size_t kIndent = 2;        ///< Of a block.
constexpr size_t kContinuation = 4;  ///< Of the lines that continue a statement.

class Formatter {
 public:
  Formatter(const source::SourceSet& sources, int file, const std::vector<Token>& tokens)
      : text_(sources.text(file)), tokens_(tokens), count_(tokens.size() - 1) {}

  std::string Run() {
    Describe();
    std::vector<GapComments> before;
    for (const LayoutToken& token : layout_) before.push_back(token.before);
    before.push_back(Gap(count_));
    source::LayoutWriter writer(std::move(layout_));
    size_t indent = 0;
    for (size_t begin = 0; begin < count_;) {
      const bool closes = Is(begin, TokenKind::kRightBrace);
      const bool first = begin > 0 && Is(begin - 1, TokenKind::kLeftBrace);
      writer.LinesBefore(before[begin], indent, !first, !closes);
      if (closes && indent >= kIndent) indent -= kIndent;
      const size_t end = LineEnd(begin, before);
      writer.Statement(begin, begin, end, indent, indent + kContinuation, false);
      writer.EndLine();
      if (Is(end - 1, TokenKind::kLeftBrace)) indent += kIndent;
      begin = end;
    }
    writer.LinesBefore(before[count_], 0, true, false);
    return writer.Take();
  }

 private:
  [[nodiscard]] bool Is(size_t i, TokenKind kind) const {
    return i < count_ && tokens_[i].kind == kind;
  }

  [[nodiscard]] GapComments Gap(size_t i) const {
    const size_t begin = i == 0 ? 0 : tokens_[i - 1].span.end;
    const size_t end = i == count_ ? text_.size() : tokens_[i].span.begin;
    return source::ReadGap(text_, begin, end, false);
  }

  /// One past the last token of the line's statement: `... ;`, `... {`, `}`, `} else {`, `{}`.
  [[nodiscard]] size_t LineEnd(size_t begin, const std::vector<GapComments>& before) const {
    size_t i = begin;
    const auto joins = [&](size_t next) {  // No comment stands between i and next.
      return before[next].lines.empty() && before[next].trailing.empty();
    };
    if (Is(i, TokenKind::kRightBrace)) {
      ++i;
      if (!Is(i, TokenKind::kElse) || !joins(i)) return i;
    }
    int depth = 0;
    for (; i < count_; ++i) {
      if (Is(i, TokenKind::kLeftParen)) ++depth;
      if (Is(i, TokenKind::kRightParen)) --depth;
      if (depth > 0) continue;
      if (Is(i, TokenKind::kSemicolon)) return i + 1;
      if (Is(i, TokenKind::kLeftBrace)) {
        const bool empty = Is(i + 1, TokenKind::kRightBrace) && joins(i + 1);
        return empty ? i + 2 : i + 1;
      }
      if (Is(i + 1, TokenKind::kRightBrace)) return i + 1;
    }
    return count_;
  }

  [[nodiscard]] bool IsOperand(size_t i) const {
    switch (tokens_[i].kind) {
      case TokenKind::kName:
      case TokenKind::kDollar:
      case TokenKind::kInt:
      case TokenKind::kFloat:
      case TokenKind::kTrue:
      case TokenKind::kFalse:
      case TokenKind::kSelf:
      case TokenKind::kRightParen:
        return true;
      default:
        return false;
    }
  }

  /// `-` without an operand before it, or `!`.
  [[nodiscard]] bool IsUnary(size_t i) const {
    return Is(i, TokenKind::kNot) ||
           (Is(i, TokenKind::kMinus) && (i == 0 || !IsOperand(i - 1) || EndsCondition(i - 1)));
  }

  /// The parenthesis that ends the condition of an `if` or `while`: a statement follows.
  [[nodiscard]] bool EndsCondition(size_t i) const {
    return i < condition_end_.size() && condition_end_[i];
  }

  [[nodiscard]] bool SpaceBefore(size_t i) const {
    if (i == 0) return false;
    switch (tokens_[i].kind) {
      case TokenKind::kSemicolon:
        // `while (c) ;` and `;` alone are statements of their own.
        return EndsCondition(i - 1) || Is(i - 1, TokenKind::kElse);
      case TokenKind::kRightParen:
      case TokenKind::kComma:
      case TokenKind::kDot:
        return false;
      case TokenKind::kLeftParen:
        if (Is(i - 1, TokenKind::kName) || Is(i - 1, TokenKind::kDollar)) return false;
        break;
      case TokenKind::kRightBrace:
        return !Is(i - 1, TokenKind::kLeftBrace);
      default:
        break;
    }
    if (Is(i - 1, TokenKind::kLeftParen) || Is(i - 1, TokenKind::kDot)) return false;
    return !IsUnary(i - 1);
  }

  void Describe() {
    layout_.resize(count_);
    condition_end_.assign(count_, false);
    std::vector<size_t> open;
    for (size_t i = 0; i < count_; ++i) {
      if (Is(i, TokenKind::kLeftParen)) open.push_back(i);
      if (!Is(i, TokenKind::kRightParen) || open.empty()) continue;
      const size_t begin = open.back();
      open.pop_back();
      condition_end_[i] =
          begin > 0 && (Is(begin - 1, TokenKind::kIf) || Is(begin - 1, TokenKind::kWhile));
    }
    for (size_t i = 0; i < count_; ++i) {
      LayoutToken& token = layout_[i];
      token.text = text_.substr(tokens_[i].span.begin, tokens_[i].span.end - tokens_[i].span.begin);
      token.space = SpaceBefore(i);
      token.opens = Is(i, TokenKind::kLeftParen);
      token.closes = Is(i, TokenKind::kRightParen);
      token.before = Gap(i);
      if (i > 0) layout_[i - 1].trailing = token.before.trailing;
      token.may_break = i > 0 && (Is(i, TokenKind::kAndAnd) || Is(i, TokenKind::kOrOr) ||
                                  Is(i - 1, TokenKind::kComma) || EndsCondition(i - 1));
    }
    if (count_ > 0) layout_[count_ - 1].trailing = Gap(count_).trailing;
  }

  std::string_view text_;
  const std::vector<Token>& tokens_;
  size_t count_;  ///< Tokens without kEnd.
  std::vector<LayoutToken> layout_;
  std::vector<bool> condition_end_;
};

/// What formatting must leave as it is.
std::string Content(const source::SourceSet& sources, int file, const std::vector<Token>& tokens) {
  const std::string_view text = sources.text(file);
  std::string content;
  size_t end = 0;
  for (const Token& token : tokens) {
    const size_t begin = token.kind == TokenKind::kEnd ? text.size() : token.span.begin;
    content += source::CommentContent(source::ReadGap(text, end, begin, false)) + '\n';
    content += text.substr(begin, token.kind == TokenKind::kEnd ? 0 : token.span.end - begin);
    end = token.span.end;
  }
  return content;
}

}  // namespace

std::optional<std::string> Format(const source::SourceSet& sources, int file,
                                  source::Diagnostics& diagnostics) {
  const int errors = diagnostics.error_count();
  const std::vector<Token> tokens = Tokenize(sources, file, &diagnostics);
  Parse(sources, file, tokens, &diagnostics);
  if (diagnostics.error_count() > errors) return std::nullopt;
  std::string formatted = Formatter(sources, file, tokens).Run();
  // A formatter that changes what it formats is worse than none: compare before letting it go.
  source::SourceSet again;
  source::Diagnostics none;
  const int copy = again.AddText(sources.name(file), formatted);
  const std::vector<Token> retold = Tokenize(again, copy, &none);
  if (none.had_errors() || Content(again, copy, retold) != Content(sources, file, tokens)) {
    diagnostics.Error({file, 0, 0}, "cannot be laid out without changing it; please report this");
    return std::nullopt;
  }
  return formatted;
}

}  // namespace morphbus::dynarole
