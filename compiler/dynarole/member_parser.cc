#include "compiler/dynarole/member_parser.h"

#include <string>
#include <utility>

#include "vm/limits.h"

namespace morphbus::dynarole {

namespace {

using source::Span;

constexpr ArrayRoom kFieldRoom = {"field", "role", vm::kMaxFields};

/// How long the one value may be that all elements of an array have, in characters of the text.
constexpr size_t kMostOfSharedValue = 1000;

}  // namespace

std::optional<MemberKind> MemberOf(TokenKind word) {
  if (!IsMemberWord(word)) return std::nullopt;
  constexpr int kFirst = static_cast<int>(TokenKind::kLabel);
  static_assert(static_cast<int>(TokenKind::kFunction) - kFirst ==
                static_cast<int>(MemberKind::kFunction) - static_cast<int>(MemberKind::kLabel));
  return static_cast<MemberKind>(static_cast<int>(word) - kFirst +
                                 static_cast<int>(MemberKind::kLabel));
}

// Goes on behind the member: after its ';' or its block, or before something that begins another.
void MemberParser::Skip() {
  // Braces are counted, so that a body that was not understood is skipped as a whole.
  int depth = 0;
  while (!in_.Is(TokenKind::kEnd)) {
    if (depth == 0 && (in_.Is(TokenKind::kRightBrace) || in_.AtMember())) return;
    if (depth > 0 && (in_.Is(TokenKind::kRole) || in_.Is(TokenKind::kAbstract))) return;
    const TokenKind kind = in_.Take().kind;
    if (kind == TokenKind::kSemicolon && depth == 0) return;
    if (kind == TokenKind::kLeftBrace) ++depth;
    if (kind == TokenKind::kRightBrace && --depth == 0) return;
  }
}

// `lable x = ...` and `comand f() {`: a name where a word was meant.
bool MemberParser::MendMisspelledWord(TokenKind* kind) {
  if (!in_.Is(TokenKind::kName) || in_.Peek(1).kind != TokenKind::kName ||
      in_.StartsLine(in_.Peek(1))) {
    return false;
  }
  // Two names in one line begin no field, so the first was meant as a word.
  const std::string text = in_.TextOf(in_.Peek());
  const std::string near =
      source::NearestName(text, {"label", "require", "startup", "behavior", "command", "handler",
                                 "function", "kept", "trace"});
  const std::string unknown = "unknown kind of member '" + text + "'";
  if (near.empty()) {
    in_.ErrorAt(in_.Peek().span, unknown,
                "a member is a field, label, require, startup, behavior, command, handler or "
                "function");
    return false;
  }
  // These two are words only before a name, and begin no member that could be read on here.
  if (near == "kept" || near == "trace") {
    in_.ErrorAt(in_.Peek().span, unknown, "did you mean '" + near + "'?");
    return false;
  }
  in_.AddError(in_.Peek().span, unknown).hint = "did you mean '" + near + "'?";
  *kind = TokenKind::kLabel;
  while (Describe(*kind) != "'" + near + "'")
    *kind = static_cast<TokenKind>(static_cast<int>(*kind) + 1);
  return true;
}

void MemberParser::Parse(Role* role) {
  if (AtWord("trace")) return ParseTrace(role);
  if (in_.TextOf(in_.Peek()) == "import" && in_.Peek(1).kind == TokenKind::kText) {
    in_.ErrorAt(in_.Peek().span, "an import stands outside all roles");
    return;
  }
  // A member begins with its word, a field with its name.
  Member member;
  member.span = in_.Peek().span;
  TokenKind kind = in_.Peek().kind;
  if (!AtWord("kept") && MendMisspelledWord(&kind)) in_.Take();
  if (in_.failed()) return;
  // A word, or the one that was meant, decides the kind; without one it is a field.
  if (const std::optional<MemberKind> word = MemberOf(kind)) {
    if (kind == in_.Peek().kind) in_.Take();
    member.kind = *word;
  } else if (in_.Is(TokenKind::kShared) || AtWord("kept")) {
    // In any order.
    while (in_.Is(TokenKind::kShared) || AtWord("kept")) {
      (in_.Is(TokenKind::kShared) ? member.shared : member.kept) = true;
      in_.Take();
    }
  } else if (!in_.Is(TokenKind::kName)) {
    in_.Unexpected("a member of '" + role->name + "' or '}'");
    // Never stand still.
    if (!in_.AtMember()) in_.Take();
    return;
  }
  // A requirement is an expression and has no name.
  if (member.kind == MemberKind::kRequire) {
    member.name_span = member.span;
    member.expr = expressions_.Parse();
    in_.ExpectSemicolon("the requirement");
  } else {
    if (!in_.Is(TokenKind::kName)) {
      in_.Unexpected("the name of the " + NameOf(member.kind));
      return;
    }
    // Behind the name: the value of a field or label, or parameters and a block.
    member.name_span = in_.Peek().span;
    member.name = in_.TextOf(in_.Take());
    if (member.kind == MemberKind::kField || member.kind == MemberKind::kLabel) {
      ParseField(&member);
      const bool array =
          member.length > 0 || (member.expr != nullptr && member.expr->kind == ExprKind::kArray);
      member.span = in_.SpanFrom(member.span);
      if (array && member.kind == MemberKind::kField) return AddElements(&member, role);
    } else if (!ParseRoutine(&member)) {
      return;
    }
  }
  member.span = in_.SpanFrom(member.span);
  role->members.push_back(std::move(member));
}

// `NAME;`, `NAME = value;` and `label NAME = value;`
void MemberParser::ParseField(Member* member) {
  if (member->kind == MemberKind::kLabel && !in_.Is(TokenKind::kAssign)) {
    in_.Unexpected("'=' and what the label '" + member->name + "' names",
                   "for example: label " + member->name + " = self.joints($ANY, 1);");
    return;
  }
  // A field cannot have parameters; a word was left out before a routine.
  if (in_.Is(TokenKind::kLeftParen)) {
    in_.Unexpected("';' or '=' after the field '" + member->name + "'",
                   "for code, write startup, behavior, command, handler or function before '" +
                       member->name + "'");
    return;
  }
  // `history[8] = 0.0;` has as many elements as stand in the brackets.
  if (member->kind == MemberKind::kField && in_.Is(TokenKind::kLeftBracket)) {
    member->length = expressions_.ParseLength(kFieldRoom);
    if (in_.failed()) return;
  }
  if (in_.TakeIf(TokenKind::kAssign)) member->expr = expressions_.Parse();
  in_.ExpectSemicolon("the " + NameOf(member->kind) + " '" + member->name + "'");
}

bool MemberParser::AtWord(const char* word) const {
  // `kept = 1;` is a field of that name, and `kept x;` or `kept shared x;` are not.
  const bool named = in_.Peek(1).kind == TokenKind::kName || in_.Peek(1).kind == TokenKind::kShared;
  return in_.Is(TokenKind::kName) && in_.TextOf(in_.Peek()) == word && named;
}

void MemberParser::ParseTrace(Role* role) {
  in_.Take();
  if (!in_.Is(TokenKind::kName)) {
    in_.Unexpected("the name of a field");
    return;
  }
  Trace trace;
  trace.span = trace.name_span = in_.Peek().span;
  trace.name = in_.TextOf(in_.Take());
  // An element of an array is a field of its own.
  if (in_.TakeIf(TokenKind::kLeftBracket)) {
    if (!in_.Is(TokenKind::kInt)) {
      in_.Unexpected("the number of an element");
      return;
    }
    trace.name += "[" + in_.TextOf(in_.Take()) + "]";
    if (!in_.Expect(TokenKind::kRightBracket, "behind the number of the element")) return;
    trace.span = in_.SpanFrom(trace.span);
  }
  role->traces.push_back(std::move(trace));
  in_.ExpectSemicolon("the name of the field");
}

void MemberParser::AddElements(Member* array, Role* role) {
  if (in_.failed()) return;
  // Values in brackets say how many there are; of one value for all the number behind the name
  // does.
  const bool listed = array->expr != nullptr && array->expr->kind == ExprKind::kArray;
  const size_t values = listed ? array->expr->operands.size() : 0;
  if (listed && array->length > 0 && values != static_cast<size_t>(array->length)) {
    in_.ErrorAt(array->expr->span,
                "'" + array->name + "' has " + std::to_string(array->length) +
                    " elements, but these are " + std::to_string(values),
                "without a number behind its name it has as many as there are values");
    return;
  }
  // The other length was looked at where its number was read.
  if (listed &&
      !expressions_.HasRoom(std::ssize(array->expr->operands), array->expr->span, kFieldRoom)) {
    return;
  }
  // All shared fields of a role travel in one message, which has no room for arrays.
  if (array->shared) {
    in_.ErrorAt(array->name_span, "an array cannot be shared",
                "share single fields, at most " + std::to_string(vm::kMaxSharedFields));
    return;
  }
  const int length = listed ? static_cast<int>(values) : array->length;
  if (role->members.size() + static_cast<size_t>(length) > kMaxMembers) {
    in_.GiveUp(array->name_span, "role '" + role->name + "' has too many members",
               "at most " + std::to_string(kMaxMembers) + "; each element of an array is one");
    return;
  }
  // Each element has a copy of the one value, of which a long text would make a heavy tree.
  if (!listed && array->expr != nullptr &&
      array->expr->span.end - array->expr->span.begin > kMostOfSharedValue) {
    in_.ErrorAt(array->expr->span,
                "the value of all elements has more than " + std::to_string(kMostOfSharedValue) +
                    " characters",
                "declare a constant with this value and write its name here");
    return;
  }
  // From here on each element is a field, `history[3]`, that knows of which array it is.
  for (int i = 0; i < length; ++i) {
    Member element;
    element.span = array->span;
    element.name_span = array->name_span;
    element.array = array->name;
    element.name = array->name + "[" + std::to_string(i) + "]";
    element.element = i;
    element.kept = array->kept;
    element.length = length;
    // What one value is for all is so for each.
    if (array->expr != nullptr) {
      element.expr = CopyOf(listed ? *array->expr->operands[static_cast<size_t>(i)] : *array->expr);
    }
    role->members.push_back(std::move(element));
  }
}

// `NAME(parameters) { statements }` behind the word of its kind.
bool MemberParser::ParseRoutine(Member* member) {
  const std::string what = NameOf(member->kind) + " '" + member->name + "'";
  if (!in_.Is(TokenKind::kLeftParen)) {
    in_.Unexpected("'(' after the " + what, "without parameters write " + member->name + "()");
    return false;
  }
  if (!ParseParameters(member)) return false;
  if (member->kind == MemberKind::kHandler) ParseHandlerWords(member);
  if (in_.failed()) return false;
  if (!in_.Is(TokenKind::kLeftBrace)) {
    in_.Unexpected("'{' and the body of the " + what);
    return false;
  }
  // What is wrong in the block has been reported there, and the member is one all the same.
  member->body = statements_.ParseBlock();
  return true;
}

// `every PERIOD` and `early`. They are words in this place only, so that programs may use them as
// names.
void MemberParser::ParseHandlerWords(Member* member) {
  while (in_.Is(TokenKind::kName) && !in_.failed()) {
    const std::string word = in_.TextOf(in_.Peek());
    if (word == "early" && !member->early) {
      in_.Take();
      member->early = true;
    } else if (word == "every" && member->period == nullptr) {
      in_.Take();
      member->period = expressions_.Parse();
    } else {
      in_.Unexpected(
          "'every', 'early' or the body of the handler '" + member->name + "'",
          source::NearestHint(word, {"every", "early"},
                              "for example: handler " + member->name + "() every 0.5 {"));
    }
  }
}

bool MemberParser::ParseParameters(Member* member) {
  const Span opening = in_.Take().span;
  if (in_.TakeIf(TokenKind::kRightParen)) return true;
  do {
    // `name` or `type name`.
    Parameter parameter;
    if (!in_.Is(TokenKind::kName) && !in_.Is(TokenKind::kRole)) {
      in_.Unexpected("the name of a parameter");
      return false;
    }
    // `float speed`: a type may stand before the name; `role` is a word of its own.
    if (in_.Peek(1).kind == TokenKind::kName) {
      const std::string text = in_.TextOf(in_.Peek());
      const std::optional<Type> type = TypeFromName(text);
      if (!type) {
        in_.ErrorAt(
            in_.Peek().span, "unknown type '" + text + "'",
            source::NearestHint(
                text,
                {"bool", "int", "float", "direction", "axis", "role", "joint", "link", "connector"},
                "parameters are bool, int, float, direction, axis, role, joint, link or connector, "
                "or stand without a type"));
        return false;
      }
      parameter.type = *type;
      in_.Take();
    }
    if (!in_.Is(TokenKind::kName)) {
      in_.Unexpected("the name of a parameter");
      return false;
    }
    parameter.span = in_.Peek().span;
    parameter.name = in_.TextOf(in_.Take());
    member->parameters.push_back(std::move(parameter));
  } while (in_.TakeIf(TokenKind::kComma));
  return in_.ExpectClosing(TokenKind::kRightParen, opening);
}

}  // namespace morphbus::dynarole
