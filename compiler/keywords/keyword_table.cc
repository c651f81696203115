#include "compiler/keywords/keyword_table.h"

#include <variant>

#include "vm/image/image_texts.h"

namespace morphbus::keywords {

namespace {

// Keyword::types holds one bit for each module type.
constexpr size_t kMaxTypes = 64;

// Images name links as M3L does, in capitals; only programs write LINK_ before them.
constexpr std::string_view kLinkPrefix = "LINK_";

}  // namespace

Result<KeywordTable> KeywordTable::Of(const std::vector<ModuleKeywords>& types) {
  if (types.size() > kMaxTypes) return Fail("a program can know at most 64 module types");
  KeywordTable table;
  int number = 0;
  for (const ModuleKeywords& type : types) {
    // Links, joints, connectors and their states: each kind has its own words.
    for (const LinkKeyword& link : type.links) {
      Keyword& keyword = table.Add(number, vm::KeywordKind::kLink, link.keyword);
      if (link.keyword.starts_with(kLinkPrefix)) {
        keyword.name = link.keyword.substr(kLinkPrefix.size());
      }
    }
    for (const JointKeyword& joint : type.joints) {
      Keyword& keyword = table.Add(number, vm::KeywordKind::kJoint, joint.keyword);
      keyword.slides |= joint.type == model::JointType::kPrismatic;
      keyword.turns |=
          joint.type == model::JointType::kRevolute || joint.type == model::JointType::kContinuous;
    }
    for (const ConnectorKeyword& connector : type.connectors) {
      table.Add(number, vm::KeywordKind::kConnector, connector.keyword);
      for (const StateKeyword& state : connector.states) {
        // One type may have a state with two values, and another the same state with several.
        const bool is_bool = state.values.empty() || std::holds_alternative<bool>(state.values[0]);
        Keyword& keyword = table.Add(number, vm::KeywordKind::kConnectorState, state.keyword);
        (is_bool ? keyword.takes_bool : keyword.takes_int) = true;
      }
    }
    // A sensor may be asked by its name, or any of its kind by where it looks.
    for (const SensorKeyword& sensor : type.sensors) {
      const auto kind = static_cast<int>(sensor.type);
      table.Add(number, vm::KeywordKind::kSensor, sensor.keyword).measures |= 1u << kind;
      table.Add(number, vm::KeywordKind::kSensorKind, ToString(vm::kSensorKindNames[kind]));
    }
    ++number;
  }
  return table;
}

// The entry of that spelling, made if no type before had it.
Keyword& KeywordTable::Add(int type, vm::KeywordKind kind, const std::string& spelling) {
  // The name that the image stores is the spelling but for links.
  int index = Find(kind, spelling);
  if (index < 0) {
    index = static_cast<int>(all_.size());
    all_.push_back({.kind = kind, .spelling = spelling, .name = spelling});
  }
  all_[index].types |= uint64_t{1} << type;
  return all_[index];
}

// A table has a few dozen entries, and a program some hundred lookups: a search in order is enough.
int KeywordTable::Find(vm::KeywordKind kind, const std::string& spelling) const {
  for (size_t i = 0; i < all_.size(); ++i) {
    if (all_[i].kind == kind && all_[i].spelling == spelling) return static_cast<int>(i);
  }
  return -1;
}

std::vector<std::string> KeywordTable::Spellings(vm::KeywordKind kind) const {
  std::vector<std::string> spellings;
  for (const Keyword& keyword : all_) {
    if (keyword.kind == kind) spellings.push_back(keyword.spelling);
  }
  return spellings;
}

}  // namespace morphbus::keywords
