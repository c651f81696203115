#pragma once
// The parser's class, shared by parser.cc (statements) and parser_expression.cc. Not for others.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/m3l/keywords.h"
#include "compiler/m3l/lexer.h"

namespace morphbus::m3l::internal {

class Parser {
 public:
  Parser(const std::vector<Token>& tokens, source::Diagnostics& diagnostics)
      : tokens_(tokens), diagnostics_(diagnostics) {}

  FileAst ParseFile();

 private:
  // --- Tokens ------------------------------------------------------------------------------------
  [[nodiscard]] const Token& TokenAt(size_t i) const {
    return tokens_[i < tokens_.size() ? i : tokens_.size() - 1];
  }
  [[nodiscard]] const Token& Now() const { return TokenAt(at_); }
  [[nodiscard]] std::string_view Text(size_t i) const { return TokenAt(i).text; }
  [[nodiscard]] bool IsKind(size_t i, TokenKind kind) const { return TokenAt(i).kind == kind; }
  [[nodiscard]] bool IsSymbol(size_t i, std::string_view symbol) const {
    return IsKind(i, TokenKind::kSymbol) && Text(i) == symbol;
  }
  [[nodiscard]] bool IsWord(size_t i, std::string_view word) const {
    return IsKind(i, TokenKind::kWord) && Text(i) == word;
  }
  [[nodiscard]] bool Is(std::string_view symbol) const { return IsSymbol(at_, symbol); }
  [[nodiscard]] bool AtEnd() const { return Now().kind == TokenKind::kEnd; }
  bool Accept(std::string_view symbol);
  [[nodiscard]] Name NameAt(size_t i) const { return {std::string(Text(i)), TokenAt(i).span}; }
  /// The token for a message: 'text', or "the end of the file".
  [[nodiscard]] std::string Described(size_t i) const;
  /// From the first to the last of the tokens [begin, at_).
  [[nodiscard]] source::Span SpanSince(size_t begin) const;

  // --- Errors ------------------------------------------------------------------------------------
  source::Diagnostic& Error(const source::Span& span, std::string message);
  /// After kMaxSyntaxErrors: pretends that the file ends here.
  void StopIfTooMany();
  /// Skips what is left of the attribute that began at token `begin`: up to a comma or a closing
  /// parenthesis outside of all that the attribute opened, or to the next statement.
  void SkipAttribute(size_t begin);
  void SkipToStatement();
  /// Skips a parenthesised group, from its opening parenthesis.
  void SkipGroup();

  // --- Statements (parser.cc) --------------------------------------------------------------------
  [[nodiscard]] bool StartsStatement(size_t i) const { return m3l::StartsStatement(tokens_, i); }
  /// The keyword at the current statement's start; a misspelt one is reported and mended, "" if it
  /// resembles none.
  std::string TakeKeyword();
  void ParseStatement(FileAst& file);
  void ParseImport(FileAst& file);
  void ParseMember(const std::string& keyword, ModuleDecl& module);
  /// `NAME:` into `declaration`; the keyword has been read.
  void ParseHeader(Declaration& declaration);
  /// Where the points of a declaration go, and how many levels of them may nest.
  struct PointSlot {
    std::vector<PointDecl>* points = nullptr;
    int levels = 0;
  };
  /// Attributes and points up to the next statement or, if `nested`, to the closing parenthesis,
  /// which is left.
  void ParseBody(Declaration& declaration, PointSlot slot, bool nested);
  void ParseAttribute(Declaration& declaration);
  /// `(point NAME: ...)`.
  void ParseSubpoint(Declaration& owner, PointSlot slot);

  // --- Expressions (parser_expression.cc); nothing means: reported
  // ---------------------------------
  std::optional<Expr> ParseOr();
  std::optional<Expr> ParseAnd();
  std::optional<Expr> ParseNot();
  std::optional<Expr> ParseRelation();
  std::optional<Expr> ParseSum();
  std::optional<Expr> ParseProduct();
  std::optional<Expr> ParseUnary();
  std::optional<Expr> ParsePrimary();
  std::optional<Expr> ParsePath();
  std::optional<Expr> ParseCall(Expr function);
  std::optional<Expr> ParseAnonymousAxis(Expr path, size_t begin);
  /// Elements up to `close` into `into`; the opening token is at `open`.
  bool ParseElements(size_t open, std::string_view close, Expr& into);
  /// One element of a tuple, list or call: an expression, a typed name, an option, an assignment.
  std::optional<Expr> ParseElement();
  /// True, after an error, where nesting has become too deep.
  bool TooDeep();
  /// The relation operator at the current token, or "".
  [[nodiscard]] std::string RelationAt(size_t i) const;
  std::optional<Expr> ParseChain(ExprKind kind, std::string_view word,
                                 std::optional<Expr> (Parser::*operand)());
  std::optional<Expr> ParseArithmetic(ExprKind kind, std::string_view ops,
                                      std::optional<Expr> (Parser::*operand)());

  const std::vector<Token>& tokens_;
  source::Diagnostics& diagnostics_;
  size_t at_ = 0;
  int depth_ = 0;     ///< Nesting of expressions.
  int brackets_ = 0;  ///< Open parentheses and brackets of the current expression.
  int axes_ = 0;      ///< Open anonymous axes; an error in one ends the whole attribute.
  int errors_ = 0;
  bool stray_ = false;  ///< Inside a run of members that have no module; reported once.
};

}  // namespace morphbus::m3l::internal
