#pragma once
// The first stage of the compiler: DynaRole text as tokens. Spaces and comments are left out.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/source/source_text.h"

namespace morphbus::dynarole {

/// What a token is. Each word and each sign is a kind of its own; kWords and kSigns in lexer.cc
/// hold their spellings.
enum class TokenKind : uint8_t {
  /// Behind the last token of the file; its span is empty and lies at the end.
  kEnd,
  /// Letters, digits and '_', but none of the words below. Types are names too: they stand for
  /// themselves only before a parameter.
  kName,
  /// A name with '$' before it: a direction, an axis, a role or a part of the module.
  kDollar,
  /// Digits alone: 45. A sign before them is a token of its own.
  kInt,
  /// Digits with a point or an exponent: 22.5, 1e3.
  kFloat,
  // Words begin roles, members, statements and values; none of them can be a name.
  // A role: `abstract role NAME extends BASE`.
  kAbstract,
  kRole,
  kExtends,
  // Members; a field begins with its name and has no word.
  kLabel,
  kRequire,
  kStartup,
  kBehavior,
  kCommand,
  kHandler,
  kFunction,
  // Statements; an assignment or a call begins with a name.
  kVar,
  kIf,
  kElse,
  kWhile,
  kReturn,
  // Values; `self` stands for the module that runs the program.
  kTrue,
  kFalse,
  kSelf,
  // Signs part and join the others.
  // Brackets: braces round members and statements, parentheses round arguments and conditions.
  kLeftBrace,
  kRightBrace,
  kLeftParen,
  kRightParen,
  // A semicolon ends a statement or member, a comma separates arguments, and a dot selects what a
  // module, joint or connector offers.
  kSemicolon,
  kComma,
  kDot,
  // Assignments.
  kAssign,
  kPlusAssign,
  kMinusAssign,
  // Comparisons.
  kEqual,
  kNotEqual,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  // Arithmetic.
  kPlus,
  kMinus,
  kStar,
  kSlash,
  kPercent,
  // Logic.
  kAndAnd,
  kOrOr,
  kNot,
};

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

/// Splits the text of a file into tokens, the last of which is kEnd. What cannot be read is an
/// error in `diagnostics` and left out: characters that begin no token, numbers followed by
/// letters, "..." for parts left out, a comment without end, bytes that are not UTF-8. After 20
/// such errors the rest of the file is not read.
/// @param file  index of the file in `sources`.
std::vector<Token> Tokenize(const source::SourceSet& sources, int file,
                            source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
