#include "compiler/m3l/parser.h"

namespace morphbus::m3l {
namespace internal {
// Takes the symbol if it is there; the caller decides what its absence means.
bool Parser::Accept(std::string_view symbol) {
  if (!Is(symbol)) return false;
  ++at_;
  return true;
}

std::string Parser::Described(size_t i) const {
  if (TokenAt(i).kind == TokenKind::kEnd) return "the end of the file";
  // A long token is told by its beginning.
  std::string text(Text(i).substr(0, 40));
  // Text in a message stays one line and printable.
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return "'" + text + (Text(i).size() > 40 ? "...'" : "'");
}

source::Span Parser::SpanSince(size_t begin) const {
  const source::Span& first = TokenAt(begin).span;
  return {first.file, first.begin, at_ > begin ? TokenAt(at_ - 1).span.end : first.end};
}

source::Diagnostic& Parser::Error(const source::Span& span, std::string message) {
  ++errors_;
  return diagnostics_.Error(span, std::move(message));
}

void Parser::StopIfTooMany() {
  if (errors_ < kMaxSyntaxErrors || AtEnd()) return;
  Error(Now().span, "too many errors, the rest of the file is not read");
  // Going to the mark at the end stops all parsing, as everything looks for it.
  at_ = tokens_.size() - 1;
}

// Brackets are counted from the attribute's beginning, as the error may lie within them.
void Parser::SkipAttribute(size_t begin) {
  int open = 0;
  size_t i = begin;
  for (; !IsKind(i, TokenKind::kEnd) && (i < at_ || !StartsStatement(i)); ++i) {
    // The attribute ends at a comma or closing bracket outside of what it opened, but not before
    // the place of the error.
    const bool opens = IsSymbol(i, "(") || IsSymbol(i, "[");
    const bool closes = IsSymbol(i, ")") || IsSymbol(i, "]");
    if (i >= at_ && open <= 0 && (closes || IsSymbol(i, ","))) break;
    open += opens ? 1 : closes ? -1 : 0;
  }
  at_ = i;
}

size_t Parser::EndOfGroup(size_t open) const {
  int depth = 0;
  size_t i = open;
  for (; !IsKind(i, TokenKind::kEnd) && !StartsStatement(i); ++i) {
    depth += IsSymbol(i, "(") ? 1 : IsSymbol(i, ")") ? -1 : 0;
    if (depth == 0) break;
  }
  return i;
}

void Parser::SkipGroup() {
  at_ = EndOfGroup(at_);
  Accept(")");
}

void Parser::SkipToStatement() {
  // This is where parsing goes on after an error.
  while (!AtEnd() && !StartsStatement(at_)) ++at_;
}

FileAst Parser::ParseFile() {
  FileAst file;
  // Each turn reads one statement or skips what is none.
  while (!AtEnd()) {
    if (!StartsStatement(at_)) {
      // Text between statements is reported once and skipped.
      const Name word = NameAt(at_);
      Error(word.span,
            "expected a module, connection, robot, const or import, found " + Described(at_))
          .hint = source::NearestHint(word.text, {Keywords().begin(), Keywords().end()});
      ++at_;
      SkipToStatement();
    } else {
      ParseStatement(file);
    }
    StopIfTooMany();
  }
  return file;
}

}  // namespace internal

FileAst Parse(const std::vector<Token>& tokens, source::Diagnostics* diagnostics) {
  return internal::Parser(tokens, diagnostics).ParseFile();
}

}  // namespace morphbus::m3l
