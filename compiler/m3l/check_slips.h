#pragma once
// Slips in the attributes of connectors, which a condition that asks for another one would pass
// over.

#include <map>
#include <set>
#include <string>
#include <utility>

#include "compiler/m3l/checker.h"

namespace morphbus::m3l::internal {

/// Warns of connectors that lack an attribute for a condition to hold, but have one of nearly the
/// same name. One for each connection.
class SlipWarner {
 public:
  explicit SlipWarner(source::Diagnostics* diagnostics) : diagnostics_(*diagnostics) {}

  /// Looks for slips for `key`, which the condition at `span` compares on connectors of `module`. A
  /// connector without the key would silently never mate. Each key is looked for once.
  void WarnOf(const CheckedModule& module, const std::string& key, const source::Span& span);

 private:
  /// How many of a module's connectors have each key.
  const std::map<std::string, int>& UsesOfKeys(const CheckedModule& module);

  source::Diagnostics& diagnostics_;
  std::set<std::pair<int, size_t>> slips_;  ///< Places of keys that were warned of.
  std::set<std::pair<const CheckedModule*, std::string>> looked_for_;
  std::map<const CheckedModule*, std::map<std::string, int>> uses_of_keys_;
};

}  // namespace morphbus::m3l::internal
