#pragma once
// What gives names to values that are known at compile time: constants, parameters, enumerations.

#include <cstdint>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/expression_parser.h"
#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {

/// Reads their declarations, which stand in a role or outside all. Their words are words where they
/// begin such a declaration, but for `const`, so that programs may use them as names.
class ConstantParser {
 public:
  /// Both must outlive the parser.
  ConstantParser(TokenReader* in, ExpressionParser* expressions)
      : in_(*in), expressions_(*expressions) {}

  /// Whether a declaration begins here.
  [[nodiscard]] bool AtDeclaration() const { return AtConstant() || AtEnumeration(); }
  /// Appends what the declaration that begins here declares.
  void Parse(std::vector<ConstantDecl>* constants);
  /// Hands out the enumerations that have been read, in their order.
  std::vector<Enumeration> TakeEnumerations() { return std::move(enumerations_); }

 private:
  [[nodiscard]] bool AtConstant() const;
  [[nodiscard]] bool AtEnumeration() const;
  /// `const NAME = value;` or `param NAME = value in [least, most];`
  void ParseConstant(std::vector<ConstantDecl>* constants);
  /// The range of a parameter.
  void ParseRange(ConstantDecl* parameter);
  /// `enum NAME { A, B = 5, C }`
  void ParseEnumeration(std::vector<ConstantDecl>* constants);
  /// The number of a value, `= -5`, instead of `*number`; false, with an error, if there is none.
  bool ParseNumber(int64_t* number);
  /// Appends one; an error beyond as many as a role can have members.
  void Add(ConstantDecl constant, std::vector<ConstantDecl>* constants);

  TokenReader& in_;
  ExpressionParser& expressions_;
  std::vector<Enumeration> enumerations_;
};

}  // namespace morphbus::dynarole
