#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {

using source::Diagnostic;
using source::Span;

namespace {

/// More messages are not read, and broken text could give one for each word.
constexpr size_t kMostMessages = 100;

}  // namespace

size_t TokenReader::Behind(size_t ahead) const {
  const TokenKind opening = Peek(ahead).kind;
  const TokenKind closing =
      opening == TokenKind::kLeftParen ? TokenKind::kRightParen : TokenKind::kRightBracket;
  int depth = 0;
  do {
    const TokenKind kind = Peek(ahead++).kind;
    if (kind == TokenKind::kEnd || kind == TokenKind::kSemicolon) return 0;
    if (kind == opening) ++depth;
    if (kind == closing) --depth;
  } while (depth > 0);
  return ahead;
}

const Token& TokenReader::Take() {
  const Token& token = Peek();
  // The end of the file is never taken, so that Peek always has something.
  if (at_ + 1 < tokens_.size()) ++at_;
  return token;
}

bool TokenReader::TakeIf(TokenKind kind) {
  if (!Is(kind)) return false;
  Take();
  return true;
}

Span TokenReader::SpanFrom(const Span& begin) const {
  return {file_, begin.begin, std::max(Previous().span.end, begin.end)};
}

bool TokenReader::StartsLine(const Token& token) const {
  // Goes back from the token to the line's beginning.
  const std::string_view text = sources_.text(file_);
  for (size_t i = token.span.begin; i > 0; --i) {
    if (text[i - 1] == '\n') return true;
    if (text[i - 1] != ' ' && text[i - 1] != '\t' && text[i - 1] != '\r') return false;
  }
  return true;
}

bool TokenReader::AtMargin() const {
  const size_t begin = Peek().span.begin;
  return begin == 0 || sources_.text(file_)[begin - 1] == '\n';
}

bool TokenReader::AtMember() const {
  return IsMemberWord(Peek().kind) || Is(TokenKind::kConst) || Is(TokenKind::kShared) ||
         Is(TokenKind::kRole) || Is(TokenKind::kAbstract) || Is(TokenKind::kEnd);
}

Diagnostic* TokenReader::ErrorAt(const Span& span, std::string message, std::string hint) {
  // What follows an error in the same statement or member mostly follows from it.
  if (panic_ || gave_up_) return nullptr;
  panic_ = true;
  return &diagnostics_.Error(span, std::move(message)).Hint(std::move(hint));
}

Diagnostic* TokenReader::Unexpected(const std::string& wanted, std::string hint) {
  const Token& token = Peek();
  // Names and numbers are shown as they stand in the text.
  const std::string found =
      HasText(token.kind) ? "'" + TextOf(token).substr(0, 40) + "'" : Describe(token.kind);
  // Brackets stand round the range of a parameter, and in arrays.
  if (token.kind == TokenKind::kLeftBracket && hint.empty()) {
    hint = "elements are those of an array, a variable or field: NAME[0]";
  }
  return ErrorAt(token.span, "expected " + wanted + ", found " + found, std::move(hint));
}

bool TokenReader::Expect(TokenKind kind, const std::string& where) {
  if (TakeIf(kind)) return true;
  Unexpected(Describe(kind) + (where.empty() ? "" : " " + where));
  return false;
}

// A missing semicolon is noticed at the next token but belongs behind the last one; when the next
// token begins a line, nothing else is wrong.
bool TokenReader::ExpectSemicolon(const std::string& after) {
  if (panic_) return false;
  if (TakeIf(TokenKind::kSemicolon)) return true;
  // The statement is complete but for the semicolon, so that reading goes on without recovery.
  if (StartsLine(Peek()) || Is(TokenKind::kRightBrace) || Is(TokenKind::kEnd)) {
    const size_t end = Previous().span.end;
    diagnostics_.Error({file_, end, end}, "expected ';' after " + after);
    return true;
  }
  Unexpected("';' after " + after);
  return false;
}

bool TokenReader::ExpectClosing(TokenKind kind, const Span& opening) {
  if (panic_) return false;
  if (TakeIf(kind)) return true;
  // The note shows the one that was not closed, which may stand far above.
  const char* note = kind == TokenKind::kRightParen     ? "to close this '('"
                     : kind == TokenKind::kRightBracket ? "to close this '['"
                                                        : "to close this '{'";
  Diagnostic* error = Unexpected(Describe(kind));
  if (error != nullptr) error->Note(opening, note);
  // At the end everything else that is open is so for the same reason.
  gave_up_ = gave_up_ || Is(TokenKind::kEnd);
  return false;
}

bool TokenReader::EnterLevel() {
  if (++level_ <= kMaxDepth) return true;
  TooDeep(Peek().span);
  return false;
}

// The rest of the text is passed over, so that every loop over it ends.
void TokenReader::GiveUp(const Span& span, const std::string& message, const std::string& hint) {
  ErrorAt(span, message, hint);
  panic_ = gave_up_ = true;
  at_ = tokens_.size() - 1;
}

void TokenReader::TooDeep(const Span& span) {
  GiveUp(span, "nested too deeply",
         "at most " + std::to_string(kMaxDepth) + " levels; split it into functions");
}

bool TokenReader::said_enough() const { return diagnostics_.all().size() >= kMostMessages; }

}  // namespace morphbus::dynarole
