#pragma once
// The parser's state and helpers, shared by parser.cc (roles, members), parser_stmt.cc and
// parser_expr.cc.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/lexer.h"

namespace morphbus::dynarole {

/// More than a role can hold of all kinds together, so that a hostile text costs no time later.
inline constexpr size_t kMaxMembers = 200;

class Parser {
 public:
  Parser(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
         source::Diagnostics* diagnostics)
      : sources_(sources), file_(file), tokens_(tokens), diagnostics_(*diagnostics) {}

  Program ParseProgram();

 private:
  // Tokens.
  [[nodiscard]] const Token& Peek(size_t ahead = 0) const {
    return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
  }
  [[nodiscard]] bool Is(TokenKind kind) const { return Peek().kind == kind; }
  [[nodiscard]] std::string TextOf(const Token& token) const {
    return std::string(sources_.text(token.span));
  }
  [[nodiscard]] const Token& Previous() const { return tokens_[at_ > 0 ? at_ - 1 : 0]; }
  const Token& Take();
  bool TakeIf(TokenKind kind);
  [[nodiscard]] source::Span SpanFrom(const source::Span& begin) const;
  [[nodiscard]] bool StartsLine(const Token& token) const;

  // Errors. Until recovery, only the first of a statement or member is recorded.
  source::Diagnostic* ErrorAt(const source::Span& span, std::string message);
  source::Diagnostic* Unexpected(const std::string& wanted);
  bool Expect(TokenKind kind, const std::string& where);
  bool ExpectSemicolon(const std::string& after);
  bool ExpectClosing(TokenKind kind, const source::Span& opening);
  bool EnterLevel();
  void GiveUp(const source::Span& span, const std::string& message, const std::string& hint);
  void TooDeep(const source::Span& span);

  // Roles and members (parser.cc).
  void ParseRole(Program* program);
  void SkipToRole();
  void ParseMembers(Role* role);
  void ParseMember(Role* role);
  void ParseField(Member* member);
  bool ParseRoutine(Member* member);
  bool ParseParameters(Member* member);
  [[nodiscard]] bool AtMember() const;
  void SkipMember();
  bool MendMisspelledWord(TokenKind* kind);

  // Statements (parser_stmt.cc).
  StmtPtr ParseBlock();
  StmtPtr ParseStatement();
  StmtPtr ParseVar();
  StmtPtr ParseIf();
  StmtPtr ParseWhile();
  StmtPtr ParseReturn();
  StmtPtr ParseAssignment();
  StmtPtr ParseExpressionStatement();
  ExprPtr ParseCondition(const char* word);
  void SkipStatement();

  // Expressions (parser_expr.cc).
  ExprPtr ParseExpr(int level = 1);
  ExprPtr ParseUnary();
  ExprPtr ParsePostfix();
  ExprPtr ParsePrimary();
  bool ParseArguments(Expr* call);
  ExprPtr Node(ExprKind kind, const source::Span& span);
  void Adopt(Expr* parent, ExprPtr child);
  void ParseNumber(Expr* expr);

  const source::SourceSet& sources_;
  int file_;
  const std::vector<Token>& tokens_;
  source::Diagnostics& diagnostics_;
  size_t at_ = 0;
  int level_ = 0;
  bool panic_ = false;    ///< An error stands and recovery has not happened yet.
  bool gave_up_ = false;  ///< Nothing more can be said about this text.
};

}  // namespace morphbus::dynarole
