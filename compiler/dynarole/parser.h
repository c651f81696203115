#pragma once
// Recursive descent with recovery: one slip is reported once, and parsing goes on behind it.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// Parses the tokens of a file. What is wrong is an error in `diagnostics`, and reading goes on at
/// the next statement or member, so that one slip hides no other. The tree holds whatever could be
/// understood; parts that could not are kError. No tree is deeper than kMaxDepth.
/// @param file    index of the file in `sources`, whose text the tokens refer to.
/// @param tokens  what Tokenize made of it.
Program Parse(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
              source::Diagnostics* diagnostics);

// Stages of the compiler as text, for --dump and golden tests. The formats are for people and may
// change with the compiler.

/// One token a line, `line:column kind text`, in the order of the text. `tokens` are those of one
/// file of `sources`.
std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens);

/// The tree as parsed, before the checker has seen it: a member or statement a line and indented by
/// their depth; expressions have all their parentheses, so that what binds tighter can be seen.
std::string DumpAst(const Program& program);

// The parser's state and helpers, shared by parser.cc (roles, members), parser_statement.cc and
// parser_expression.cc.

/// More than a role can hold of all kinds together, so that a hostile text costs no time later.
inline constexpr size_t kMaxMembers = 200;

/// A parser by recursive descent: one function for each rule of the grammar (docs/dynarole.md,
/// Programs), named after it. Recursion is bounded by kMaxDepth.
class Parser {
 public:
  /// `sources` and `tokens` must outlive the parser.
  Parser(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
         source::Diagnostics* diagnostics)
      : sources_(sources), file_(file), tokens_(tokens), diagnostics_(*diagnostics) {}

  /// Reads the roles of the file. The tree holds whatever could be read; errors are in the
  /// diagnostics, of which a hundred end the reading. It is
  /// called once.
  Program ParseProgram();

 private:
  // Tokens. `at_` is the place of the next one; the last, kEnd, is never passed.
  /// The token that many places after the next one.
  [[nodiscard]] const Token& Peek(size_t ahead = 0) const {
    return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
  }
  [[nodiscard]] bool Is(TokenKind kind) const { return Peek().kind == kind; }
  [[nodiscard]] std::string TextOf(const Token& token) const {
    return std::string(sources_.text(token.span));
  }
  [[nodiscard]] const Token& Previous() const { return tokens_[at_ > 0 ? at_ - 1 : 0]; }
  /// Takes the next token and moves on, but never past kEnd.
  const Token& Take();
  /// Takes the next token if it is of that kind, and says whether it was.
  bool TakeIf(TokenKind kind);
  /// From the beginning of `begin` to the end of the last token taken.
  [[nodiscard]] source::Span SpanFrom(const source::Span& begin) const;
  /// Whether only spaces stand before the token in its line.
  [[nodiscard]] bool StartsLine(const Token& token) const;

  // Errors. Until reading goes on at the next statement or member, only the first is recorded, as
  // those after it mostly follow from it.
  /// Records an error; null if one stands already.
  source::Diagnostic* ErrorAt(const source::Span& span, std::string message, std::string hint = "");
  /// "expected `wanted`, found ..." at the next token.
  source::Diagnostic* Unexpected(const std::string& wanted, std::string hint = "");
  /// Takes a token of that kind, or reports that it is missing; false then.
  bool Expect(TokenKind kind, const std::string& where);
  bool ExpectSemicolon(const std::string& after);
  /// The same for what closes a parenthesis or brace, with a note where it was opened.
  bool ExpectClosing(TokenKind kind, const source::Span& opening);
  /// Counts a level of nesting, which the caller takes back; false, with an error, beyond
  /// kMaxDepth.
  bool EnterLevel();
  /// Reports an error after which nothing more of the text is read.
  void GiveUp(const source::Span& span, const std::string& message, const std::string& hint);
  /// Gives up on a text whose nesting exceeds kMaxDepth.
  void TooDeep(const source::Span& span);

  // Roles and members (parser.cc).
  /// Appends the role that begins here to the program.
  void ParseRole(Program* program);
  /// Recovery: moves on to the next word that begins a role.
  void SkipToRole();
  void ParseMembers(Role* role);
  void ParseMember(Role* role);
  void ParseField(Member* member);
  /// What may stand between the parameters of a handler and its block.
  void ParseHandlerWords(Member* member);
  /// `const NAME = value;`, in a role or outside all.
  void ParseConstant(std::vector<ConstantDecl>* constants);
  /// Parameters and block of a member; false, with an error, where either is missing.
  bool ParseRoutine(Member* member);
  /// Parameters in parentheses; false, with an error, where they cannot be read.
  bool ParseParameters(Member* member);
  /// Whether a member or role begins here for certain: by a word that begins nothing else.
  [[nodiscard]] bool AtMember() const;
  /// Recovery: moves on to the next member or the end of the role.
  void SkipMember();
  /// Reports a word that was meant to begin a member, and sets `kind` to the one that was meant.
  bool MendMisspelledWord(TokenKind* kind);

  // Statements (parser_statement.cc). Each of these is called where the next token begins it, and
  // leaves the one behind its semicolon or block; what could not be read is kError.
  StmtPtr ParseBlock();
  StmtPtr ParseStatement();
  StmtPtr ParseVar();
  StmtPtr ParseIf();
  StmtPtr ParseWhile();
  StmtPtr ParseFor();
  /// `break;` or `continue;`
  StmtPtr ParseLeave();
  StmtPtr ParseReturn();
  /// Whether the next tokens begin an assignment: a name and a sign that assigns.
  [[nodiscard]] bool AtAssignment() const;
  /// An assignment up to its semicolon, which is left, as is the end of a `for`'s last part.
  StmtPtr ParseAssignment();
  StmtPtr ParseExpressionStatement();
  /// Reports a statement of another language, such as `switch`; false if its first token is none.
  bool ReportForeignStatement(const Token& first);
  /// An expression in parentheses, behind `word`; null, with an error, if there are none.
  ExprPtr ParseCondition(const char* word);
  /// Recovery: moves on to the next statement or the end of the block.
  void SkipStatement();

  // Expressions (parser_expression.cc).
  /// Operators of this level and above, where 1 is `||`, which binds least.
  ExprPtr ParseExpr(int level = 1);
  ExprPtr ParseUnary();
  /// A value with the members and calls behind it.
  ExprPtr ParsePostfix();
  /// A value alone: a number, a word, a name, or an expression in parentheses.
  ExprPtr ParsePrimary();
  /// Reports that no name stands behind a dot, and passes over a word of the language there.
  void NoMember();
  /// The arguments of a call, up to its closing parenthesis, as further operands.
  bool ParseArguments(Expr* call);
  /// Makes a node of that kind without operands.
  ExprPtr Node(ExprKind kind, const source::Span& span);
  /// Makes `child` the last operand of `parent` and keeps count of the depth.
  void Adopt(Expr* parent, ExprPtr child);
  /// Reads the value of a number; one that is too large is an error.
  void ParseNumber(Expr* expr);

  const source::SourceSet& sources_;
  int file_;
  const std::vector<Token>& tokens_;
  source::Diagnostics& diagnostics_;
  size_t at_ = 0;         ///< Index of the next token.
  int level_ = 0;         ///< Levels of nesting around it.
  bool panic_ = false;    ///< An error stands and recovery has not happened yet.
  bool gave_up_ = false;  ///< Nothing more can be said about this text.
};

}  // namespace morphbus::dynarole
