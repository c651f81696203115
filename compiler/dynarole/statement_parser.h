#pragma once
// Statements and blocks of them.

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/expression_parser.h"
#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {

/// Reads statements. Each function is called where the next token begins what it is named after,
/// and leaves the one behind its semicolon or block; what could not be read is kError.
class StatementParser {
 public:
  /// Both must outlive the parser.
  StatementParser(TokenReader* in, ExpressionParser* expressions)
      : in_(*in), expressions_(*expressions) {}

  /// Statements in braces. An error ends with its statement; reading goes on at the next.
  StmtPtr ParseBlock();

 private:
  StmtPtr ParseStatement();
  StmtPtr ParseVar();
  StmtPtr ParseIf();
  /// Whether a switch begins here: its word, a condition and a brace.
  [[nodiscard]] bool AtSwitch() const;
  StmtPtr ParseSwitch();
  /// Whether a case of a switch begins here.
  [[nodiscard]] bool AtCase() const;
  /// `case VALUES:` or `default:`
  SwitchCase ParseCase();
  /// Recovery: moves on to the next case or the end of the switch.
  void SkipToCase();
  StmtPtr ParseWhile();
  StmtPtr ParseFor();
  /// Whether `NAME in` stands here, from the token number `ahead` on.
  [[nodiscard]] bool AtIn(size_t ahead) const;
  /// `NAME in SET) statement`, behind the parenthesis that is at `opening`.
  StmtPtr ParseForEach(const source::Span& opening);
  /// `break;` or `continue;`
  StmtPtr ParseLeave();
  StmtPtr ParseReturn();
  /// Whether the next tokens begin an assignment: a name and a sign that assigns.
  [[nodiscard]] bool AtAssignment() const;
  /// Reports an assignment to something behind a dot, `n.load = 3;`; false if there is none.
  bool ReportMemberAssignment();
  /// An assignment up to its semicolon, which is left, as is the end of a `for`'s last part.
  StmtPtr ParseAssignment();
  StmtPtr ParseExpressionStatement();
  /// Reports a statement of another language, such as `switch`; false if its first token is none.
  bool ReportForeignStatement(const Token& first);
  /// An expression in parentheses, behind `word`; null, with an error, if there are none.
  ExprPtr ParseCondition(const char* word);
  /// Recovery: moves on to the next statement or the end of the block.
  void SkipStatement();

  TokenReader& in_;
  ExpressionParser& expressions_;
};

}  // namespace morphbus::dynarole
