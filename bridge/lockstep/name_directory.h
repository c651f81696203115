#pragma once
// Names of a run's modules by number, as SENSORS tells them.

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/wire/channels.h"

namespace morphbus::bridge {

/// What one module knows of the others' names. A run of a thousand modules in one process has a
/// thousand of these, so that it is one row in order of number.
class NameDirectory {
 public:
  /// Far more modules than a robot has, so that only messages made up in bad faith ever meet this
  /// limit.
  static constexpr size_t kMostNames = 4096;

  /// Notes a name that can be one. It is told once and stays: another one later is not believed.
  void Add(uint16_t module, std::string_view name) {
    const auto at = Find(module);
    const bool known = at != names_.end() && at->first == module;
    if (known || names_.size() >= kMostNames || !CheckModuleName(name)) return;
    names_.emplace(at, module, name);
  }
  /// Null if SENSORS has not mentioned that module.
  [[nodiscard]] const std::string* NameOf(uint16_t module) {
    const auto at = Find(module);
    return at != names_.end() && at->first == module ? &at->second : nullptr;
  }

 private:
  using Names = std::vector<std::pair<uint16_t, std::string>>;
  /// The entry of that number, or the one before which it belongs.
  Names::iterator Find(uint16_t module) {
    return std::lower_bound(names_.begin(), names_.end(), module,
                            [](const auto& entry, uint16_t other) { return entry.first < other; });
  }

  Names names_;
};

}  // namespace morphbus::bridge
