#pragma once
// M3L characters to tokens.

#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

enum class TokenKind {
  kWord,    ///< A name or a keyword.
  kNumber,  ///< Unsigned decimal number.
  kString,  ///< Text between double quotes.
  kSymbol,  ///< One of ( ) [ ] , : . = == != < <= > >= + - * /
  kEnd,     ///< After the last token; always there.
};

struct Token {
  TokenKind kind = TokenKind::kEnd;
  source::Span span;
  std::string_view text;  ///< Of the source set, which outlives the tokens.
};

/// Most tokens that one compilation may have; a bound on memory, far above any real model.
constexpr size_t kMaxTokens = 1'000'000;
/// Lexing and parsing of a file stop after this many errors, so that garbage stays readable.
constexpr int kMaxSyntaxErrors = 100;

/// Tokens of file `file`, ending with kEnd. What is no token is reported and left out; with more
/// than `max_tokens` an error is reported and the rest is dropped. Linear in the text.
std::vector<Token> Lex(const source::SourceSet& sources, int file, size_t max_tokens,
                       source::Diagnostics& diagnostics);

/// The text that a kString token stands for (escapes \" \\ \n \t resolved).
std::string StringValue(std::string_view quoted);

/// One token a line: `line:column kind text`. For debugging and golden tests.
std::string DumpTokens(const std::vector<Token>& tokens, const source::SourceSet& sources);

}  // namespace morphbus::m3l
