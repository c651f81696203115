#include "compiler/keywords/keywords_xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <utility>

#include "compiler/base/quantity.h"
#include "compiler/base/utf8.h"
#include "compiler/keywords/xml_text.h"

namespace morphbus::keywords {
namespace {

// A module type has some dozens of parts; larger files are no keywords.
constexpr size_t kMaxXmlBytes = size_t{1} << 20;
constexpr size_t kMaxName = 255;  // Characters, as the schema counts.
constexpr int kVersion = 1;

template <typename T>
pugi::xml_node Append(pugi::xml_node parent, const char* element, const T& item) {
  return xml::Append(parent, element, {{"name", item.name}, {"keyword", item.keyword}});
}

void AppendState(pugi::xml_node parent, const StateKeyword& state) {
  pugi::xml_node node = Append(parent, "state", state);
  // A bool has no values to list; numbers and strings have.
  if (std::holds_alternative<bool>(state.values.front())) {
    xml::Set(node, "type", "bool");
    return;
  }
  // All values of a state are of one type, of which the first tells.
  const bool is_number = std::holds_alternative<double>(state.values.front());
  xml::Set(node, "type", is_number ? "number" : "string");
  for (const model::AttributeValue& value : state.values) {
    const std::string text =
        is_number ? fmt::format("{}", std::get<double>(value)) : std::get<std::string>(value);
    xml::AppendText(node, "value", text);
  }
}

/// The line, counted from 1, of the byte at `offset`; pugixml gives a negative one where it knows
/// none.
std::ptrdiff_t LineAt(std::string_view text, std::ptrdiff_t offset) {
  offset = std::clamp<std::ptrdiff_t>(offset, 0, std::ssize(text));
  return 1 + std::count(text.begin(), text.begin() + offset, '\n');
}

/// Walks the document and keeps the first thing that is wrong.
class Reader {
 public:
  Reader(const pugi::xml_document& document, std::string_view text)
      : document_(document), text_(text) {}

  Result<ModuleKeywords> Read() {
    // The root element, and nothing beside it but the declaration.
    const pugi::xml_node root = document_.document_element();
    if (!root) return Fail("line 1: not a file of keywords: there is no element");
    // Another format deserves a message of its own.
    if (std::string_view(root.name()) != "module") {
      return Fail("not a file of keywords: its element is not <module>");
    }
    for (const pugi::xml_node& node : document_.children()) {
      if (node != root && node.type() != pugi::node_declaration) Unexpected(node);
    }
    // From here on errors are only noted: each reader goes on with an empty item, and Read fails at
    // its end.
    CheckAttributes(root, {"version", "name"});
    if (error_.empty() && std::string_view(Required(root, "version")) != std::to_string(kVersion)) {
      Bad(root,
          fmt::format("version {} of the format is not supported", Required(root, "version")));
    }
    // Links, joints, connectors and sensors in any order, each with the attributes of its kind.
    ModuleKeywords keywords;
    keywords.type_name = Name(root);
    for (const pugi::xml_node& node : root.children()) {
      const std::string_view element = node.name();
      if (element == "link") {
        keywords.links.push_back(ReadItem<LinkKeyword>(node, {"name", "keyword"}));
        const std::string_view keyword = keywords.links.back().keyword;
        if (keyword.rfind("LINK_", 0) != 0 || keyword == "LINK_") {
          Bad(node, "a link's keyword begins with LINK_ and goes on");
        }
        NoChildren(node);
      } else if (element == "joint") {
        keywords.joints.push_back(ReadItem<JointKeyword>(node, {"name", "keyword", "type"}));
        keywords.joints.back().type = ReadJointType(node);
        NoChildren(node);
      } else if (element == "connector") {
        keywords.connectors.push_back(ReadConnector(node));
      } else if (element == "sensor") {
        keywords.sensors.push_back(ReadItem<SensorKeyword>(node, {"name", "keyword", "type"}));
        keywords.sensors.back().type = ReadSensorType(node);
        NoChildren(node);
      } else {
        Unexpected(node);
      }
    }
    // Each keyword must mean one part of its kind.
    CheckClashes(root, keywords.links);
    CheckClashes(root, keywords.joints);
    CheckClashes(root, keywords.connectors);
    CheckClashes(root, keywords.sensors);
    if (!error_.empty()) return Fail(error_);
    return keywords;
  }

 private:
  void Bad(const pugi::xml_node& node, const std::string& what) {
    // Only the first thing that is wrong is told; those after it may follow from it.
    if (!error_.empty()) return;
    error_ = fmt::format("line {}: {}", LineAt(text_, node.offset_debug()), what);
  }

  void Unexpected(const pugi::xml_node& node) {
    // Blanks between elements are no text.
    const std::string_view name = node.name();
    const std::string_view value = node.value();
    if (name.empty() && value.find_first_not_of(" \t\r\n") == std::string_view::npos) return;
    Bad(node, name.empty() ? "unexpected text" : fmt::format("unexpected element <{}>", name));
  }

  // Elements that only have attributes.
  void NoChildren(const pugi::xml_node& node) {
    for (const pugi::xml_node& child : node.children()) Unexpected(child);
  }

  /// All text of an element that may hold nothing else; a comment may part it.
  std::string TextOf(const pugi::xml_node& node) {
    std::string text;
    for (const pugi::xml_node& child : node.children()) {
      if (child.type() == pugi::node_element) Unexpected(child);
      text += child.value();
    }
    return text;
  }

  // The whole text must be one number that a double holds.
  double NumberOf(const pugi::xml_node& node) {
    const std::string text = TextOf(node);
    const std::optional<double> number = ReadNumber<double>(text);
    if (!number) Bad(node, fmt::format("'{}' is no number", text));
    return number.value_or(0);
  }

  // pugixml keeps attributes that stand twice; XML allows none.
  void CheckAttributes(const pugi::xml_node& node, const std::set<std::string_view>& allowed) {
    std::set<std::string_view> seen;
    for (const pugi::xml_attribute& attribute : node.attributes()) {
      const std::string_view name = attribute.name();
      // Names that are declared and not used say nothing.
      if (name.rfind("xmlns:", 0) == 0 && seen.insert(name).second) continue;
      if (allowed.count(name) == 0) Bad(node, fmt::format("unexpected attribute '{}'", name));
      if (!seen.insert(name).second) Bad(node, fmt::format("attribute '{}' twice", name));
    }
  }

  // An empty text stands for an attribute that is missing, which has been reported.
  const char* Required(const pugi::xml_node& node, const char* attribute) {
    const pugi::xml_attribute found = node.attribute(attribute);
    if (!found) Bad(node, fmt::format("<{}> lacks its attribute '{}'", node.name(), attribute));
    return found.value();
  }

  std::string Name(const pugi::xml_node& node) {
    // The length is counted in characters, as the schema does, not in bytes.
    std::string name = Required(node, "name");
    if (name.empty() || CountCharacters(name) > kMaxName) {
      Bad(node, "name is empty or too long");
    }
    return name;
  }

  std::string Keyword(const pugi::xml_node& node) {
    // A link's keyword may be longer than its name by the five letters of LINK_.
    std::string keyword = Required(node, "keyword");
    const auto is_letter = [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; };
    // As the schema has it: capitals, digits and _, not a digit first.
    const bool good = !keyword.empty() && keyword.size() <= kMaxName + 5 && is_letter(keyword[0]) &&
                      std::all_of(keyword.begin(), keyword.end(),
                                  [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
    if (!good) Bad(node, fmt::format("'{}' is no keyword: capitals, digits and _", keyword));
    return keyword;
  }

  template <typename T>
  T ReadItem(const pugi::xml_node& node, const std::set<std::string_view>& attributes) {
    CheckAttributes(node, attributes);
    T item;
    item.name = Name(node);
    item.keyword = Keyword(node);
    return item;
  }

  // The words are those of M3L.
  model::JointType ReadJointType(const pugi::xml_node& node) {
    const std::string_view name = Required(node, "type");
    const std::optional<model::JointType> type = model::JointTypeNamed(name);
    if (!type) Bad(node, fmt::format("'{}' is no type of joint", name));
    return type.value_or(model::JointType::kFixed);
  }

  model::SensorType ReadSensorType(const pugi::xml_node& node) {
    const std::string_view name = Required(node, "type");
    const std::optional<model::SensorType> type = model::SensorTypeNamed(name);
    if (!type) Bad(node, fmt::format("'{}' is no type of sensor", name));
    return type.value_or(model::SensorType::kDistance);
  }

  ConnectorKeyword ReadConnector(const pugi::xml_node& node) {
    // Only states may stand inside a connector.
    auto connector = ReadItem<ConnectorKeyword>(node, {"name", "keyword"});
    for (const pugi::xml_node& child : node.children()) {
      if (std::string_view(child.name()) != "state") {
        Unexpected(child);
        continue;
      }
      connector.states.push_back(ReadState(child));
    }
    // States are unique within their connector only.
    CheckClashes(node, connector.states);
    return connector;
  }

  StateKeyword ReadState(const pugi::xml_node& node) {
    auto state = ReadItem<StateKeyword>(node, {"name", "keyword", "type"});
    // The type of a state says how its values are read.
    const std::string_view type = Required(node, "type");
    if (type == "bool") {
      // In the order of M3L's [bool], for a value is sent as its index (connector_command_t).
      state.values = {false, true};
      NoChildren(node);
      return state;
    }
    if (type != "string" && type != "number") {
      Bad(node, fmt::format("'{}' is no type of state", type));
    }
    for (const pugi::xml_node& child : node.children()) {
      if (std::string_view(child.name()) != "value" || child.first_attribute()) {
        Unexpected(child);
        continue;
      }
      if (type == "string") {
        state.values.emplace_back(TextOf(child));
      } else {
        state.values.emplace_back(NumberOf(child));
      }
    }
    if (state.values.empty()) Bad(node, fmt::format("state '{}' has no values", state.name));
    return state;
  }

  template <typename T>
  void CheckClashes(const pugi::xml_node& node, const std::vector<T>& items) {
    // Parts of one kind share a space of names, parts of two kinds do not.
    std::set<std::string_view> seen;
    for (const T& item : items) {
      if (!seen.insert(item.keyword).second) {
        Bad(node, fmt::format("keyword {} twice", item.keyword));
      }
    }
  }

  const pugi::xml_document& document_;
  std::string_view text_;
  std::string error_;
};

}  // namespace

// Parts in the order of the module type, so that equal types give equal files.
std::string KeywordsXml(const ModuleKeywords& keywords) {
  pugi::xml_document document;
  xml::Start(&document);
  // Both the name in M3L and the keyword are written, so that readers need not know how one becomes
  // the other.
  const pugi::xml_node root = xml::Append(
      document, "module", {{"version", std::to_string(kVersion)}, {"name", keywords.type_name}});
  for (const LinkKeyword& link : keywords.links) Append(root, "link", link);
  for (const JointKeyword& joint : keywords.joints) {
    xml::Set(Append(root, "joint", joint), "type", model::JointTypeName(joint.type));
  }
  for (const ConnectorKeyword& connector : keywords.connectors) {
    const pugi::xml_node node = Append(root, "connector", connector);
    for (const StateKeyword& state : connector.states) AppendState(node, state);
  }
  for (const SensorKeyword& sensor : keywords.sensors) {
    xml::Set(Append(root, "sensor", sensor), "type", model::SensorTypeName(sensor.type));
  }
  return xml::Text(document);
}

Result<ModuleKeywords> ParseKeywordsXml(std::string_view text) {
  if (text.size() > kMaxXmlBytes) return Fail("file of keywords is larger than 1 MiB");
  pugi::xml_document document;
  // Values may be blank ("mode" of " "), so text is kept as it stands, and what follows the
  // document's element is seen.
  const pugi::xml_parse_result parsed = document.load_buffer(
      text.data(), text.size(), pugi::parse_default | pugi::parse_ws_pcdata | pugi::parse_fragment,
      pugi::encoding_utf8);
  if (!parsed) {
    return Fail(fmt::format("line {}: {}", LineAt(text, parsed.offset), parsed.description()));
  }
  return Reader(document, text).Read();
}

}  // namespace morphbus::keywords
