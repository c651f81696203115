#include "compiler/dynarole/format.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "compiler/dynarole/lexer.h"
#include "compiler/dynarole/parser.h"
#include "compiler/source/format_frame.h"

namespace morphbus::dynarole {
namespace {

using source::LayoutToken;

constexpr size_t kIndent = 2;        ///< Of a block.
constexpr size_t kContinuation = 4;  ///< Of the lines that continue a statement.

class Formatter {
 public:
  Formatter(const source::SourceSet& sources, int file, const std::vector<Token>& tokens)
      : tokens_(tokens),
        count_(tokens.size() - 1),
        text_(sources.text(file)),
        cut_(source::CutUp(sources.text(file), source::SpansOf(tokens), false)) {}

  std::string Run() {
    // Every token knows now what stands before it; what is left is to part them into lines.
    Describe();
    source::LayoutWriter writer(std::move(cut_.tokens));
    // For each brace that is open, how deep what stands in it is; statements of a case of a switch
    // are one step deeper than the case.
    struct Block {
      bool is_switch = false;
      bool in_case = false;
    };
    std::vector<Block> blocks;
    const auto indent = [&blocks] {
      size_t steps = blocks.size();
      for (const Block& block : blocks) steps += block.in_case ? 1 : 0;
      return steps * kIndent;
    };
    for (size_t begin = 0; begin < count_;) {
      // A brace that closes stands as deep as what it closes, without empty lines inside the
      // braces.
      const bool closes = Is(begin, TokenKind::kRightBrace);
      const bool first = begin > 0 && Is(begin - 1, TokenKind::kLeftBrace);
      const bool is_case = !blocks.empty() && blocks.back().is_switch && CaseEnd(begin) > 0;
      if (is_case) blocks.back().in_case = false;
      writer.LinesBefore(cut_.gaps[begin], indent(), !first, !closes);
      if (closes && !blocks.empty()) blocks.pop_back();
      const size_t end = is_case ? CaseEnd(begin) : LineEnd(begin);
      writer.Statement(begin, begin, end, indent(), indent() + kContinuation, false);
      writer.EndLine();
      if (is_case) blocks.back().in_case = true;
      if (Is(end - 1, TokenKind::kLeftBrace)) {
        const auto opens = switch_.begin() + static_cast<std::ptrdiff_t>(begin);
        const auto closed = switch_.begin() + static_cast<std::ptrdiff_t>(end);
        blocks.push_back({.is_switch = std::find(opens, closed, true) != closed});
      }
      begin = end;
    }
    writer.LinesBefore(cut_.gaps[count_], 0, true, false);
    return writer.Take();
  }

 private:
  [[nodiscard]] bool Is(size_t i, TokenKind kind) const {
    return i < count_ && tokens_[i].kind == kind;
  }

  [[nodiscard]] bool IsWord(size_t i, std::string_view word) const {
    return Is(i, TokenKind::kName) &&
           text_.substr(tokens_[i].span.begin, tokens_[i].span.end - tokens_[i].span.begin) == word;
  }
  /// The word `switch` before its condition and its brace.
  [[nodiscard]] bool BeginsSwitch(size_t i) const { return i < switch_.size() && switch_[i]; }
  /// One past the colon of the `case` or `default` that begins here; 0 if none does.
  [[nodiscard]] size_t CaseEnd(size_t begin) const {
    // A name of the same spelling stands in the midst of a statement.
    const bool starts = begin == 0 || Is(begin - 1, TokenKind::kLeftBrace) ||
                        Is(begin - 1, TokenKind::kRightBrace) ||
                        Is(begin - 1, TokenKind::kSemicolon) || Is(begin - 1, TokenKind::kColon);
    if (!starts) return 0;
    if (IsWord(begin, "default") && Is(begin + 1, TokenKind::kColon)) return begin + 2;
    if (!IsWord(begin, "case")) return 0;
    // A choice has a colon of its own.
    int choices = 0;
    for (size_t i = begin + 1; i < count_; ++i) {
      if (Is(i, TokenKind::kSemicolon) || Is(i, TokenKind::kLeftBrace)) return 0;
      if (Is(i, TokenKind::kQuestion)) ++choices;
      if (Is(i, TokenKind::kColon) && choices-- == 0) return i + 1;
    }
    return 0;
  }
  /// The word `case` of one.
  [[nodiscard]] bool BeginsCase(size_t i) const { return i < case_begin_.size() && case_begin_[i]; }
  /// The colon of a `case` or `default`, which stands close to it.
  [[nodiscard]] bool EndsCase(size_t i) const { return i < case_end_.size() && case_end_[i]; }

  /// One past the last token of the line's statement: `... ;`, `... {`, `}`, `} else {`, `{}`.
  [[nodiscard]] size_t LineEnd(size_t begin) const {
    size_t i = begin;
    const auto joins = [&](size_t next) {  // No comment stands between i and next.
      return cut_.gaps[next].lines.empty() && cut_.gaps[next].trailing.empty();
    };
    if (Is(i, TokenKind::kRightBrace)) {
      ++i;
      if (!Is(i, TokenKind::kElse) || !joins(i)) return i;
    }
    // The values of an enumeration stand behind its name.
    const bool enumeration = IsWord(i, "enum") && Is(i + 1, TokenKind::kName);
    if (enumeration && Is(i + 2, TokenKind::kLeftBrace)) {
      while (i < count_ && !Is(i, TokenKind::kRightBrace)) ++i;
      return std::min(count_, Is(i + 1, TokenKind::kSemicolon) && joins(i + 1) ? i + 2 : i + 1);
    }
    // A statement ends outside all parentheses: at its semicolon or the brace it opens, or before
    // one that closes the block around it.
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

  /// Whether the token may end an operand, so that a `-` behind it subtracts.
  [[nodiscard]] bool IsOperand(size_t i) const {
    switch (tokens_[i].kind) {
      case TokenKind::kName:
      case TokenKind::kDollar:
      case TokenKind::kInt:
      case TokenKind::kFloat:
      case TokenKind::kTrue:
      case TokenKind::kFalse:
      case TokenKind::kSelf:
      case TokenKind::kSuper:
      case TokenKind::kText:
      case TokenKind::kRightParen:
      case TokenKind::kRightBracket:
        return true;
      default:
        return false;
    }
  }

  /// `-` without an operand before it, or `!`.
  [[nodiscard]] bool IsUnary(size_t i) const {
    return Is(i, TokenKind::kNot) ||
           (Is(i, TokenKind::kMinus) &&
            (i == 0 || !IsOperand(i - 1) || EndsCondition(i - 1) || BeginsCase(i - 1)));
  }

  /// The parenthesis that ends the head of an `if`, `while` or `for`: a statement follows.
  [[nodiscard]] bool EndsCondition(size_t i) const {
    return i < condition_end_.size() && condition_end_[i];
  }

  /// Whether a space stands before the token in its line.
  [[nodiscard]] bool SpaceBefore(size_t i) const {
    if (i == 0) return false;
    switch (tokens_[i].kind) {
      case TokenKind::kSemicolon:
        // `while (c) ;` and `;` alone are statements of their own.
        return EndsCondition(i - 1) || Is(i - 1, TokenKind::kElse);
      case TokenKind::kColon:
        return !EndsCase(i);
      case TokenKind::kRightParen:
      case TokenKind::kRightBracket:
      case TokenKind::kComma:
      case TokenKind::kDot:
        return false;
      case TokenKind::kLeftParen:
        if (BeginsSwitch(i - 1)) return true;
        if (Is(i - 1, TokenKind::kName) || Is(i - 1, TokenKind::kDollar)) return false;
        break;
      case TokenKind::kLeftBracket:
        // An element stands close to its array; the range of a parameter and a list of values do
        // not.
        if (Is(i - 1, TokenKind::kName) && !IsWord(i - 1, "in")) return false;
        break;
      case TokenKind::kRightBrace:
        return !Is(i - 1, TokenKind::kLeftBrace);
      default:
        break;
    }
    if (Is(i - 1, TokenKind::kLeftParen) || Is(i - 1, TokenKind::kLeftBracket) ||
        Is(i - 1, TokenKind::kDot)) {
      return false;
    }
    return !IsUnary(i - 1);
  }

  /// Tells the layout of each token where spaces and breaks of lines may stand.
  void Describe() {
    // Which parentheses end a condition must be known first, as spacing depends on it.
    condition_end_.assign(count_, false);
    switch_.assign(count_, false);
    case_begin_.assign(count_, false);
    case_end_.assign(count_, false);
    for (size_t i = 0; i < count_; ++i) {
      // A name of the same spelling has no colon behind it.
      if (const size_t end = CaseEnd(i); end > 0) case_begin_[i] = case_end_[end - 1] = true;
    }
    std::vector<size_t> open;
    // The parentheses are matched with a stack; those behind `if`, `while` and `for`
    // end what stands before a statement.
    for (size_t i = 0; i < count_; ++i) {
      if (Is(i, TokenKind::kLeftParen)) open.push_back(i);
      if (!Is(i, TokenKind::kRightParen) || open.empty()) continue;
      const size_t begin = open.back();
      open.pop_back();
      if (begin > 0 && IsWord(begin - 1, "switch") && Is(i + 1, TokenKind::kLeftBrace)) {
        switch_[begin - 1] = true;
      }
      condition_end_[i] =
          begin > 0 && (Is(begin - 1, TokenKind::kIf) || Is(begin - 1, TokenKind::kWhile) ||
                        Is(begin - 1, TokenKind::kFor));
    }
    for (size_t i = 0; i < count_; ++i) {
      // Lines that are too long break behind commas, before logical operators, and behind a
      // condition.
      LayoutToken& token = cut_.tokens[i];
      token.space = SpaceBefore(i);
      token.opens = Is(i, TokenKind::kLeftParen) || Is(i, TokenKind::kLeftBracket);
      token.closes = Is(i, TokenKind::kRightParen) || Is(i, TokenKind::kRightBracket);
      token.may_break =
          i > 0 && (Is(i, TokenKind::kAndAnd) || Is(i, TokenKind::kOrOr) ||
                    Is(i, TokenKind::kQuestion) || (Is(i, TokenKind::kColon) && !EndsCase(i)) ||
                    Is(i - 1, TokenKind::kComma) || EndsCondition(i - 1));
    }
  }

  const std::vector<Token>& tokens_;
  size_t count_;  ///< Tokens without kEnd.
  std::string_view text_;
  source::CutText cut_;
  std::vector<bool> condition_end_, switch_, case_begin_, case_end_;
};

}  // namespace

std::optional<std::string> Format(const source::SourceSet& sources, int file,
                                  source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  const std::vector<Token> tokens = Tokenize(sources, file, diagnostics);
  Parse(sources, file, tokens, diagnostics);
  // A text with errors cannot be laid out without guessing.
  if (diagnostics->error_count() > errors) return std::nullopt;
  std::string formatted = Formatter(sources, file, tokens).Run();
  const auto spans = [](const source::SourceSet& from, int at, source::Diagnostics* found) {
    return source::SpansOf(Tokenize(from, at, found));
  };
  // The result must have the same tokens: a slip of the formatter loses no code.
  return source::IfUnchanged(sources, file, {spans, false}, std::move(formatted), diagnostics);
}

}  // namespace morphbus::dynarole
