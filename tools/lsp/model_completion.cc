// Completion and signatures in M3L files.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "compiler/m3l/lexer.h"
#include "compiler/m3l/read_mesh.h"
#include "tools/lsp/completion.h"
#include "tools/lsp/m3l_words.h"
#include "tools/lsp/model_hover.h"
#include "tools/lsp/model_places.h"

namespace morphbus::tools {
namespace {

using source::NamedThing;
using source::NameKind;

/// The tokens of a file before a place, and what they say of it.
class ModelContext {
 public:
  ModelContext(const source::SourceSet& sources, size_t offset) : offset_(offset) {
    source::Diagnostics unsaid;
    tokens_ = m3l::Tokenize(sources, 0, m3l::kMaxTokens, &unsaid);
    // The word that is being typed is none of what stands before.
    while (count_ < tokens_.size() && tokens_[count_].kind != m3l::TokenKind::kEnd &&
           tokens_[count_].span.end < offset) {
      ++count_;
    }
    // A sign counts as soon as it stands there; a word may still go on.
    if (count_ < tokens_.size() && tokens_[count_].span.end == offset &&
        tokens_[count_].kind == m3l::TokenKind::kSymbol) {
      ++count_;
    }
    FindStatement();
    FindBrackets();
  }

  [[nodiscard]] size_t Offset() const { return offset_; }
  /// The token so many before the place; an empty one beyond the first.
  [[nodiscard]] std::string_view Before(size_t back = 1) const {
    return back <= count_ ? tokens_[count_ - back].text : std::string_view();
  }
  [[nodiscard]] bool WordBefore(size_t back = 1) const {
    return back <= count_ && tokens_[count_ - back].kind == m3l::TokenKind::kWord;
  }
  /// The word that begins the statement, "" outside of all.
  [[nodiscard]] const std::string& definition() const { return definition_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// The attribute in whose value the place is; "" outside of values.
  [[nodiscard]] const std::string& attribute() const { return attribute_; }
  /// Brackets that are open at the place, and of the innermost one the word before it and how many
  /// commas stand in it.
  [[nodiscard]] int depth() const { return static_cast<int>(open_.size()); }
  [[nodiscard]] std::string_view call() const {
    return open_.empty() || open_.back() == 0 ? std::string_view() : tokens_[open_.back() - 1].text;
  }
  [[nodiscard]] int commas() const { return commas_.empty() ? 0 : commas_.back(); }
  /// The names of the path that ends at the place, with a dot behind it: "m1." or "m1.link.".
  [[nodiscard]] std::vector<std::string> Path() const {
    std::vector<std::string> path;
    size_t back = 1;
    while (Before(back) == "." && WordBefore(back + 1)) {
      path.insert(path.begin(), std::string(Before(back + 1)));
      back += 2;
    }
    return path;
  }
  /// Whether the place is within a string; then the text of it so far.
  [[nodiscard]] std::optional<std::string> InString() const {
    if (count_ >= tokens_.size() || tokens_[count_].kind != m3l::TokenKind::kString)
      return std::nullopt;
    const m3l::Token& token = tokens_[count_];
    if (token.span.begin >= offset_) return std::nullopt;
    return std::string(token.text.substr(1, offset_ - token.span.begin - 1));
  }
  /// The member that a condition of the statement calls so, `MEMBER.point NAME`; empty if none
  /// does.
  [[nodiscard]] std::string MemberOf(const std::string& name) const {
    for (size_t i = begin_ + 3; i < tokens_.size() && !(i > begin_ && Begins(i)); ++i) {
      if (tokens_[i].text == name && tokens_[i - 1].text == "point" && tokens_[i - 2].text == ".") {
        return std::string(tokens_[i - 3].text);
      }
    }
    return "";
  }
  /// The first end of the docking, "m1.c2", where the place is in a third element.
  [[nodiscard]] std::vector<std::string> DockingEnds() const {
    std::vector<std::string> ends;
    if (open_.empty()) return ends;
    std::string end;
    for (size_t i = open_.back() + 1; i < count_; ++i) {
      if (tokens_[i].text == ",") {
        ends.push_back(end);
        end.clear();
      } else {
        end += tokens_[i].text;
      }
    }
    return ends;
  }

 private:
  [[nodiscard]] bool Begins(size_t i) const {
    return tokens_[i].kind == m3l::TokenKind::kWord && m3l::StartsStatement(tokens_, i);
  }

  void FindStatement() {
    for (size_t i = count_; i-- > 0;) {
      if (!Begins(i)) continue;
      begin_ = i;
      definition_ = tokens_[i].text;
      if (i + 1 < count_) name_ = tokens_[i + 1].text;
      return;
    }
  }

  void FindBrackets() {
    for (size_t i = begin_; i < count_; ++i) {
      const std::string_view text = tokens_[i].text;
      if (text == "(" || text == "[") {
        open_.push_back(i);
        commas_.push_back(0);
      } else if ((text == ")" || text == "]") && !open_.empty()) {
        open_.pop_back();
        commas_.pop_back();
      } else if (text == "," && !commas_.empty()) {
        ++commas_.back();
      }
      // The value of an attribute goes on to the next comma outside of brackets.
      if (open_.empty() && text == ",") attribute_.clear();
      if (open_.empty() && text == "=" && i > 0) attribute_ = tokens_[i - 1].text;
    }
  }

  size_t offset_;
  std::vector<m3l::Token> tokens_;
  size_t count_ = 0;  ///< Tokens before the place.
  size_t begin_ = 0;  ///< Where the statement begins.
  std::string definition_, name_, attribute_;
  std::vector<size_t> open_;
  std::vector<int> commas_;
};

/// Offers what may stand at a place.
class ModelCompleter {
 public:
  ModelCompleter(const ModelFile& file, const ModelContext& at) : file_(file), at_(at) {}

  /// What is narrowest decides: a text, a path with a dot, the value of an attribute, and only then
  /// what a statement may go on with. A statement may end anywhere, so that another one may begin.
  Json Complete() {
    if (const std::optional<std::string> text = at_.InString()) {
      OfferInString(*text);
    } else if (const std::vector<std::string> path = at_.Path(); !path.empty()) {
      OfferMembers(path);
    } else if (!at_.attribute().empty()) {
      OfferValues();
    } else if (at_.definition().empty() || AtAttribute()) {
      if (!at_.definition().empty()) OfferAttributes(AttributesOf());
      OfferStatements();
    } else {
      OfferStatements();
    }
    return items_.Take();
  }

 private:
  /// Whether an attribute of the statement may begin here.
  [[nodiscard]] bool AtAttribute() const {
    return at_.Before() == ":" || at_.Before() == "," || at_.Before() == ")";
  }
  /// A sub-point has the attributes of a point.
  [[nodiscard]] std::string AttributesOf() const {
    return at_.depth() > 0 ? "point" : at_.definition();
  }

  /// Words that begin a statement, which none does within brackets.
  void OfferStatements() {
    if (at_.depth() > 0) return;
    for (const ModelWord& word : StatementWords()) {
      items_.Add(std::string(word.word), ItemKind::kSnippet, std::string(word.meaning),
                 std::string(word.snippet));
    }
  }

  /// The attributes that the language has for a definition, and those that connectors here have.
  void OfferAttributes(const std::string& definition) {
    for (const AttributeWord& word : AttributeWords()) {
      if (word.definition != definition) continue;
      const std::string insert =
          std::string(word.name) + (word.value.empty() ? "" : "=" + std::string(word.value));
      items_.Add(std::string(word.name), ItemKind::kProperty, std::string(word.meaning), insert);
    }
    if (definition == "robot" || definition == "connection") return;
    // Attributes that connectors of this file have.
    for (const NamedThing& thing : file_.names.things) {
      if (definition == "point" && thing.kind == NameKind::kAttribute) {
        items_.Add(thing.name, ItemKind::kProperty, "an attribute of connectors");
      }
    }
  }

  /// The module type that the statement stands in.
  [[nodiscard]] int EnclosingModule() const {
    int module = -1;
    size_t nearest = 0;
    for (int i = 0; i < std::ssize(file_.names.things); ++i) {
      const NamedThing& thing = file_.names.things[i];
      if (thing.kind != NameKind::kModule || thing.extent.file != 0) continue;
      if (thing.extent.begin > at_.Offset() || thing.extent.begin < nearest) continue;
      nearest = thing.extent.begin;
      module = i;
    }
    return module;
  }

  void OfferThings(NameKind kind, int owner, ItemKind item) {
    for (const NamedThing& thing : file_.names.things) {
      if (thing.kind != kind || thing.owner != owner) continue;
      items_.Add(thing.name, item, ThingLine(file_, thing));
    }
  }
  /// All things of a kind, whatever they belong to.
  void OfferAll(NameKind kind, ItemKind item) {
    for (const NamedThing& thing : file_.names.things) {
      if (thing.kind == kind) items_.Add(thing.name, item, ThingLine(file_, thing));
    }
  }

  void OfferWords(std::span<const ModelWord> words, ItemKind kind) {
    for (const ModelWord& word : words) {
      items_.Add(std::string(word.word), kind, std::string(word.meaning),
                 std::string(word.snippet));
    }
  }

  void OfferChoices(std::span<const char* const> choices) {
    for (const char* choice : choices) items_.Add(choice, ItemKind::kValue, "");
  }

  /// What may stand in the value of an attribute.
  void OfferValues() {
    const std::string& definition = at_.definition();
    const std::string& attribute = at_.attribute();
    const int module = EnclosingModule();
    if (definition == "joint" && attribute == "type") {
      OfferChoices(model::kJointTypeNames);
    } else if (definition == "sensor" && attribute == "type") {
      OfferChoices(model::kSensorTypeNames);
    } else if (definition == "module" && attribute == "on_loss") {
      constexpr const char* kOnLoss[] = {"\"limp\"", "\"hold\""};
      OfferChoices(kOnLoss);
    } else if (definition == "joint" && attribute == "pair") {
      OfferThings(at_.commas() == 0 ? NameKind::kLink : NameKind::kAxis, module, ItemKind::kValue);
    } else if (definition == "sensor" && attribute == "link") {
      OfferThings(NameKind::kLink, module, ItemKind::kValue);
    } else if (definition == "link" && attribute == "grouping") {
      OfferThings(NameKind::kPoint, module, ItemKind::kValue);
    } else if (definition == "link" && (attribute == "hull" || attribute == "visual")) {
      OfferHull(module);
    } else if (attribute == "members" || (definition == "robot" && attribute == "modules")) {
      OfferAll(NameKind::kModule, ItemKind::kClass);
    } else if (attribute == "conditions") {
      OfferConditions();
    } else if (definition == "robot") {
      OfferOfRobot();
    }
    if (definition != "robot" && definition != "connection") {
      OfferAll(NameKind::kConstant, ItemKind::kConstant);
    }
  }

  /// What a hull or a look is made of: shapes with their attributes, points and links.
  void OfferHull(int module) {
    OfferAttributes(std::string(at_.call()));
    if (at_.call().empty() || at_.call() == "=") OfferWords(HullWords(), ItemKind::kFunction);
    OfferThings(NameKind::kPoint, module, ItemKind::kValue);
    OfferThings(NameKind::kLink, module, ItemKind::kValue);
    if (at_.Before() == "=" && at_.Before(2) == "axis") {
      OfferThings(NameKind::kAxis, module, ItemKind::kValue);
    }
  }

  /// Words of conditions, and the names that the members and their connectors have here.
  void OfferConditions() {
    OfferWords(ConditionWords(), ItemKind::kKeyword);
    const int owner = file_.names.Find(NameKind::kConnection, at_.name());
    OfferThings(NameKind::kBinder, owner, ItemKind::kVariable);
    OfferThings(NameKind::kMember, owner, ItemKind::kVariable);
  }

  void OfferOfRobot() {
    // A third element of a docking chooses among the ways to mate the two connectors.
    if (at_.attribute() == "connections" && at_.depth() == 2 && at_.commas() == 2) OfferOptions();
    OfferThings(NameKind::kInstance, file_.names.Find(NameKind::kRobot, at_.name()),
                ItemKind::kVariable);
  }

  /// The index of a connector of an instance, "m1.c2", with its module type.
  [[nodiscard]] std::optional<std::pair<int, int>> EndOf(const std::string& text) const {
    const size_t dot = text.find('.');
    const int robot = file_.names.Find(NameKind::kRobot, at_.name());
    const int instance = file_.names.Find(NameKind::kInstance, text.substr(0, dot), robot);
    if (dot == std::string::npos || instance < 0) return std::nullopt;
    const int base = file_.names.things[instance].base;
    const auto& types = file_.compiled.solved.module_types;
    for (int type = 0; base >= 0 && type < std::ssize(types); ++type) {
      if (types[type].name != file_.names.things[base].name) continue;
      const std::optional<int> connector = types[type].FindConnector(text.substr(dot + 1));
      if (connector) return std::pair(type, *connector);
    }
    return std::nullopt;
  }

  /// The numbers of the ways in which the two ends of a docking mate, each with what it does.
  void OfferOptions() {
    const std::vector<std::string> ends = at_.DockingEnds();
    if (ends.size() < 2) return;
    const auto x = EndOf(ends[0]), y = EndOf(ends[1]);
    if (!x || !y) return;
    const auto& connections = file_.compiled.solved.connection_types;
    for (int c = 0; c < std::ssize(connections); ++c) {
      const model::ConnectionType& connection = connections[c];
      for (int o = 0; o < std::ssize(connection.options); ++o) {
        const model::ConnectionOption& option = connection.options[o];
        const std::pair a(connection.type_a, option.connector_a);
        const std::pair b(connection.type_b, option.connector_b);
        if (!(a == *x && b == *y) && !(a == *y && b == *x)) continue;
        const std::string lines = ConnectionLines(file_.compiled.solved, c, o);
        items_.Add(std::to_string(option.number), ItemKind::kValue,
                   lines.substr(0, lines.find('\n')));
      }
    }
    items_.Add("rot", ItemKind::kValue, "turned so many degrees from the default of the pair",
               "rot=${1:90}");
  }

  /// What may stand behind a dot.
  void OfferMembers(const std::vector<std::string>& path) {
    const source::NameTable& names = file_.names;
    if (at_.definition() == "connection") {
      const int owner = names.Find(NameKind::kConnection, at_.name());
      // A condition that is being typed does not parse, but its words say what they name.
      const std::string member = at_.MemberOf(path[0]);
      const bool binder = !member.empty();
      const int thing = names.Find(NameKind::kMember, binder ? member : path[0], owner);
      if (thing < 0) return;
      const int module = names.things[thing].base;
      items_.Add("point", ItemKind::kKeyword,
                 binder ? "any sub-point of it" : "a connector of the member, which gets a name",
                 binder ? "" : "point ${1:p}");
      if (binder) {
        OfferThings(NameKind::kSubpoint, module, ItemKind::kValue);
        OfferThings(NameKind::kAttribute, module, ItemKind::kProperty);
      } else {
        OfferThings(NameKind::kAxis, module, ItemKind::kValue);
      }
      return;
    }
    if (at_.definition() == "robot") {
      const int robot = names.Find(NameKind::kRobot, at_.name());
      const int instance = names.Find(NameKind::kInstance, path[0], robot);
      if (instance < 0) return;
      const int module = names.things[instance].base;
      if (at_.attribute() == "joints")
        return OfferThings(NameKind::kJoint, module, ItemKind::kField);
      if (at_.attribute() == "frame") {
        if (path.size() == 1) return OfferThings(NameKind::kLink, module, ItemKind::kValue);
        items_.Add("(axis: ...)", ItemKind::kSnippet, "an axis written on the spot",
                   "(axis: origin=(${1:0}, ${2:0}, ${3:0}), direction=(${4:1}, ${5:0}, ${6:0}))");
        return OfferThings(NameKind::kAxis, module, ItemKind::kValue);
      }
      return OfferConnectors(module);
    }
    // In a hull: `c1.` and `link.`.
    const int module = EnclosingModule();
    items_.Add("point", ItemKind::kKeyword, "all points of it");
    const int link = names.Find(NameKind::kLink, path[0], module);
    if (link >= 0 && path.size() == 1) return OfferThings(NameKind::kPoint, link, ItemKind::kValue);
    OfferThings(NameKind::kSubpoint, module, ItemKind::kValue);
  }

  void OfferConnectors(int module) {
    if (module < 0) return;
    for (const model::ModuleType& type : file_.compiled.solved.module_types) {
      if (type.name != file_.names.things[module].name) continue;
      for (const model::Connector& connector : type.connectors) {
        NamedThing thing;
        thing.kind = NameKind::kPoint;
        thing.name = connector.name;
        thing.owner = module;
        items_.Add(connector.name, ItemKind::kValue, ThingLine(file_, thing));
      }
    }
  }

  /// Files for an import, for a hull, which is the convex one of an STL, and for a look.
  void OfferInString(const std::string& text) {
    constexpr std::string_view kModels[] = {".m3l"};
    if (at_.Before() == "import") return items_.AddFiles(file_.path, text, kModels);
    if (at_.call() != "mesh") return;
    const std::span<const std::string_view> meshes(m3l::kMeshEndings);
    items_.AddFiles(file_.path, text, at_.attribute() == "visual" ? meshes : meshes.first(1));
  }

  const ModelFile& file_;
  const ModelContext& at_;
  ItemList items_;
};

}  // namespace

void ItemList::Add(const std::string& label, ItemKind kind, const std::string& detail,
                   const std::string& insert) {
  if (label.empty() || !labels_.emplace(label, true).second) return;
  Json item = {{"label", label}, {"kind", static_cast<int>(kind)}};
  if (!detail.empty()) item["detail"] = detail;
  if (!insert.empty()) {
    item["insertText"] = insert;
    // A snippet has places that are filled in one after the other.
    if (insert.find('$') != std::string::npos) item["insertTextFormat"] = 2;
  }
  items_.push_back(std::move(item));
}

void ItemList::AddFiles(const std::string& path, std::string_view typed,
                        std::span<const std::string_view> endings) {
  const std::filesystem::path folder =
      (std::filesystem::path(path).parent_path() / typed).parent_path();
  std::error_code error;
  for (auto entry = std::filesystem::directory_iterator(folder, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename();
    const bool wanted =
        std::ranges::any_of(endings, [&](std::string_view end) { return name.ends_with(end); });
    if (wanted && CanonicalPath(entry->path()) != path) Add(name, ItemKind::kFile, "");
  }
}

Json CompleteModel(Workspace* workspace, const std::string& path, size_t offset) {
  const ModelFile& file = workspace->Model(path);
  const ModelContext at(file.compiled.sources, offset);
  return ModelCompleter(file, at).Complete();
}

Json ModelSignature(const ModelFile& file, size_t offset) {
  const ModelContext at(file.compiled.sources, offset);
  if (at.depth() == 0) return nullptr;
  std::vector<std::string> parameters;
  std::string label;
  const std::string call(at.call());
  if (at.definition() == "robot" && at.attribute() == "connections" && at.depth() == 2) {
    parameters = {"MODULE.CONNECTOR", "MODULE.CONNECTOR", "NUMBER | rot=DEGREES | NAME:NUMBER"};
    label = "(" + fmt::format("{}", fmt::join(parameters, ", ")) + ")";
  } else if (at.definition() == "joint" && at.attribute() == "pair" && at.depth() == 2) {
    parameters = {"LINK", "AXIS"};
    label = "(LINK, AXIS)";
  } else {
    for (const AttributeWord& word : AttributeWords()) {
      if (word.definition == call) parameters.push_back(std::string(word.name) + "=");
    }
    const bool hull =
        std::ranges::any_of(HullWords(), [&](const ModelWord& word) { return word.word == call; });
    if (!hull || parameters.empty()) return nullptr;
    label = call + "(" + fmt::format("{}", fmt::join(parameters, ", ")) + ")";
  }
  Json list = Json::array();
  for (const std::string& parameter : parameters) list.push_back({{"label", parameter}});
  const int active = std::min(at.commas(), static_cast<int>(std::ssize(parameters)) - 1);
  return {{"signatures", {{{"label", label}, {"parameters", list}}}},
          {"activeSignature", 0},
          {"activeParameter", active}};
}

}  // namespace morphbus::tools
