#include "compiler/dynarole/parser.h"

#include <string>
#include <utility>

#include "compiler/dynarole/constant_parser.h"
#include "compiler/dynarole/expression_parser.h"
#include "compiler/dynarole/member_parser.h"
#include "compiler/dynarole/statement_parser.h"
#include "compiler/dynarole/token_reader.h"

namespace morphbus::dynarole {

namespace {

using source::Span;

/// Reads roles, and what stands beside them.
class ProgramParser {
 public:
  /// `sources` and `tokens` must outlive the parser.
  ProgramParser(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
                source::Diagnostics* diagnostics)
      : in_(sources, file, tokens, diagnostics),
        expressions_(&in_),
        statements_(&in_, &expressions_),
        members_(&in_, &expressions_, &statements_),
        constants_(&in_, &expressions_) {}

  /// Reads the roles of the file. It is called once.
  Program ParseProgram();

 private:
  /// Appends the role that begins here to the program.
  void ParseRole(Program* program);
  /// `import "FILE";`
  void ParseImport(Program* program);
  /// Recovery: behind what could not be read outside all roles, or at what can begin something
  /// else there.
  void SkipDeclaration();
  /// A function outside all roles, which becomes a member of their root.
  void ParseFunction(Program* program);
  /// Recovery: moves on to the next word that begins a role.
  void SkipToRole();
  void ParseMembers(Role* role);

  TokenReader in_;
  ExpressionParser expressions_;
  StatementParser statements_;
  MemberParser members_;
  ConstantParser constants_;
};

Program ProgramParser::ParseProgram() {
  Program program;
  // Nobody reads on after a hundred messages.
  while (!in_.Is(TokenKind::kEnd) && !in_.said_enough()) {
    in_.Recover();
    in_.LeaveAllLevels();
    if (in_.Is(TokenKind::kRole) || in_.Is(TokenKind::kAbstract)) {
      ParseRole(&program);
      continue;
    }
    if (in_.Is(TokenKind::kFunction)) {
      ParseFunction(&program);
      continue;
    }
    if (constants_.AtDeclaration()) {
      constants_.Parse(&program.constants);
      SkipDeclaration();
      continue;
    }
    // `import` is a word here only, so that programs may use it as a name.
    if (in_.Is(TokenKind::kName) && in_.TextOf(in_.Peek()) == "import") {
      ParseImport(&program);
      SkipDeclaration();
      continue;
    }
    if (in_.Is(TokenKind::kRightBrace)) {
      in_.ErrorAt(in_.Take().span, "unmatched '}'");
      continue;
    }
    if (IsMemberWord(in_.Peek().kind)) {
      in_.ErrorAt(in_.Peek().span, "a " + NameOf(*MemberOf(in_.Peek().kind)) + " stands in a role",
                  "outside roles stand functions, constants, parameters, enumerations and imports");
      in_.Take();
      members_.Skip();
      continue;
    }
    // Something else stands between roles, perhaps a misspelt word.
    in_.Unexpected(
        "'role' or 'abstract role'",
        source::NearestHint(in_.TextOf(in_.Peek()),
                            {"role", "abstract", "const", "param", "enum", "function", "import"},
                            "a program is a list of roles: role NAME extends Module { ... }"));
    SkipToRole();
  }
  program.enumerations = constants_.TakeEnumerations();
  return program;
}

void ProgramParser::ParseImport(Program* program) {
  in_.Take();
  if (!in_.Is(TokenKind::kText)) {
    in_.Unexpected("the name of a file in quotes", "for example: import \"lib.dyn\";");
    return;
  }
  const Span span = in_.Peek().span;
  program->imports.push_back({TextValue(in_.TextOf(in_.Take())), span});
  in_.ExpectSemicolon("the import");
}

void ProgramParser::SkipDeclaration() {
  while (in_.failed() && !constants_.AtDeclaration() && !in_.Is(TokenKind::kRole) &&
         !in_.Is(TokenKind::kAbstract) && !in_.Is(TokenKind::kFunction) &&
         !in_.Is(TokenKind::kEnd)) {
    if (in_.Take().kind == TokenKind::kSemicolon) in_.Recover();
  }
}

void ProgramParser::ParseFunction(Program* program) {
  if (program->root == nullptr) {
    program->root = std::make_unique<Role>();
    program->root->abstract_role = true;
    program->root->name = "Module";
    program->root->span = program->root->name_span = in_.Peek().span;
  }
  if (program->root->members.size() >= kMaxMembers) {
    in_.GiveUp(in_.Peek().span, "too many functions outside roles",
               "at most " + std::to_string(kMaxMembers));
    return;
  }
  members_.Parse(program->root.get());
  // Reading goes on behind it, or at what can begin something else.
  if (in_.failed()) members_.Skip();
}

// A role's words begin nothing else, so that reading can go on there whatever came before.
void ProgramParser::SkipToRole() {
  // A function without indentation is no member of a role that could not be read.
  while (!in_.Is(TokenKind::kEnd) && !in_.Is(TokenKind::kRole) && !in_.Is(TokenKind::kAbstract) &&
         !(in_.Is(TokenKind::kFunction) && in_.AtMargin())) {
    in_.Take();
  }
}

// `[abstract] role NAME extends NAME { members }`
void ProgramParser::ParseRole(Program* program) {
  Role role;
  role.span = in_.Peek().span;
  role.abstract_role = in_.TakeIf(TokenKind::kAbstract);
  if (!in_.Expect(TokenKind::kRole, "after 'abstract'")) return SkipToRole();
  if (!in_.Is(TokenKind::kName)) {
    in_.Unexpected("the role's name");
    return SkipToRole();
  }
  // Without `extends`, or with a wrong name behind it, the role is read as if it extended Module.
  role.name_span = in_.Peek().span;
  role.name = in_.TextOf(in_.Take());
  role.base_span = role.name_span;
  role.base = "Module";
  if (!in_.TakeIf(TokenKind::kExtends)) {
    in_.Unexpected("'extends' and the role that '" + role.name + "' extends",
                   "the root of all roles is Module: role " + role.name + " extends Module");
    // A name without the word was surely meant to be the base.
    if (in_.Is(TokenKind::kName)) in_.Take();
  } else if (in_.Is(TokenKind::kName)) {
    role.base_span = in_.Peek().span;
    role.base = in_.TextOf(in_.Take());
  } else {
    in_.Unexpected("the name of the role that '" + role.name + "' extends");
  }
  role.span = in_.SpanFrom(role.span);
  // The members are worth reading also where the first line of the role is wrong.
  if (in_.failed()) {
    while (!in_.Is(TokenKind::kLeftBrace) && !in_.Is(TokenKind::kRole) && !in_.Is(TokenKind::kEnd))
      in_.Take();
    in_.Recover();
  }
  ParseMembers(&role);
  program->roles.push_back(std::move(role));
}

// Members up to the brace; one that was not understood is skipped, and the next one read.
void ProgramParser::ParseMembers(Role* role) {
  const Span opening = in_.Peek().span;
  if (!in_.Expect(TokenKind::kLeftBrace, "before the members of '" + role->name + "'")) {
    return SkipToRole();
  }
  while (!in_.Is(TokenKind::kRightBrace)) {
    in_.Recover();
    // Another role can only begin behind this one's brace.
    if (in_.Is(TokenKind::kEnd) || in_.Is(TokenKind::kRole) || in_.Is(TokenKind::kAbstract)) {
      in_.ExpectClosing(TokenKind::kRightBrace, opening);
      return;
    }
    // The limit of messages holds within a role too.
    if (in_.said_enough()) return;
    if (constants_.AtDeclaration()) {
      constants_.Parse(&role->constants);
      if (in_.failed()) members_.Skip();
      continue;
    }
    if (role->members.size() >= kMaxMembers) {
      in_.GiveUp(in_.Peek().span, "role '" + role->name + "' has too many members",
                 "at most " + std::to_string(kMaxMembers));
      return;
    }
    members_.Parse(role);
    if (in_.failed()) members_.Skip();
  }
  in_.Take();
  in_.TakeIf(TokenKind::kSemicolon);
}

}  // namespace

Program Parse(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
              source::Diagnostics* diagnostics) {
  return ProgramParser(sources, file, tokens, diagnostics).ParseProgram();
}

}  // namespace morphbus::dynarole
