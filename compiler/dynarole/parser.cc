#include "compiler/dynarole/parser.h"

namespace morphbus::dynarole {

namespace {

using source::Diagnostic;
using source::Span;

// The kind of member that a word begins; a field has none.
std::optional<MemberKind> MemberOf(TokenKind word) {
  if (!IsMemberWord(word)) return std::nullopt;
  constexpr int kFirst = static_cast<int>(TokenKind::kLabel);
  static_assert(static_cast<int>(TokenKind::kFunction) - kFirst ==
                static_cast<int>(MemberKind::kFunction) - static_cast<int>(MemberKind::kLabel));
  return static_cast<MemberKind>(static_cast<int>(word) - kFirst +
                                 static_cast<int>(MemberKind::kLabel));
}

}  // namespace

Program Parse(const source::SourceSet& sources, int file, const std::vector<Token>& tokens,
              source::Diagnostics* diagnostics) {
  return Parser(sources, file, tokens, diagnostics).ParseProgram();
}

const Token& Parser::Take() {
  const Token& token = Peek();
  // The end of the file is never taken, so that Peek always has something.
  if (at_ + 1 < tokens_.size()) ++at_;
  return token;
}

bool Parser::TakeIf(TokenKind kind) {
  if (!Is(kind)) return false;
  Take();
  return true;
}

Span Parser::SpanFrom(const Span& begin) const {
  return {file_, begin.begin, std::max(Previous().span.end, begin.end)};
}

bool Parser::StartsLine(const Token& token) const {
  // Goes back from the token to the line's beginning.
  const std::string_view text = sources_.text(file_);
  for (size_t i = token.span.begin; i > 0; --i) {
    if (text[i - 1] == '\n') return true;
    if (text[i - 1] != ' ' && text[i - 1] != '\t' && text[i - 1] != '\r') return false;
  }
  return true;
}

Diagnostic* Parser::ErrorAt(const Span& span, std::string message, std::string hint) {
  // What follows an error in the same statement or member mostly follows from it.
  if (panic_ || gave_up_) return nullptr;
  panic_ = true;
  return &diagnostics_.Error(span, std::move(message)).Hint(std::move(hint));
}

Diagnostic* Parser::Unexpected(const std::string& wanted, std::string hint) {
  const Token& token = Peek();
  // Names and numbers are shown as they stand in the text.
  const std::string found =
      HasText(token.kind) ? "'" + TextOf(token).substr(0, 40) + "'" : Describe(token.kind);
  return ErrorAt(token.span, "expected " + wanted + ", found " + found, std::move(hint));
}

bool Parser::Expect(TokenKind kind, const std::string& where) {
  if (TakeIf(kind)) return true;
  Unexpected(Describe(kind) + (where.empty() ? "" : " " + where));
  return false;
}

// A missing semicolon is noticed at the next token but belongs behind the last one; when the next
// token begins a line, nothing else is wrong.
bool Parser::ExpectSemicolon(const std::string& after) {
  if (panic_) return false;
  if (TakeIf(TokenKind::kSemicolon)) return true;
  // The statement is complete but for the semicolon, so that reading goes on without recovery.
  if (StartsLine(Peek()) || Is(TokenKind::kRightBrace) || Is(TokenKind::kEnd)) {
    const size_t end = Previous().span.end;
    diagnostics_.Error({file_, end, end}, "expected ';' after " + after);
    return true;
  }
  Unexpected("';' after " + after);
  return false;
}

bool Parser::ExpectClosing(TokenKind kind, const Span& opening) {
  if (panic_) return false;
  if (TakeIf(kind)) return true;
  // The note shows the one that was not closed, which may stand far above.
  const char* open = kind == TokenKind::kRightParen ? "'('" : "'{'";
  Diagnostic* error = Unexpected(Describe(kind));
  if (error != nullptr) error->notes.push_back({opening, std::string("to close this ") + open});
  // At the end everything else that is open is so for the same reason.
  gave_up_ = gave_up_ || Is(TokenKind::kEnd);
  return false;
}

bool Parser::EnterLevel() {
  if (++level_ <= kMaxDepth) return true;
  TooDeep(Peek().span);
  return false;
}

// The rest of the text is passed over, so that every loop over it ends.
void Parser::GiveUp(const Span& span, const std::string& message, const std::string& hint) {
  ErrorAt(span, message, hint);
  panic_ = gave_up_ = true;
  at_ = tokens_.size() - 1;
}

void Parser::TooDeep(const Span& span) {
  GiveUp(span, "nested too deeply",
         "at most " + std::to_string(kMaxDepth) + " levels; split it into functions");
}

// ---- Roles and members ----

Program Parser::ParseProgram() {
  Program program;
  program.file = file_;
  // Nobody reads on after a hundred messages.
  while (!Is(TokenKind::kEnd) && diagnostics_.all().size() < 100) {
    panic_ = false;
    level_ = 0;
    if (Is(TokenKind::kRole) || Is(TokenKind::kAbstract)) {
      ParseRole(&program);
      continue;
    }
    if (Is(TokenKind::kConst)) {
      ParseConstant(&program.constants);
      // Reading goes on behind it, or at what can begin something else.
      while (panic_ && !Is(TokenKind::kConst) && !Is(TokenKind::kRole) &&
             !Is(TokenKind::kAbstract) && !Is(TokenKind::kEnd)) {
        panic_ = Take().kind != TokenKind::kSemicolon;
      }
      continue;
    }
    if (Is(TokenKind::kRightBrace)) {
      ErrorAt(Take().span, "unmatched '}'");
      continue;
    }
    // Something else stands between roles, perhaps a misspelt word.
    Unexpected(
        "'role' or 'abstract role'",
        source::NearestHint(TextOf(Peek()), {"role", "abstract", "const"},
                            "a program is a list of roles: role NAME extends Module { ... }"));
    SkipToRole();
  }
  return program;
}

// A role's words begin nothing else, so that reading can go on there whatever came before.
void Parser::SkipToRole() {
  while (!Is(TokenKind::kEnd) && !Is(TokenKind::kRole) && !Is(TokenKind::kAbstract)) Take();
}

// A name that is known nowhere yet, and its value, which the checker computes.
void Parser::ParseConstant(std::vector<ConstantDecl>* constants) {
  Take();
  if (!Is(TokenKind::kName)) {
    Unexpected("the name of the constant");
    return;
  }
  ConstantDecl constant;
  constant.name_span = Peek().span;
  constant.name = TextOf(Take());
  if (!Expect(TokenKind::kAssign, "and the value of the constant '" + constant.name + "'")) return;
  constant.expr = ParseExpr();
  ExpectSemicolon("the constant '" + constant.name + "'");
  // As many as a role can have members, so that a hostile text costs no time later.
  if (constants->size() == kMaxMembers) {
    GiveUp(constant.name_span, "too many constants",
           "at most " + std::to_string(kMaxMembers) + " in one place");
    return;
  }
  constants->push_back(std::move(constant));
}

// `[abstract] role NAME extends NAME { members }`
void Parser::ParseRole(Program* program) {
  Role role;
  role.span = Peek().span;
  role.abstract_role = TakeIf(TokenKind::kAbstract);
  if (!Expect(TokenKind::kRole, "after 'abstract'")) return SkipToRole();
  if (!Is(TokenKind::kName)) {
    Unexpected("the role's name");
    return SkipToRole();
  }
  // Without `extends`, or with a wrong name behind it, the role is read as if it extended Module.
  role.name_span = Peek().span;
  role.name = TextOf(Take());
  role.base_span = role.name_span;
  role.base = "Module";
  if (!TakeIf(TokenKind::kExtends)) {
    Unexpected("'extends' and the role that '" + role.name + "' extends",
               "the root of all roles is Module: role " + role.name + " extends Module");
    // A name without the word was surely meant to be the base.
    if (Is(TokenKind::kName)) Take();
  } else if (Is(TokenKind::kName)) {
    role.base_span = Peek().span;
    role.base = TextOf(Take());
  } else {
    Unexpected("the name of the role that '" + role.name + "' extends");
  }
  role.span = SpanFrom(role.span);
  // The members are worth reading also where the first line of the role is wrong.
  if (panic_) {
    while (!Is(TokenKind::kLeftBrace) && !Is(TokenKind::kRole) && !Is(TokenKind::kEnd)) Take();
    panic_ = false;
  }
  ParseMembers(&role);
  program->roles.push_back(std::move(role));
}

// Members up to the brace; one that was not understood is skipped, and the next one read.
void Parser::ParseMembers(Role* role) {
  const Span opening = Peek().span;
  if (!Expect(TokenKind::kLeftBrace, "before the members of '" + role->name + "'")) {
    return SkipToRole();
  }
  while (!Is(TokenKind::kRightBrace)) {
    panic_ = false;
    // Another role can only begin behind this one's brace.
    if (Is(TokenKind::kEnd) || Is(TokenKind::kRole) || Is(TokenKind::kAbstract)) {
      ExpectClosing(TokenKind::kRightBrace, opening);
      return;
    }
    // The limit of messages holds within a role too.
    if (diagnostics_.all().size() >= 100) return;
    if (Is(TokenKind::kConst)) {
      ParseConstant(&role->constants);
      if (panic_) SkipMember();
      continue;
    }
    if (role->members.size() == kMaxMembers) {
      GiveUp(Peek().span, "role '" + role->name + "' has too many members",
             "at most " + std::to_string(kMaxMembers));
      return;
    }
    ParseMember(role);
    if (panic_) SkipMember();
  }
  Take();
  TakeIf(TokenKind::kSemicolon);
}

bool Parser::AtMember() const {
  return IsMemberWord(Peek().kind) || Is(TokenKind::kConst) || Is(TokenKind::kShared) ||
         Is(TokenKind::kRole) || Is(TokenKind::kAbstract) || Is(TokenKind::kEnd);
}

// Goes on behind the member: after its ';' or its block, or before something that begins another.
void Parser::SkipMember() {
  // Braces are counted, so that a body that was not understood is skipped as a whole.
  int depth = 0;
  while (!Is(TokenKind::kEnd)) {
    if (depth == 0 && (Is(TokenKind::kRightBrace) || AtMember())) return;
    if (depth > 0 && (Is(TokenKind::kRole) || Is(TokenKind::kAbstract))) return;
    const TokenKind kind = Take().kind;
    if (kind == TokenKind::kSemicolon && depth == 0) return;
    if (kind == TokenKind::kLeftBrace) ++depth;
    if (kind == TokenKind::kRightBrace && --depth == 0) return;
  }
}

// `lable x = ...` and `comand f() {`: a name where a word was meant.
bool Parser::MendMisspelledWord(TokenKind* kind) {
  if (!Is(TokenKind::kName) || Peek(1).kind != TokenKind::kName || StartsLine(Peek(1))) {
    return false;
  }
  // Two names in one line begin no field, so the first was meant as a word.
  const std::string text = TextOf(Peek());
  const std::string near = source::NearestName(
      text, {"label", "require", "startup", "behavior", "command", "handler", "function"});
  Diagnostic& error = diagnostics_.Error(Peek().span, "unknown kind of member '" + text + "'");
  if (near.empty()) {
    error.hint =
        "a member is a field, label, require, startup, behavior, command, handler or "
        "function";
    panic_ = true;
    return false;
  }
  error.hint = "did you mean '" + near + "'?";
  *kind = TokenKind::kLabel;
  while (Describe(*kind) != "'" + near + "'")
    *kind = static_cast<TokenKind>(static_cast<int>(*kind) + 1);
  return true;
}

void Parser::ParseMember(Role* role) {
  // A member begins with its word, a field with its name.
  Member member;
  member.span = Peek().span;
  TokenKind kind = Peek().kind;
  if (MendMisspelledWord(&kind)) Take();
  if (panic_) return;
  // A word, or the one that was meant, decides the kind; without one it is a field.
  if (const std::optional<MemberKind> word = MemberOf(kind)) {
    if (kind == Peek().kind) Take();
    member.kind = *word;
  } else if (TakeIf(TokenKind::kShared)) {
    member.shared = true;
  } else if (!Is(TokenKind::kName)) {
    Unexpected("a member of '" + role->name + "' or '}'");
    // Never stand still.
    if (!AtMember()) Take();
    return;
  }
  // A requirement has no name.
  if (member.kind == MemberKind::kRequire) {
    member.name_span = member.span;
    member.expr = ParseExpr();
    ExpectSemicolon("the requirement");
  } else {
    if (!Is(TokenKind::kName)) {
      Unexpected("the name of the " + NameOf(member.kind));
      return;
    }
    // Behind the name: the value of a field or label, or parameters and a block.
    member.name_span = Peek().span;
    member.name = TextOf(Take());
    if (member.kind == MemberKind::kField || member.kind == MemberKind::kLabel) {
      ParseField(&member);
    } else if (!ParseRoutine(&member)) {
      return;
    }
  }
  member.span = SpanFrom(member.span);
  role->members.push_back(std::move(member));
}

// `NAME;`, `NAME = value;` and `label NAME = value;`
void Parser::ParseField(Member* member) {
  if (member->kind == MemberKind::kLabel && !Is(TokenKind::kAssign)) {
    Unexpected("'=' and what the label '" + member->name + "' names",
               "for example: label " + member->name + " = self.joints($ANY, 1);");
    return;
  }
  // A field cannot have parameters; a word was left out before a routine.
  if (Is(TokenKind::kLeftParen)) {
    Unexpected("';' or '=' after the field '" + member->name + "'",
               "for code, write startup, behavior, command, handler or function before '" +
                   member->name + "'");
    return;
  }
  if (TakeIf(TokenKind::kAssign)) member->expr = ParseExpr();
  ExpectSemicolon("the " + NameOf(member->kind) + " '" + member->name + "'");
}

// `NAME(parameters) { statements }` behind the word of its kind.
bool Parser::ParseRoutine(Member* member) {
  const std::string what = NameOf(member->kind) + " '" + member->name + "'";
  if (!Is(TokenKind::kLeftParen)) {
    Unexpected("'(' after the " + what, "without parameters write " + member->name + "()");
    return false;
  }
  if (!ParseParameters(member)) return false;
  if (member->kind == MemberKind::kHandler) ParseHandlerWords(member);
  if (panic_) return false;
  if (!Is(TokenKind::kLeftBrace)) {
    Unexpected("'{' and the body of the " + what);
    return false;
  }
  member->body = ParseBlock();
  return true;
}

// `every PERIOD` and `early`. They are words in this place only, so that programs may use them as
// names.
void Parser::ParseHandlerWords(Member* member) {
  while (Is(TokenKind::kName) && !panic_) {
    const std::string word = TextOf(Peek());
    if (word == "early" && !member->early) {
      Take();
      member->early = true;
    } else if (word == "every" && member->period == nullptr) {
      Take();
      member->period = ParseExpr();
    } else {
      Unexpected("'every', 'early' or the body of the handler '" + member->name + "'",
                 source::NearestHint(word, {"every", "early"},
                                     "for example: handler " + member->name + "() every 0.5 {"));
    }
  }
}

bool Parser::ParseParameters(Member* member) {
  const Span opening = Take().span;
  if (TakeIf(TokenKind::kRightParen)) return true;
  do {
    // `name` or `type name`.
    Parameter parameter;
    if (!Is(TokenKind::kName) && !Is(TokenKind::kRole)) {
      Unexpected("the name of a parameter");
      return false;
    }
    // `float speed`: a type may stand before the name; `role` is a word of its own.
    if (Peek(1).kind == TokenKind::kName) {
      const std::string text = TextOf(Peek());
      const std::optional<Type> type = TypeFromName(text);
      if (!type) {
        ErrorAt(
            Peek().span, "unknown type '" + text + "'",
            source::NearestHint(
                text,
                {"bool", "int", "float", "direction", "axis", "role", "joint", "link", "connector"},
                "parameters are bool, int, float, direction, axis, role, joint, link or connector, "
                "or stand without a type"));
        return false;
      }
      parameter.type = *type;
      Take();
    }
    if (!Is(TokenKind::kName)) {
      Unexpected("the name of a parameter");
      return false;
    }
    parameter.span = Peek().span;
    parameter.name = TextOf(Take());
    member->parameters.push_back(std::move(parameter));
  } while (TakeIf(TokenKind::kComma));
  return ExpectClosing(TokenKind::kRightParen, opening);
}

}  // namespace morphbus::dynarole
