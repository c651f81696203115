#pragma once
// The lexer of M3L: it cuts the characters of a file into tokens for the parser and the formatter.
// White space and comments are left out.

#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

/// Kinds of tokens; which keyword or symbol it is, the text says.
enum class TokenKind {
  /// A name or a keyword; IsKeyword tells them apart.
  kWord,
  /// A decimal number without sign.
  kNumber,
  /// A text between double quotes, which belong to the token.
  kString,
  /// One of ( ) [ ] , : . = == != < <= > >= + - * /
  kSymbol,
  /// The mark behind the last token; it is always there, so that looking ahead needs no bound.
  kEnd,
};

/// A token and where it stands.
struct Token {
  TokenKind kind = TokenKind::kEnd;
  source::Span span;
  /// The characters of the token. They belong to the source set, which outlives the tokens.
  std::string_view text;
};

/// Most tokens that one compilation may have; a bound on memory, far above any real model.
constexpr size_t kMaxTokens = 1'000'000;
/// Lexing and parsing of a file stop after this many errors, so that garbage stays readable.
constexpr int kMaxSyntaxErrors = 100;

/// Tokens of file `file`, ending with kEnd. What is no token is reported and left out; with more
/// than `max_tokens` an error is reported and the rest is dropped. Linear in the text.
std::vector<Token> Tokenize(const source::SourceSet& sources, int file, size_t max_tokens,
                            source::Diagnostics* diagnostics);

/// The text that a kString token stands for. `quoted` is the token with its quotes; the escapes \"
/// \\ \n \t are resolved.
std::string StringValue(std::string_view quoted);

// The words of M3L, and where statements begin: what the parser, the formatter and the editors'
// grammars must agree on.

/// Words that begin statements, and those that stand between or before operands.
const std::vector<std::string_view>& Keywords();
const std::vector<std::string_view>& OperatorWords();
bool IsKeyword(std::string_view word);
bool IsOperatorWord(std::string_view word);

/// True where a statement begins: `keyword name`, `keyword :`, `import`, or `word word :`, the
/// last being a misspelt keyword. `(point x: ...)` is a part of a statement, not one. `tokens` end
/// with kEnd.
bool StartsStatement(const std::vector<Token>& tokens, size_t i);

}  // namespace morphbus::m3l
