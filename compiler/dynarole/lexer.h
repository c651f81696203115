#pragma once
// DynaRole text as tokens.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/source/source_text.h"

namespace morphbus::dynarole {

enum class TokenKind : uint8_t {
  kEnd,
  kName,
  kDollar,
  kInt,
  kFloat,
  // Words.
  kAbstract,
  kRole,
  kExtends,
  kLabel,
  kRequire,
  kStartup,
  kBehavior,
  kCommand,
  kHandler,
  kFunction,
  kVar,
  kIf,
  kElse,
  kWhile,
  kReturn,
  kTrue,
  kFalse,
  kSelf,
  // Signs.
  kLeftBrace,
  kRightBrace,
  kLeftParen,
  kRightParen,
  kSemicolon,
  kComma,
  kDot,
  kAssign,
  kPlusAssign,
  kMinusAssign,
  kEqual,
  kNotEqual,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kPlus,
  kMinus,
  kStar,
  kSlash,
  kPercent,
  kAndAnd,
  kOrOr,
  kNot,
};

struct Token {
  TokenKind kind = TokenKind::kEnd;
  source::Span span;
};

/// The words that are no names: `role`, `if`, `true`, ...
std::vector<std::string_view> ReservedWords();

/// The token as messages name it: `';'`, `'role'`, `a name`, `the end of the file`.
std::string Describe(TokenKind kind);

/// Splits the text of `file`. Always ends with kEnd; what cannot be read is reported and skipped.
std::vector<Token> Tokenize(const source::SourceSet& sources, int file,
                            source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
