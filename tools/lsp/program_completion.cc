// Completion and signatures in DynaRole programs.

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/lexer.h"
#include "tools/lsp/completion.h"
#include "tools/lsp/program_words.h"

namespace morphbus::tools {
namespace {

using dynarole::Builtin;
using source::NamedThing;
using source::NameKind;

/// The tokens of a program before a place, and what they say of it.
class ProgramContext {
 public:
  ProgramContext(const source::SourceSet& sources, size_t offset)
      : text_(sources.text(0)), offset_(offset) {
    source::Diagnostics unsaid;
    tokens_ = dynarole::Tokenize(sources, 0, &unsaid);
    // The word that is being typed is none of what stands before; a sign is.
    while (count_ < tokens_.size() && tokens_[count_].kind != dynarole::TokenKind::kEnd &&
           (tokens_[count_].span.end < offset ||
            (tokens_[count_].span.end == offset && !IsWord(count_)))) {
      ++count_;
    }
    for (size_t i = 0; i < count_; ++i) Follow(i);
  }

  [[nodiscard]] size_t offset() const { return offset_; }
  [[nodiscard]] std::string Before(size_t back = 1) const {
    return back <= count_ ? TextOf(count_ - back) : std::string();
  }
  [[nodiscard]] bool WordBefore(size_t back) const {
    return back <= count_ && IsWord(count_ - back);
  }
  /// The word that is being typed; empty if none is.
  [[nodiscard]] std::string Typed() const {
    if (count_ >= tokens_.size() || tokens_[count_].span.begin >= offset_) return "";
    return std::string(
        text_.substr(tokens_[count_].span.begin, offset_ - tokens_[count_].span.begin));
  }
  /// Whether the place is within a text in quotes.
  [[nodiscard]] bool InText() const {
    return count_ < tokens_.size() && tokens_[count_].kind == dynarole::TokenKind::kText &&
           tokens_[count_].span.begin < offset_ && offset_ < tokens_[count_].span.end;
  }
  /// The role around the place, "" outside of all, and the member of it.
  [[nodiscard]] const std::string& role() const { return role_; }
  [[nodiscard]] const std::string& member() const { return member_; }
  /// 0 outside of roles, 1 between members, more within one.
  [[nodiscard]] int braces() const { return braces_; }
  /// Whether the place is within the code of a member, or of a function outside roles.
  [[nodiscard]] bool InBody() const {
    return braces_ > 1 || (braces_ == 1 && role_.empty() && !member_.empty());
  }
  /// Whether a statement or a member begins at the place.
  [[nodiscard]] bool AtBeginning() const {
    const std::string before = Before();
    return before.empty() || before == "{" || before == "}" || before == ";";
  }
  /// Whether the place is in the value of a member, between members of a role.
  [[nodiscard]] bool InValue() const { return !AtBeginning(); }
  /// The words behind `$` in the head of the loop over neighbours around the place whose variable
  /// has this name: its role is one of them.
  [[nodiscard]] std::vector<std::string> DollarsOfLoop(const std::string& variable) const {
    std::vector<std::string> words;
    for (size_t in = count_; in-- > 3;) {
      const bool head = TextOf(in) == "in" && TextOf(in - 1) == variable && TextOf(in - 2) == "(" &&
                        TextOf(in - 3) == "for";
      if (!head) continue;
      for (size_t i = in + 1; i < count_ && TextOf(i) != "{" && TextOf(i) != ";"; ++i) {
        if (TextOf(i).starts_with("$")) words.push_back(TextOf(i).substr(1));
      }
      break;
    }
    return words;
  }
  /// What stands before the innermost parenthesis that is open, and the commas in it.
  struct Call {
    std::string name;
    /// What stands before the dot before it, "self", a role, a joint; empty without a dot.
    std::string base;
    int commas = 0;
  };
  [[nodiscard]] const Call* call() const { return calls_.empty() ? nullptr : &calls_.back(); }

 private:
  [[nodiscard]] std::string TextOf(size_t i) const {
    const source::Span& span = tokens_[i].span;
    return std::string(text_.substr(span.begin, span.end - span.begin));
  }
  [[nodiscard]] bool IsWord(size_t i) const {
    const std::string text = TextOf(i);
    return !text.empty() && (std::isalnum(static_cast<unsigned char>(text[0])) || text[0] == '_' ||
                             text[0] == '$' || text[0] == '"');
  }

  /// Goes on by one token: which role, member and call is open.
  void Follow(size_t i) {
    const dynarole::TokenKind kind = tokens_[i].kind;
    if (kind == dynarole::TokenKind::kRole && i + 1 < count_ && braces_ == 0) role_ = TextOf(i + 1);
    // Functions stand outside roles, too.
    const bool begins = braces_ == 1 ? dynarole::IsMemberWord(kind)
                                     : braces_ == 0 && kind == dynarole::TokenKind::kFunction;
    if (begins && !InBody() && i + 1 < count_) member_ = TextOf(i + 1);
    if (kind == dynarole::TokenKind::kLeftBrace) ++braces_;
    if (kind == dynarole::TokenKind::kRightBrace && --braces_ <= 0) {
      braces_ = 0;
      role_.clear();
    }
    if (braces_ <= 1 && kind == dynarole::TokenKind::kRightBrace) member_.clear();
    if (kind == dynarole::TokenKind::kLeftParen) {
      Call call;
      if (i > 0 && IsWord(i - 1)) call.name = TextOf(i - 1);
      if (i > 2 && tokens_[i - 2].kind == dynarole::TokenKind::kDot) call.base = TextOf(i - 3);
      calls_.push_back(call);
    } else if (kind == dynarole::TokenKind::kRightParen && !calls_.empty()) {
      calls_.pop_back();
    } else if (kind == dynarole::TokenKind::kComma && !calls_.empty()) {
      ++calls_.back().commas;
    } else if (kind == dynarole::TokenKind::kSemicolon || kind == dynarole::TokenKind::kLeftBrace) {
      // A parenthesis that is never closed ends with its statement.
      calls_.clear();
    }
  }

  std::string_view text_;
  size_t offset_;
  std::vector<dynarole::Token> tokens_;
  size_t count_ = 0;
  int braces_ = 0;
  std::string role_, member_;
  std::vector<Call> calls_;
};

/// The arguments of a form, as its usage names them: "self.joints(axis, n)" has "axis" and "n".
std::vector<std::string> ArgumentsOf(std::string_view usage) {
  std::vector<std::string> arguments;
  const size_t open = usage.find('('), close = usage.rfind(')');
  if (open == std::string_view::npos || close <= open + 1) return arguments;
  for (size_t begin = open + 1; begin < close;) {
    const size_t end = std::min(usage.find(',', begin), close);
    arguments.emplace_back(usage.substr(begin, end - begin));
    begin = end + 1;
    while (begin < close && usage[begin] == ' ') ++begin;
  }
  return arguments;
}

/// The snippet of a call: "joints(${1:axis}, ${2:n})".
std::string CallSnippet(const std::string& name, const std::vector<std::string>& arguments) {
  std::string snippet = name + "(";
  for (size_t i = 0; i < arguments.size(); ++i) {
    // A sign that the editor would take for a place of its own is escaped.
    std::string argument = arguments[i];
    if (argument.starts_with("$")) argument = "\\" + argument;
    snippet += fmt::format("{}${{{}:{}}}", i > 0 ? ", " : "", i + 1, argument);
  }
  return snippet + ")";
}

/// Offers what may stand at a place.
class ProgramCompleter {
 public:
  ProgramCompleter(const ProgramFile& program, const ProgramContext& at)
      : program_(program), names_(program.names), at_(at) {
    // A function outside roles knows what all of them have.
    role_ = RoleNamed(at.role().empty() && at.InBody() ? "Module" : at.role());
  }

  /// What is narrowest decides: a text, a dot or a `$` before the place, then how deep in a role it
  /// is.
  Json Complete() {
    if (at_.InText()) {
      constexpr std::string_view kPrograms[] = {".dyn"};
      if (at_.Before() == "import") {
        items_.AddFiles(program_.path, at_.Typed().substr(1), kPrograms);
      }
      return items_.Take();
    }
    if (at_.Before() == ".") {
      OfferMembers();
    } else if (at_.Typed().starts_with("$")) {
      OfferDollars();
    } else if (at_.Before() == "extends") {
      OfferRoles("");
    } else if (at_.braces() == 0) {
      OfferWords(WordPlace::kProgram);
      if (at_.InValue()) OfferConstants();
    } else if (!at_.InBody() && at_.AtBeginning()) {
      OfferWords(WordPlace::kRole);
      OfferInherited();
    } else {
      if (at_.AtBeginning()) OfferWords(WordPlace::kTask);
      OfferNames();
      OfferWords(WordPlace::kValue);
      OfferDollars();
    }
    return items_.Take();
  }

 private:
  [[nodiscard]] int RoleNamed(const std::string& name) const {
    return name.empty() ? -1 : names_.Find(NameKind::kRole, name);
  }

  /// Words of the grammar, most of which bring what follows them.
  void OfferWords(WordPlace place) {
    for (const ProgramWord& word : ProgramWords()) {
      if (word.place != place) continue;
      items_.Add(std::string(word.word),
                 place == WordPlace::kValue ? ItemKind::kKeyword : ItemKind::kSnippet,
                 std::string(word.meaning), std::string(word.snippet));
    }
  }

  /// Roles, behind a sign such as '$'; with one not Module, which every module plays.
  void OfferRoles(const std::string& sign) {
    for (const NamedThing& thing : names_.things) {
      if (thing.kind != NameKind::kRole) continue;
      if (!sign.empty() && thing.extent.file < 0) continue;
      items_.Add(sign + thing.name, ItemKind::kClass, thing.summary);
    }
  }

  /// What `$` stands before: directions and axes, roles, and links by their keywords.
  void OfferDollars() {
    for (const dynarole::NamedDirection& direction : dynarole::kDirections) {
      const std::string name = std::string("$") + direction.name;
      items_.Add(name, ItemKind::kUnit, std::string(BuiltinMeaning(name)));
    }
    OfferRoles("$");
    for (const keywords::Keyword& keyword : program_.keywords.all()) {
      if (keyword.kind != vm::KeywordKind::kLink) continue;
      items_.Add("$" + keyword.spelling, ItemKind::kValue, "a link of a module");
    }
  }

  void OfferConstants() {
    for (const NamedThing& thing : names_.things) {
      const bool constant = thing.kind == NameKind::kConstant || thing.kind == NameKind::kParameter;
      if (constant && thing.owner < 0) items_.Add(thing.name, ItemKind::kConstant, thing.summary);
    }
  }

  /// What the roles above have that this one may replace.
  void OfferInherited() {
    if (role_ < 0) return;
    for (int role = names_.things[role_].base; role >= 0; role = names_.things[role].base) {
      for (const NamedThing& thing : names_.things) {
        if (thing.owner != role) continue;
        if (thing.kind == NameKind::kField) {
          items_.Add(thing.name, ItemKind::kField, thing.summary, thing.name + " = ${1};");
        }
      }
    }
  }

  /// Names that stand for values, and functions.
  void OfferNames() {
    for (size_t i = 0; i < names_.things.size(); ++i) {
      const NamedThing& thing = names_.things[i];
      // Variables of the member around, declared before the place.
      const bool local = thing.kind == NameKind::kVariable && thing.owner >= 0 &&
                         names_.things[thing.owner].name == at_.member() &&
                         thing.extent.begin < at_.offset();
      if (local) items_.Add(thing.name, ItemKind::kVariable, thing.summary);
    }
    for (int role = role_; role >= 0; role = names_.things[role].base) OfferOfRole(role);
    OfferConstants();
    for (const Builtin& builtin : dynarole::FunctionBuiltins()) OfferForm(builtin);
    for (const Builtin& builtin : dynarole::NeighbourBuiltins()) OfferForm(builtin);
    // Commands are invoked by the name of a role.
    OfferRoles("");
  }

  /// What the members of a role may name of it.
  void OfferOfRole(int role) {
    for (const NamedThing& thing : names_.things) {
      if (thing.owner != role) continue;
      if (thing.kind == NameKind::kField || thing.kind == NameKind::kLabel) {
        items_.Add(thing.name, ItemKind::kField, thing.summary);
      } else if (thing.kind == NameKind::kConstant || thing.kind == NameKind::kParameter) {
        items_.Add(thing.name, ItemKind::kConstant, thing.summary);
      } else if (thing.kind == NameKind::kFunction) {
        items_.Add(thing.name, ItemKind::kFunction, thing.summary,
                   CallSnippet(thing.name, ArgumentsOf(thing.summary)));
      }
    }
  }

  /// A form of the language, with places for its arguments.
  void OfferForm(const Builtin& builtin) {
    const std::vector<std::string> arguments = ArgumentsOf(builtin.usage);
    // A form that may stand without parentheses has a label of its own.
    const std::string label =
        builtin.property
            ? builtin.name
            : std::string(builtin.name) + "(" + fmt::format("{}", fmt::join(arguments, ", ")) + ")";
    items_.Add(label, builtin.property ? ItemKind::kProperty : ItemKind::kMethod,
               std::string(BuiltinMeaning(builtin.name)),
               builtin.property ? "" : CallSnippet(builtin.name, arguments));
  }

  /// Joints, connectors and sensors by the words that the models have for them.
  void OfferKeywords(std::initializer_list<vm::KeywordKind> kinds) {
    for (const keywords::Keyword& keyword : program_.keywords.all()) {
      if (std::find(kinds.begin(), kinds.end(), keyword.kind) == kinds.end()) continue;
      const std::string what = keyword.kind == vm::KeywordKind::kJoint ? "a joint of a module"
                               : keyword.kind == vm::KeywordKind::kConnector
                                   ? "a connector of a module"
                                   : "a sensor of a module";
      items_.Add(keyword.spelling, ItemKind::kValue, what);
    }
  }

  /// What may stand behind a dot.
  void OfferMembers() {
    const std::string base = at_.Before(2);
    if (base == "self") {
      for (const Builtin& builtin : dynarole::SelfBuiltins()) OfferForm(builtin);
      OfferKeywords(
          {vm::KeywordKind::kJoint, vm::KeywordKind::kConnector, vm::KeywordKind::kSensor});
      return;
    }
    if (base == "super") {
      items_.Add(at_.member(), ItemKind::kMethod, "what this member replaces",
                 at_.member().empty() ? "" : at_.member() + "($1);");
      return;
    }
    if (base == ")") return OfferOfNeighbours();
    const int role = RoleNamed(base);
    if (role >= 0) return OfferCommands(role);
    if (names_.Find(NameKind::kEnumeration, base) >= 0) return OfferValues(base);
    for (const std::string& word : at_.DollarsOfLoop(base)) {
      if (const int neighbours = RoleNamed(word); neighbours >= 0) return OfferShared(neighbours);
    }
    OfferOfPart(base);
  }

  /// The values of an enumeration.
  void OfferValues(const std::string& enumeration) {
    for (const NamedThing& thing : names_.things) {
      if (thing.kind != NameKind::kConstant) continue;
      if (!thing.summary.starts_with(enumeration + ".")) continue;
      items_.Add(thing.name, ItemKind::kConstant, thing.summary);
    }
  }

  void OfferCommands(int role) {
    for (; role >= 0; role = names_.things[role].base) {
      for (const NamedThing& thing : names_.things) {
        if (thing.owner != role || thing.kind != NameKind::kCommand) continue;
        items_.Add(thing.name, ItemKind::kMethod, thing.summary,
                   CallSnippet(thing.name, ArgumentsOf(thing.summary)));
      }
    }
  }

  /// self.connected(direction, $Role).: what that role shares, and its commands.
  void OfferOfNeighbours() {
    for (size_t back = 3; back < 8; ++back) {
      const std::string word = at_.Before(back);
      const int role = word.starts_with("$") ? RoleNamed(word.substr(1)) : -1;
      if (role >= 0) return OfferShared(role);
    }
  }

  /// What neighbours with this role share, and their commands.
  void OfferShared(int role) {
    for (int of = role; of >= 0; of = names_.things[of].base) {
      for (const NamedThing& thing : names_.things) {
        const bool shared = thing.owner == of && thing.kind == NameKind::kField &&
                            thing.summary.starts_with("shared ");
        if (shared) items_.Add(thing.name, ItemKind::kField, thing.summary);
      }
    }
    OfferCommands(role);
  }

  /// A joint, connector or sensor of the module, by its keyword, or a label.
  void OfferOfPart(const std::string& base) {
    bool known = false;
    for (const keywords::Keyword& keyword : program_.keywords.all()) {
      if (keyword.spelling != base) continue;
      known = true;
      if (keyword.kind == vm::KeywordKind::kJoint) OfferForms(dynarole::JointBuiltins());
      if (keyword.kind == vm::KeywordKind::kSensor) OfferForms(dynarole::SensorBuiltins());
      if (keyword.kind == vm::KeywordKind::kConnector) {
        OfferForms(dynarole::ConnectorBuiltins());
        OfferStates();
      }
    }
    if (!known) OfferForms(dynarole::JointBuiltins());
  }

  void OfferForms(const std::vector<Builtin>& builtins) {
    for (const Builtin& builtin : builtins) OfferForm(builtin);
  }

  void OfferStates() {
    for (const keywords::Keyword& keyword : program_.keywords.all()) {
      if (keyword.kind != vm::KeywordKind::kConnectorState) continue;
      items_.Add("SET_" + keyword.spelling, ItemKind::kMethod, "sets the connector's state",
                 "SET_" + keyword.spelling + "(${1:true})");
      items_.Add("GET_" + keyword.spelling, ItemKind::kMethod, "the state that was set last",
                 "GET_" + keyword.spelling + "()");
    }
  }

  const ProgramFile& program_;
  const source::NameTable& names_;
  const ProgramContext& at_;
  int role_;
  ItemList items_;
};

/// One signature: its text, the names of its parameters, and what it does.
Json SignatureOf(const std::string& label, const std::string& meaning) {
  Json parameters = Json::array();
  for (const std::string& argument : ArgumentsOf(label))
    parameters.push_back({{"label", argument}});
  Json signature = {{"label", label}, {"parameters", parameters}};
  if (!meaning.empty()) signature["documentation"] = meaning;
  return signature;
}

}  // namespace

Json CompleteProgram(Workspace* workspace, const std::string& path, size_t offset) {
  const ProgramFile& program = workspace->Program(path);
  const ProgramContext at(program.compiled.sources, offset);
  return ProgramCompleter(program, at).Complete();
}

Json ProgramSignature(const ProgramFile& program, size_t offset) {
  const ProgramContext at(program.compiled.sources, offset);
  const ProgramContext::Call* call = at.call();
  if (call == nullptr || call->name.empty() || at.InText()) return nullptr;
  Json signatures = Json::array();
  // What the language offers, every form of it.
  const auto add = [&](const std::vector<Builtin>& table) {
    for (const Builtin& builtin : table) {
      if (call->name != builtin.name || std::string_view(builtin.arguments).empty()) continue;
      signatures.push_back(SignatureOf(builtin.usage, std::string(BuiltinMeaning(builtin.name))));
    }
  };
  if (call->base == "self") add(dynarole::SelfBuiltins());
  if (call->base.empty()) {
    add(dynarole::FunctionBuiltins());
    add(dynarole::NeighbourBuiltins());
  }
  if (!call->base.empty() && call->base != "self") add(dynarole::JointBuiltins());
  // What the program declares: functions, and commands of the role before the dot.
  if (signatures.empty()) {
    for (const NamedThing& thing : program.names.things) {
      const bool callable = thing.kind == NameKind::kFunction || thing.kind == NameKind::kCommand;
      if (callable && thing.name == call->name) {
        signatures.push_back(SignatureOf(thing.summary, ""));
      }
    }
  }
  if (signatures.empty()) return nullptr;
  // The first form that has as many arguments as are there.
  size_t active = 0;
  while (active + 1 < signatures.size() &&
         std::ssize(signatures[active]["parameters"]) <= call->commas) {
    ++active;
  }
  return {
      {"signatures", signatures}, {"activeSignature", active}, {"activeParameter", call->commas}};
}

}  // namespace morphbus::tools
