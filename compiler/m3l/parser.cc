#include "compiler/m3l/parser.h"

#include <algorithm>

#include "compiler/m3l/parser_internal.h"

namespace morphbus::m3l {
namespace internal {
namespace {

bool IsMemberKeyword(std::string_view word) {
  return word == "point" || word == "link" || word == "axis" || word == "joint";
}

}  // namespace

bool Parser::Accept(std::string_view symbol) {
  if (!Is(symbol)) return false;
  ++at_;
  return true;
}

std::string Parser::Described(size_t i) const {
  if (TokenAt(i).kind == TokenKind::kEnd) return "the end of the file";
  std::string text(Text(i).substr(0, 40));
  // Text in a message stays one line and printable.
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return "'" + text + (Text(i).size() > 40 ? "...'" : "'");
}

source::Span Parser::SpanSince(size_t begin) const {
  const source::Span& first = TokenAt(begin).span;
  return {first.file, first.begin, at_ > begin ? TokenAt(at_ - 1).span.end : first.end};
}

source::Diagnostic& Parser::Error(const source::Span& span, std::string message) {
  ++errors_;
  return diagnostics_.Error(span, std::move(message));
}

void Parser::StopIfTooMany() {
  if (errors_ < kMaxSyntaxErrors || AtEnd()) return;
  Error(Now().span, "too many errors, the rest of the file is not read");
  at_ = tokens_.size() - 1;
}

void Parser::SkipAttribute(size_t begin) {
  int open = 0;
  size_t i = begin;
  for (; !IsKind(i, TokenKind::kEnd) && (i < at_ || !StartsStatement(i)); ++i) {
    const bool opens = IsSymbol(i, "(") || IsSymbol(i, "[");
    const bool closes = IsSymbol(i, ")") || IsSymbol(i, "]");
    if (i >= at_ && open <= 0 && (closes || IsSymbol(i, ","))) break;
    open += opens ? 1 : closes ? -1 : 0;
  }
  at_ = i;
}

void Parser::SkipGroup() {
  int open = 0;
  for (; !AtEnd() && !StartsStatement(at_); ++at_) {
    open += Is("(") ? 1 : Is(")") ? -1 : 0;
    if (open == 0) break;
  }
  Accept(")");
}

void Parser::SkipToStatement() {
  while (!AtEnd() && !StartsStatement(at_)) ++at_;
}

FileAst Parser::ParseFile() {
  FileAst file;
  while (!AtEnd()) {
    if (!StartsStatement(at_)) {
      const Name word = NameAt(at_);
      source::Diagnostic& d = Error(
          word.span, "expected a module, connection, robot or import, found " + Described(at_));
      const std::string near =
          source::NearestName(word.text, {Keywords().begin(), Keywords().end()});
      if (!near.empty()) d.hint = "did you mean '" + near + "'?";
      ++at_;
      SkipToStatement();
    } else {
      ParseStatement(file);
    }
    StopIfTooMany();
  }
  return file;
}

std::string Parser::TakeKeyword() {
  const Name word = NameAt(at_++);
  if (IsKeyword(word.text)) return word.text;
  source::Diagnostic& d = Error(word.span, "unknown statement '" + word.text + "'");
  std::string near = source::NearestName(word.text, {Keywords().begin(), Keywords().end()});
  d.hint = near.empty()
               ? "statements are module, point, link, axis, joint, connection, robot, import"
               : "did you mean '" + near + "'?";
  return near;
}

void Parser::ParseStatement(FileAst& file) {
  const source::Span at = Now().span;
  const std::string keyword = TakeKeyword();
  if (keyword.empty()) {
    SkipToStatement();
  } else if (keyword == "import") {
    ParseImport(file);
  } else if (keyword == "connection") {
    ParseHeader(file.connections.emplace_back());
    ParseBody(file.connections.back(), {}, false);
  } else if (keyword == "robot") {
    ParseHeader(file.robots.emplace_back());
    ParseBody(file.robots.back(), {}, false);
  } else if (keyword == "module") {
    ModuleDecl& module = file.modules.emplace_back();
    ParseHeader(module);
    ParseBody(module, {}, false);
    while (!AtEnd() && StartsStatement(at_)) {
      const std::string word(Text(at_));
      const std::string near = source::NearestName(word, {Keywords().begin(), Keywords().end()});
      if (!IsMemberKeyword(IsKeyword(word) ? word : near)) break;
      ParseMember(TakeKeyword(), module);
      StopIfTooMany();
    }
    stray_ = false;
    return;
  } else {
    if (!stray_) {
      Error(at, "'" + keyword + "' stands outside of a module").hint =
          "members follow the line 'module NAME:' of their module";
    }
    ModuleDecl dropped;
    ParseMember(keyword, dropped);
    stray_ = true;
    return;
  }
  stray_ = false;
}

void Parser::ParseImport(FileAst& file) {
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

void Parser::ParseMember(const std::string& keyword, ModuleDecl& module) {
  if (keyword == "point") {
    PointDecl& point = module.points.emplace_back();
    ParseHeader(point);
    ParseBody(point, {&point.subpoints, 1}, false);
  } else if (keyword == "link") {
    LinkDecl& link = module.links.emplace_back();
    ParseHeader(link);
    ParseBody(link, {&link.points, 2}, false);
  } else if (keyword == "axis") {
    ParseHeader(module.axes.emplace_back());
    ParseBody(module.axes.back(), {}, false);
  } else {
    ParseHeader(module.joints.emplace_back());
    ParseBody(module.joints.back(), {}, false);
  }
}

void Parser::ParseHeader(Declaration& declaration) {
  if (Now().kind == TokenKind::kWord) {
    declaration.name = NameAt(at_);
    if (IsKeyword(declaration.name.text) || IsOperatorWord(declaration.name.text)) {
      Error(Now().span, "'" + declaration.name.text + "' is a keyword and cannot be a name");
    }
    ++at_;
  } else {
    Error(Now().span, "expected a name, found " + Described(at_));
    declaration.name.span = Now().span;
    declaration.broken = true;
  }
  if (Accept(":") || declaration.broken) return;
  Error(Now().span, "expected ':' after '" + declaration.name.text + "', found " + Described(at_));
}

void Parser::ParseBody(Declaration& declaration, PointSlot slot, bool nested) {
  bool comma = true;   // Whether an attribute may follow.
  bool muted = false;  // Whether what is odd follows from an error that was reported.
  while (!AtEnd() && !StartsStatement(at_) && !(nested && Is(")"))) {
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
      muted = declaration.attributes.back().broken || (muted && flag);
      comma = false;
    } else {
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
    if (axes_ > 0 && declaration.broken) return;
  }
}

void Parser::ParseAttribute(Declaration& declaration) {
  const size_t begin = at_;
  Attribute attribute;
  attribute.key = NameAt(at_++);
  if (Accept("=")) {
    brackets_ = 0;
    attribute.value = ParseOr();
    attribute.broken = !attribute.value.has_value();
  } else if (!AtEnd() && !Is(",") && !Is(")") && !Is("(") && !StartsStatement(at_) &&
             !IsKind(at_, TokenKind::kWord)) {
    source::Diagnostic& d = Error(
        Now().span, "expected '=' after '" + attribute.key.text + "', found " + Described(at_));
    if (Is("==")) d.hint = "an attribute is set with '='; '==' compares, in conditions";
    attribute.broken = true;
  }
  if (attribute.broken) {
    declaration.broken = true;
    if (axes_ == 0) SkipAttribute(begin);
  }
  declaration.attributes.push_back(std::move(attribute));
}

void Parser::ParseSubpoint(Declaration& owner, PointSlot slot) {
  const size_t open = at_;
  const std::string keyword(Text(at_ + 1));
  if (slot.levels == 0 || keyword != "point") {
    Error(TokenAt(at_ + 1).span, "a '" + keyword + "' cannot stand here").hint =
        "only points and links have points of their own, written (point NAME: coords=(x,y,z))";
    owner.broken = true;
    SkipGroup();
    return;
  }
  at_ += 2;
  PointDecl& point = slot.points->emplace_back();
  ParseHeader(point);
  ParseBody(point, {&point.subpoints, slot.levels - 1}, true);
  if (Accept(")")) return;
  Error(TokenAt(open).span, "'(' is never closed");
  point.broken = owner.broken = true;
}

}  // namespace internal

FileAst Parse(const std::vector<Token>& tokens, source::Diagnostics& diagnostics) {
  return internal::Parser(tokens, diagnostics).ParseFile();
}

}  // namespace morphbus::m3l
