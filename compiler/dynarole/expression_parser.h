#pragma once
// Expressions by precedence climbing: operators by how tightly they bind, then what stands between
// them.

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {

/// What the elements of an array are, and how many of these whoever holds the array has at most.
struct ArrayRoom {
  const char* element;
  const char* holder;
  int most;
};

/// Reads expressions where they begin. One function for each rule of the grammar (docs/dynarole.md,
/// Programs); what cannot be read is reported, and a node of kind kError.
class ExpressionParser {
 public:
  /// `in` must outlive the parser.
  explicit ExpressionParser(TokenReader* in) : in_(*in) {}

  /// Operators of this level and above, where 1 is `||`, which binds least.
  ExprPtr Parse(int level = 1);
  /// `[LENGTH]`, how many elements an array has, behind its name; 0, with an error, if it cannot be
  /// read or there is no room for so many.
  int ParseLength(const ArrayRoom& room);
  /// Whether an array may have so many elements; an error at `span` if not.
  bool HasRoom(int64_t length, const source::Span& span, const ArrayRoom& room);
  /// A number without a point, which stands here, and nothing that follows it.
  ExprPtr ParseInt();

 private:
  /// `? this : that` behind its condition.
  ExprPtr ParseChoice(ExprPtr condition);
  ExprPtr ParseUnary();
  /// Reports the next token if it is an operator of other languages, such as `and`.
  void ReportForeignOperator();
  /// A value with the members and calls behind it.
  ExprPtr ParsePostfix();
  /// A value alone: a number, a word, a name, or an expression in parentheses.
  ExprPtr ParsePrimary();
  /// Reports that no name stands behind a dot, and passes over a word of the language there.
  void NoMember();
  /// The arguments of a call, up to its closing parenthesis, as further operands.
  bool ParseArguments(Expr* call);
  /// `[x, y]`, the values of an array.
  ExprPtr ParseArray();
  /// Makes a node of that kind without operands.
  static ExprPtr Node(ExprKind kind, const source::Span& span);
  /// Makes `child` the last operand of `parent` and keeps count of the depth.
  void Adopt(Expr* parent, ExprPtr child);
  /// Reads the value of a number; one that is too large is an error.
  void ParseNumber(Expr* expr);

  TokenReader& in_;
};

}  // namespace morphbus::dynarole
