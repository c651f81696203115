#pragma once
// M3L tokens to syntax tree, by recursive descent with recovery: one slip is reported once, and all
// independent errors are found in one go.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/m3l/lexer.h"

namespace morphbus::m3l {

/// Deepest nesting of parentheses and operators that is accepted; bounds every recursion.
constexpr int kMaxNesting = 100;

/// Parses the tokens of one file. Always returns what could be made out; parts that did not parse
/// are reported, left out, and their surroundings marked `broken`. Linear in the tokens.
FileAst Parse(const std::vector<Token>& tokens, source::Diagnostics* diagnostics);

// Stages of the compiler as text, for --dump and golden tests. The formats are for people and may
// change with the compiler.

/// One token a line: `line:column kind text`.
std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens);

/// The tree as parsed, indented: a line for each declaration and attribute, expressions in braces
/// with the operator first.
std::string DumpAst(const FileAst& file);

}  // namespace morphbus::m3l

// The parser's state and helpers, shared by parser.cc (tokens, recovery, files),
// parser_statement.cc and parser_expression.cc.
namespace morphbus::m3l::internal {

/// Recursive descent over the tokens of one file. Statements begin where StartsStatement says so,
/// which is also where parsing goes on after an error.
class Parser {
 public:
  Parser(const std::vector<Token>& tokens, source::Diagnostics* diagnostics)
      : tokens_(tokens), diagnostics_(*diagnostics) {}

  /// The tree of the whole file; see Parse (parser.h).
  FileAst ParseFile();

 private:
  // --- Tokens ------------------------------------------------------------------------------------
  /// Token `i`; beyond the end it is the mark at the end, so that looking ahead is always safe.
  [[nodiscard]] const Token& TokenAt(size_t i) const {
    return tokens_[i < tokens_.size() ? i : tokens_.size() - 1];
  }
  /// The current token: the next that is to be taken.
  [[nodiscard]] const Token& Now() const { return TokenAt(at_); }
  // These compare token `i` without taking it.
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
  /// Takes the current token if it is `symbol`.
  bool Accept(std::string_view symbol);
  /// Token `i` as a name with its place.
  [[nodiscard]] Name NameAt(size_t i) const { return {std::string(Text(i)), TokenAt(i).span}; }
  /// The token for a message: 'text', or "the end of the file".
  [[nodiscard]] std::string Described(size_t i) const;
  /// From the first to the last of the tokens [begin, at_).
  [[nodiscard]] source::Span SpanSince(size_t begin) const;

  // --- Errors ------------------------------------------------------------------------------------
  /// Records an error and counts it.
  source::Diagnostic& Error(const source::Span& span, std::string message);
  /// After kMaxSyntaxErrors: pretends that the file ends here.
  void StopIfTooMany();
  /// Skips what is left of the attribute that began at token `begin`: up to a comma or a closing
  /// parenthesis outside of all that the attribute opened, or to the next statement.
  void SkipAttribute(size_t begin);
  /// Skips to the next statement or the end of the file.
  void SkipToStatement();
  /// The parenthesis that closes the group which token `open` opens; the next statement or the end
  /// of the file if none does.
  [[nodiscard]] size_t EndOfGroup(size_t open) const;
  /// Skips a parenthesised group, from its opening parenthesis.
  void SkipGroup();

  // --- Statements (parser_statement.cc) ----------------------------------------------------------
  [[nodiscard]] bool StartsStatement(size_t i) const { return m3l::StartsStatement(tokens_, i); }
  /// The keyword at the current statement's start; a misspelt one is reported and mended, "" if it
  /// resembles none.
  std::string TakeKeyword();
  /// Parses the definition or member that begins here, with its members if it is a module.
  void ParseStatement(FileAst& file);
  /// The string after `import`.
  void ParseImport(FileAst& file);
  /// `NAME = number` after `const`.
  void ParseConstant(FileAst& file);
  /// A point, link, axis, joint or sensor into `module`; its keyword has been read.
  void ParseMember(const std::string& keyword, ModuleDecl& module);
  /// `NAME:` into `declaration`; the keyword has been read.
  void ParseHeader(Declaration& declaration);
  /// Where the points of a declaration go, and how many levels of them may nest.
  struct PointSlot {
    std::vector<PointDecl>* points = nullptr;
    int levels = 0;
    /// False if the parenthesis around the declaration is missing at its end.
    bool closed = true;
  };
  /// Attributes and points up to the next statement or, if `nested`, to the closing parenthesis,
  /// which is left.
  void ParseBody(Declaration& declaration, PointSlot slot, bool nested);
  /// `key=value` or a flag.
  void ParseAttribute(Declaration& declaration);
  /// `(point NAME: ...)`.
  void ParseSubpoint(Declaration& owner, PointSlot slot);

  // --- Expressions (parser_expression.cc); a function that returns nothing has reported why ---
  /// One function for each level of precedence, weakest first.
  std::optional<Expr> ParseOr();
  std::optional<Expr> ParseAnd();
  std::optional<Expr> ParseNot();
  std::optional<Expr> ParseRelation();
  std::optional<Expr> ParseSum();
  std::optional<Expr> ParseProduct();
  std::optional<Expr> ParseUnary();
  std::optional<Expr> ParsePrimary();
  /// `a.b.c`, and what may follow it: a call, a bound name, an anonymous axis.
  std::optional<Expr> ParsePath();
  /// `f(a, b)`: the function has been read, and the opening parenthesis is the current token.
  std::optional<Expr> ParseCall(Expr function);
  /// `(axis: ...)` behind `path`, which began at token `begin`.
  std::optional<Expr> ParseAnonymousAxis(Expr path, size_t begin);
  /// Elements up to `close` into `into`; the opening token is at `open`.
  bool ParseElements(size_t open, std::string_view close, Expr& into);
  /// One element of a tuple, list or call: an expression, a typed name, an option, an assignment.
  std::optional<Expr> ParseElement();
  /// True, after an error, where nesting has become too deep.
  bool TooDeep();
  /// The relation operator at token `i`, or "".
  [[nodiscard]] std::string RelationAt(size_t i) const;
  /// A node of that kind from token `begin` to the current one, with its first child.
  [[nodiscard]] Expr Node(ExprKind kind, size_t begin, Expr child) const;
  /// Operands of one kind joined by the words or signs `ops` become one flat node.
  std::optional<Expr> ParseChain(ExprKind kind, std::initializer_list<std::string_view> ops,
                                 std::optional<Expr> (Parser::*operand)());

  const std::vector<Token>& tokens_;
  source::Diagnostics& diagnostics_;
  /// The index of the current token.
  size_t at_ = 0;
  /// How deep the current expression is nested; TooDeep bounds it.
  int depth_ = 0;
  /// The number of parentheses and brackets of the current expression that are open.
  int brackets_ = 0;
  /// The number of anonymous axes that are open; an error in one ends the whole attribute.
  int axes_ = 0;
  /// The number of errors so far; see StopIfTooMany.
  int errors_ = 0;
  /// True inside a run of members that have no module, which is reported once.
  bool stray_ = false;
};

}  // namespace morphbus::m3l::internal
