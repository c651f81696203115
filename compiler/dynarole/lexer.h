#pragma once
// The first stage of the compiler: DynaRole text as tokens. Spaces and comments are left out.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/source/source_text.h"

namespace morphbus::dynarole {

/// What a token is. Each word and each sign is a kind of its own (tokens.def).
enum class TokenKind : uint8_t {
#define OTHER(kind, text) kind,
#define WORD(kind, text) kind,
#define SIGN(kind, text) kind,
#include "compiler/dynarole/tokens.def"
#undef OTHER
#undef WORD
#undef SIGN
};

/// Whether the token's text says more than its kind: names, numbers and texts, not words and signs.
constexpr bool HasText(TokenKind kind) {
  return kind >= TokenKind::kName && kind <= TokenKind::kText;
}
/// Whether the word begins a member.
constexpr bool IsMemberWord(TokenKind kind) {
  return kind >= TokenKind::kLabel && kind <= TokenKind::kFunction;
}

/// A token and where it stands. It owns no text: its text is that of its span in the SourceSet,
/// which must live as long as the tokens are used.
struct Token {
  /// Which word or sign it is, or that it is a name or a number.
  TokenKind kind = TokenKind::kEnd;
  /// Where its text stands.
  source::Span span;
};

/// The words that are no names: `role`, `if`, `true`, ... A test holds the
/// editors' grammar against them.
std::vector<std::string_view> ReservedWords();

/// The token as messages name it: `';'`, `'role'`, `a name`, `the end of the file`.
/// It is the same for all names and for all numbers, whose text the caller may add.
std::string Describe(TokenKind kind);

/// The characters of a text token: without its quotes and without the backslashes before quotes and
/// backslashes.
std::string TextValue(const std::string& token);

/// Splits the text of a file into tokens, the last of which is kEnd. What cannot be read is an
/// error in `diagnostics` and left out: characters that begin no token, numbers followed by
/// letters, "..." for parts left out, a comment or text without end, bytes that are not UTF-8.
/// After 20 such errors the rest of the file is not read.
/// @param file  index of the file in `sources`.
std::vector<Token> Tokenize(const source::SourceSet& sources, int file,
                            source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
