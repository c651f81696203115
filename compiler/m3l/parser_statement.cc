// Definitions, members and their attributes: everything of the grammar that is no expression.

#include "compiler/m3l/parser.h"

namespace morphbus::m3l::internal {
namespace {

// Members belong to the module above them; all other statements stand for themselves.
bool IsMemberKeyword(std::string_view word) {
  return word == "point" || word == "link" || word == "axis" || word == "joint" || word == "sensor";
}

}  // namespace

std::string Parser::TakeKeyword() {
  // StartsStatement takes a misspelt keyword for a statement; it is mended here, so that its
  // members are parsed.
  const Name word = NameAt(at_++);
  if (IsKeyword(word.text)) return word.text;
  source::Diagnostic& d = Error(word.span, "unknown statement '" + word.text + "'");
  std::string near = source::NearestName(word.text, {Keywords().begin(), Keywords().end()});
  d.hint = near.empty() ? "statements are module, point, link, axis, joint, sensor, connection, "
                          "robot, const, import"
                        : "did you mean '" + near + "'?";
  return near;
}

void Parser::ParseStatement(FileAst& file) {
  const source::Span at = Now().span;
  const std::string keyword = TakeKeyword();
  if (keyword.empty()) {
    // A word that resembles no keyword says nothing about what follows, so that is skipped.
    SkipToStatement();
  } else if (keyword == "import") {
    ParseImport(file);
  } else if (keyword == "const") {
    ParseConstant(file);
  } else if (keyword == "connection") {
    // Connections and robots have attributes only.
    ParseHeader(file.connections.emplace_back());
    ParseBody(file.connections.back(), {}, false);
  } else if (keyword == "robot") {
    ParseHeader(file.robots.emplace_back());
    ParseBody(file.robots.back(), {}, false);
  } else if (keyword == "module") {
    // Members follow until a statement that is none; a misspelt keyword counts as what it
    // resembles.
    ModuleDecl& module = file.modules.emplace_back();
    ParseHeader(module);
    ParseBody(module, {}, false);
    while (!AtEnd() && StartsStatement(at_)) {
      const std::string word(Text(at_));
      const std::string near = source::NearestName(word, {Keywords().begin(), Keywords().end()});
      // A constant may stand between members too; it belongs to no module.
      if (word == "const") {
        ++at_;
        ParseConstant(file);
        continue;
      }
      if (!IsMemberKeyword(IsKeyword(word) ? word : near)) break;
      ParseMember(TakeKeyword(), module);
      StopIfTooMany();
    }
    stray_ = false;
    return;
  } else {
    // A run of members without a module is parsed, so that it is skipped, but reported once.
    if (!stray_) {
      Error(at, "'" + keyword + "' stands outside of a module").hint =
          "members follow the line 'module NAME:' of their module";
    }
    ModuleDecl dropped;
    ParseMember(keyword, dropped);
    stray_ = true;
    return;
  }
  // Any statement but a member ends a run of members without a module.
  stray_ = false;
}

void Parser::ParseImport(FileAst& file) {
  // An import is a whole statement; whatever follows on it is skipped.
  if (Now().kind == TokenKind::kString) {
    file.imports.push_back({StringValue(Text(at_)), Now().span});
    ++at_;
    if (AtEnd() || StartsStatement(at_)) return;
    Error(Now().span, "expected the next statement after an import, found " + Described(at_));
  } else {
    Error(Now().span, "expected a file name, found " + Described(at_)).hint =
        "write it as in: import \"module.m3l\"";
  }
  SkipToStatement();
}

void Parser::ParseConstant(FileAst& file) {
  // StartsStatement has seen the name and the sign of equality.
  ConstDecl& constant = file.constants.emplace_back();
  constant.name = NameAt(at_++);
  if (IsKeyword(constant.name.text) || IsOperatorWord(constant.name.text)) {
    Error(constant.name.span, "'" + constant.name.text + "' is a keyword and cannot be a name");
  }
  Accept("=");
  brackets_ = 0;
  constant.value = ParseOr();
  // What follows the value is reported once, unless the value itself did not parse.
  if (AtEnd() || StartsStatement(at_)) return;
  if (constant.value) {
    Error(Now().span, "expected the next statement after a constant, found " + Described(at_));
  }
  SkipToStatement();
}

void Parser::ParseMember(const std::string& keyword, ModuleDecl& module) {
  if (keyword == "point") {
    // A point may have sub-points, one level deep.
    PointDecl& point = module.points.emplace_back();
    ParseHeader(point);
    ParseBody(point, {&point.subpoints, 1}, false);
  } else if (keyword == "link") {
    LinkDecl& link = module.links.emplace_back();
    // A link may have points, and these sub-points: two levels.
    ParseHeader(link);
    ParseBody(link, {&link.points, 2}, false);
  } else if (keyword == "axis") {
    // Axes, joints and sensors have attributes only.
    ParseHeader(module.axes.emplace_back());
    ParseBody(module.axes.back(), {}, false);
  } else if (keyword == "sensor") {
    ParseHeader(module.sensors.emplace_back());
    ParseBody(module.sensors.back(), {}, false);
  } else {
    ParseHeader(module.joints.emplace_back());
    ParseBody(module.joints.back(), {}, false);
  }
}

void Parser::ParseHeader(Declaration& declaration) {
  // The name is a word; anything else leaves the declaration nameless and broken.
  if (Now().kind == TokenKind::kWord) {
    declaration.name = NameAt(at_);
    // A keyword as a name is taken, so that the rest of the statement is still found.
    if (IsKeyword(declaration.name.text) || IsOperatorWord(declaration.name.text)) {
      Error(Now().span, "'" + declaration.name.text + "' is a keyword and cannot be a name");
    }
    ++at_;
  } else {
    Error(Now().span, "expected a name, found " + Described(at_));
    declaration.name.span = Now().span;
    declaration.broken = true;
  }
  // The colon may be missing without harm, but not without an error.
  if (Accept(":") || declaration.broken) return;
  Error(Now().span, "expected ':' after '" + declaration.name.text + "', found " + Described(at_));
}

void Parser::ParseBody(Declaration& declaration, PointSlot slot, bool nested) {
  bool comma = true;   // Whether an attribute may follow.
  bool muted = false;  // Whether what is odd follows from an error that was reported.
  // The loop ends where the declaration does: at a statement, the end, or the bracket that closes
  // it.
  while (!AtEnd() && !StartsStatement(at_) && !(nested && Is(")"))) {
    // Where that bracket is missing, it was meant before a point that cannot stand here, and before
    // an attribute behind no comma.
    const bool point = Is("(") && IsWord(at_ + 1, "point");
    const bool attribute = IsKind(at_, TokenKind::kWord) && !comma;
    if (!slot.closed && ((point && slot.levels == 0) || attribute)) return;
    // A part is a sub-point, a comma, an attribute, or something that cannot stand here.
    if (Is("(") && IsKeyword(Text(at_ + 1))) {
      ParseSubpoint(declaration, slot);
      comma = true;  // No comma is needed after a sub-point.
    } else if (Is(",")) {
      if (comma && !muted && !declaration.attributes.empty()) {
        Error(Now().span, "expected an attribute, found ','");
      }
      comma = true;
      ++at_;
    } else if (IsKind(at_, TokenKind::kWord)) {
      if (!comma && !muted) Error(Now().span, "expected ',' before " + Described(at_));
      const bool flag = !IsSymbol(at_ + 1, "=");
      ParseAttribute(declaration);
      // After an error, a word that looks like a flag may be a rest of what did not parse.
      muted = declaration.attributes.back().broken || (muted && flag);
      comma = false;
    } else {
      // Something that begins no attribute: an unmatched bracket is skipped alone, anything else up
      // to the next comma.
      const bool closer = Is(")") || Is("]");
      if (!muted) {
        Error(Now().span, closer ? "unmatched " + Described(at_)
                                 : "expected an attribute, found " + Described(at_));
      }
      declaration.broken = muted = true;
      if (closer) {
        ++at_;
      } else if (axes_ == 0) {
        SkipAttribute(at_);
      }
    }
    StopIfTooMany();
    // The attribute around an anonymous axis skips what is left of it.
    if (axes_ > 0 && declaration.broken) return;
  }
}

void Parser::ParseAttribute(Declaration& declaration) {
  // What follows the key says whether it is a flag or has a value.
  const size_t begin = at_;
  Attribute attribute;
  attribute.key = NameAt(at_++);
  if (Accept("=")) {
    // Brackets are counted for each value on its own.
    brackets_ = 0;
    attribute.value = ParseOr();
    attribute.broken = !attribute.value.has_value();
  } else if (!AtEnd() && !Is(",") && !Is(")") && !Is("(") && !StartsStatement(at_) &&
             !IsKind(at_, TokenKind::kWord)) {
    // A value without '=' before it, or a comparison in place of an assignment.
    source::Diagnostic& d = Error(
        Now().span, "expected '=' after '" + attribute.key.text + "', found " + Described(at_));
    if (Is("==")) d.hint = "an attribute is set with '='; '==' compares, in conditions";
    attribute.broken = true;
  }
  if (attribute.broken) {
    declaration.broken = true;
    if (axes_ == 0) SkipAttribute(begin);
  }
  // A broken attribute stays in the tree, so that it is not said to be missing.
  declaration.attributes.push_back(std::move(attribute));
}

void Parser::ParseSubpoint(Declaration& owner, PointSlot slot) {
  const size_t open = at_;
  const std::string keyword(Text(at_ + 1));
  // Only points nest, and only so deep as the declaration allows.
  if (slot.levels == 0 || keyword != "point") {
    Error(TokenAt(at_ + 1).span, "a '" + keyword + "' cannot stand here").hint =
        "only points and links have points of their own, written (point NAME: coords=(x,y,z))";
    owner.broken = true;
    SkipGroup();
    return;
  }
  at_ += 2;
  // The sub-point is parsed like any other declaration, up to its closing parenthesis.
  PointDecl& point = slot.points->emplace_back();
  ParseHeader(point);
  const bool closed = IsSymbol(EndOfGroup(open), ")");
  ParseBody(point, {&point.subpoints, slot.levels - 1, closed}, true);
  // The parenthesis that is missing is better shown where it was opened.
  if (Accept(")")) return;
  Error(TokenAt(open).span, "'(' is never closed");
  point.broken = owner.broken = true;
}

}  // namespace morphbus::m3l::internal
