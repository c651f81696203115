#include "compiler/m3l/check_slips.h"

#include <fmt/format.h>

namespace morphbus::m3l::internal {
namespace {

/// Warnings of slips that one connection gives; more would say nothing new.
constexpr size_t kMaxSlips = 20;

/// Where the connector is declared: at the module or at a link.
const PointDecl* DeclOf(const CheckedModule& module, const std::string& connector) {
  const auto point = module.points.find(connector);
  if (point != module.points.end() && point->second.connector) return point->second.decl;
  for (const auto& own : module.link_points) {
    const auto it = own.find(connector);
    if (it != own.end() && it->second.connector) return it->second.decl;
  }
  return nullptr;
}

}  // namespace

void SlipWarner::WarnOf(const CheckedModule& module, const std::string& key,
                        const source::Span& span) {
  // A condition may name one key several times, and both members may be of one type.
  if (!looked_for_.emplace(&module, key).second) return;
  const std::map<std::string, int>& uses = UsesOfKeys(module);
  for (const model::Connector& connector : module.type.connectors) {
    const PointDecl* decl = DeclOf(module, connector.name);
    if (decl == nullptr || decl->Find(key) != nullptr) continue;
    for (const Attribute& attribute : decl->attributes) {
      const std::string& other = attribute.key.text;
      // A key that other connectors have too is meant.
      if (other == "coords" || other == "normal" || other == "connector" || uses.at(other) > 1 ||
          source::NearestName(other, {key}).empty() || slips_.size() >= kMaxSlips ||
          !slips_.emplace(attribute.key.span.file, attribute.key.span.begin).second) {
        continue;
      }
      diagnostics_
          .Warning(attribute.key.span,
                   fmt::format("connector '{}' has no '{}' for a condition to hold, only '{}'",
                               connector.name, key, other))
          .Hint(fmt::format("did you mean '{}'?", key))
          .Note(span, "the condition is false for the connector without it");
    }
  }
}

const std::map<std::string, int>& SlipWarner::UsesOfKeys(const CheckedModule& module) {
  const auto [it, fresh] = uses_of_keys_.try_emplace(&module);
  if (!fresh) return it->second;
  for (const model::Connector& connector : module.type.connectors) {
    const PointDecl* decl = DeclOf(module, connector.name);
    if (decl == nullptr) continue;
    std::set<std::string> keys;  // A key that is given twice counts once.
    for (const Attribute& attribute : decl->attributes) keys.insert(attribute.key.text);
    for (const std::string& key : keys) ++it->second[key];
  }
  return it->second;
}

}  // namespace morphbus::m3l::internal
