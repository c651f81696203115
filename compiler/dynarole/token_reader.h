#pragma once
// The tokens of a program, as parsers take them one after the other, and what they say of those
// that do not fit.

#include <algorithm>
#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// Goes through the tokens of one file. After an error no other is recorded until Recover, as those
/// after it mostly follow from it.
class TokenReader {
 public:
  /// All arguments must outlive the reader.
  TokenReader(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
              source::Diagnostics* diagnostics)
      : sources_(sources), file_(file), tokens_(tokens), diagnostics_(*diagnostics) {}

  /// Index of the file among the sources.
  [[nodiscard]] int file() const { return file_; }
  /// The token that many places after the next one; the last, kEnd, is never passed.
  [[nodiscard]] const Token& Peek(size_t ahead = 0) const {
    return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
  }
  /// The place behind what closes the parenthesis or bracket that many places ahead; 0: nothing
  /// does before the next semicolon.
  [[nodiscard]] size_t Behind(size_t ahead) const;
  [[nodiscard]] bool Is(TokenKind kind) const { return Peek().kind == kind; }
  [[nodiscard]] std::string TextOf(const Token& token) const {
    return std::string(sources_.text(token.span));
  }
  /// The last token that was taken.
  [[nodiscard]] const Token& Previous() const { return tokens_[at_ > 0 ? at_ - 1 : 0]; }
  /// Takes the next token and moves on, but never past kEnd.
  const Token& Take();
  /// Takes the next token if it is of that kind, and says whether it was.
  bool TakeIf(TokenKind kind);
  /// From the beginning of `begin` to the end of the last token taken.
  [[nodiscard]] source::Span SpanFrom(const source::Span& begin) const;
  /// Whether only spaces stand before the token in its line.
  [[nodiscard]] bool StartsLine(const Token& token) const;
  /// Whether the next token stands at the very beginning of its line.
  [[nodiscard]] bool AtMargin() const;
  /// Whether a member or role begins here for certain: by a word that begins nothing else.
  [[nodiscard]] bool AtMember() const;

  /// An error stands, and reading has not gone on at something else since.
  [[nodiscard]] bool failed() const { return panic_; }
  /// Reading goes on at the next statement or member, whose errors are recorded again.
  void Recover() { panic_ = false; }
  /// Records an error; null if one stands already.
  source::Diagnostic* ErrorAt(const source::Span& span, std::string message, std::string hint = "");
  /// Records an error from which nothing follows for what comes next.
  source::Diagnostic& AddError(const source::Span& span, std::string message) {
    return diagnostics_.Error(span, std::move(message));
  }
  /// So many messages stand that reading may end.
  [[nodiscard]] bool said_enough() const;
  /// "expected `wanted`, found ..." at the next token.
  source::Diagnostic* Unexpected(const std::string& wanted, std::string hint = "");
  /// Takes a token of that kind, or reports that it is missing; false then.
  bool Expect(TokenKind kind, const std::string& where);
  bool ExpectSemicolon(const std::string& after);
  /// The same for what closes a parenthesis or brace, with a note where it was opened.
  bool ExpectClosing(TokenKind kind, const source::Span& opening);

  /// Counts a level of nesting, until LeaveLevel; false, with an error, beyond kMaxDepth.
  bool EnterLevel();
  void LeaveLevel() { --level_; }
  /// Begins at the outermost level again, whatever was left open.
  void LeaveAllLevels() { level_ = 0; }
  /// Reports an error after which nothing more of the text is read.
  void GiveUp(const source::Span& span, const std::string& message, const std::string& hint);
  /// Gives up on a text whose nesting exceeds kMaxDepth.
  void TooDeep(const source::Span& span);

 private:
  const source::SourceSet& sources_;
  int file_;
  const std::vector<Token>& tokens_;
  source::Diagnostics& diagnostics_;
  size_t at_ = 0;         ///< Index of the next token.
  int level_ = 0;         ///< Levels of nesting around it.
  bool panic_ = false;    ///< An error stands and recovery has not happened yet.
  bool gave_up_ = false;  ///< Nothing more can be said about this text.
};

}  // namespace morphbus::dynarole
