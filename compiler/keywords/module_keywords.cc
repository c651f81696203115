#include "compiler/keywords/module_keywords.h"

#include <fmt/format.h>

#include <map>
#include <utility>

namespace morphbus::keywords {
namespace {

/// ASCII only: names of M3L are identifiers, and the locale must not matter.
std::string Capitals(std::string name) {
  for (char& c : name) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return name;
}

/// Finds two items of one kind with the same keyword; "" if there are none.
template <typename T>
std::string Clash(const std::vector<T>& items, const char* what, const std::string& type_name) {
  // The first of the two is named first.
  std::map<std::string, std::string> seen;
  for (const T& item : items) {
    const auto [first, is_new] = seen.emplace(item.keyword, item.name);
    if (!is_new) {
      return fmt::format("{} '{}' and '{}' of module '{}' are both {}", what, first->second,
                         item.name, type_name, item.keyword);
    }
  }
  return "";
}

}  // namespace

// As the paper writes them (Sec. III B).
std::string KeywordOf(const std::string& name, bool is_link) {
  return (is_link ? "LINK_" : "") + Capitals(name);
}

Result<ModuleKeywords> KeywordsOf(const model::ModuleType& type) {
  ModuleKeywords keywords;
  keywords.type_name = type.name;
  // In the order of M3L, which is that of the file of keywords, too.
  for (const model::Link& link : type.links) {
    keywords.links.push_back({link.name, KeywordOf(link.name, true)});
  }
  for (const model::Joint& joint : type.joints) {
    keywords.joints.push_back({joint.name, Capitals(joint.name), joint.type});
  }
  for (const model::Connector& connector : type.connectors) {
    ConnectorKeyword entry{connector.name, Capitals(connector.name), {}};
    for (const model::StateVariable& state : connector.states) {
      // States belong to their connector; two connectors may each have one of the same name.
      entry.states.push_back({state.name, Capitals(state.name), state.values});
    }
    std::string clash = Clash(entry.states, "states", type.name + "." + connector.name);
    if (!clash.empty()) return Fail(std::move(clash));
    keywords.connectors.push_back(std::move(entry));
  }
  for (const model::Sensor& sensor : type.sensors) {
    keywords.sensors.push_back({sensor.name, Capitals(sensor.name), sensor.type});
  }
  // Links, joints, connectors and sensors each have names of their own, so a link and a joint may
  // share one.
  for (std::string clash :
       {Clash(keywords.links, "links", type.name), Clash(keywords.joints, "joints", type.name),
        Clash(keywords.connectors, "connectors", type.name),
        Clash(keywords.sensors, "sensors", type.name)}) {
    if (!clash.empty()) return Fail(std::move(clash));
  }
  return keywords;
}

Result<std::vector<ModuleKeywords>> KeywordsOf(const model::Model& model) {
  std::vector<ModuleKeywords> types;
  for (const model::ModuleType& type : model.module_types) {
    Result<ModuleKeywords> keywords = KeywordsOf(type);
    if (!keywords) return Fail(keywords.error().message);
    types.push_back(*std::move(keywords));
  }
  return types;
}

}  // namespace morphbus::keywords
