#pragma once
// The members of a role: fields, and all that a word begins (label, behavior, function ...).

#include <optional>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/expression_parser.h"
#include "compiler/dynarole/statement_parser.h"
#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {

/// The kind of member that a word begins; a field has none.
std::optional<MemberKind> MemberOf(TokenKind word);

/// Reads them, one at a time.
class MemberParser {
 public:
  /// All must outlive the parser.
  MemberParser(TokenReader* in, ExpressionParser* expressions, StatementParser* statements)
      : in_(*in), expressions_(*expressions), statements_(*statements) {}

  /// Appends the member that begins here to the role.
  void Parse(Role* role);
  /// Recovery: moves on to the next member or the end of the role.
  void Skip();

 private:
  /// What stands behind the name of a field or label.
  void ParseField(Member* member);
  /// `trace NAME;`
  void ParseTrace(Role* role);
  /// Whether a word stands here that is one only before a name.
  [[nodiscard]] bool AtWord(const char* word) const;
  /// Adds a field that is an array to the role, as a member for each element.
  void AddElements(Member* array, Role* role);
  /// What may stand between the parameters of a handler and its block.
  void ParseHandlerWords(Member* member);
  /// Parameters and block of a member; false, with an error, where either is missing.
  bool ParseRoutine(Member* member);
  /// Parameters in parentheses; false, with an error, where they cannot be read.
  bool ParseParameters(Member* member);
  /// Reports a word that was meant to begin a member, and sets `kind` to the one that was meant.
  bool MendMisspelledWord(TokenKind* kind);

  TokenReader& in_;
  ExpressionParser& expressions_;
  StatementParser& statements_;
};

}  // namespace morphbus::dynarole
