#include "tools/commands/connector_pair.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tools/base/model_io.h"

namespace morphbus::tools {
namespace {

/// The text without spaces at either end: "c1, c4" is a pair too.
std::string Trimmed(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// Why `type` cannot be the member: it has no connector of that name.
std::string NoConnector(const PairText& pair, const model::ModuleType& type,
                        const std::string& name) {
  const std::vector<std::string> names = NamesOf(type.connectors);
  return fmt::format("{}: module {} has no connector '{}'{}; it has {}", pair.option, type.name,
                     name, DidYouMean(name, names), fmt::join(names, ", "));
}

/// Why none of the connections `indices` has the pair.
std::string WhyNone(const model::Model& model, const std::vector<size_t>& indices,
                    const PairText& pair) {
  const auto type = [&](int index) -> const model::ModuleType& {
    return model.module_types[index];
  };
  // With one connection it is known which member lacks which connector.
  if (indices.size() == 1) {
    const model::ConnectionType& connection = model.connection_types[indices[0]];
    const bool a = type(connection.type_a).FindConnector(pair.a).has_value();
    return NoConnector(pair, type(a ? connection.type_b : connection.type_a), a ? pair.b : pair.a);
  }
  // With several, only a name that no module has is surely wrong.
  std::vector<std::string> names;
  for (const model::ModuleType& t : model.module_types) {
    for (const model::Connector& connector : t.connectors) names.push_back(connector.name);
  }
  for (const std::string& name : {pair.a, pair.b}) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    return fmt::format("{}: no module has a connector '{}'{}", pair.option, name,
                       DidYouMean(name, names));
  }
  // Both names exist, but no connection has them in its members.
  return fmt::format("{}: no connection has members with connectors '{}' and '{}'", pair.option,
                     pair.a, pair.b);
}

}  // namespace

Result<PairText> ParsePair(const std::string& option, const std::string& text) {
  // The first comma divides the names; a second one is refused below.
  const size_t comma = text.find(',');
  PairText pair{option, Trimmed(text.substr(0, comma)), ""};
  if (comma != std::string::npos) pair.b = Trimmed(text.substr(comma + 1));
  if (pair.a.empty() || pair.b.empty() || pair.b.find(',') != std::string::npos) {
    return Fail(fmt::format("{} {}: expected two connectors, such as c1,c4", option, text));
  }
  return pair;
}

Result<std::vector<ConnectorPair>> FindPairs(const model::Model& model,
                                             const std::string& connection, const PairText& pair) {
  // Looked through are all connections, or the one that is named.
  std::vector<size_t> indices;
  std::vector<std::string> names;
  for (size_t i = 0; i < model.connection_types.size(); ++i) {
    names.push_back(model.connection_types[i].name);
    if (connection.empty() || names.back() == connection) indices.push_back(i);
  }
  // Connections are missing, or the one that was named is.
  if (indices.empty()) return Fail(WhyNoneOf(names, connection, "connection"));
  // What is found are those of them whose members have the connectors: in the order that was
  // written, or else in the other one.
  std::vector<ConnectorPair> found;
  for (const auto& [of_a, of_b] : {std::pair(pair.a, pair.b), std::pair(pair.b, pair.a)}) {
    if (!found.empty()) break;
    for (const size_t i : indices) {
      const model::ConnectionType& type = model.connection_types[i];
      const auto a = model.module_types[type.type_a].FindConnector(of_a);
      const auto b = model.module_types[type.type_b].FindConnector(of_b);
      if (a && b) found.push_back({i, *a, *b});
    }
  }
  if (found.empty()) return Fail(WhyNone(model, indices, pair));
  return found;
}

}  // namespace morphbus::tools
