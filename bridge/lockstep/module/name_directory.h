#pragma once
// Names of a run's modules by number, as SENSORS tells them.

#include <algorithm>
#include <cstdint>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace morphbus::bridge {

/// What the modules of one process have heard of the names in their run. Each of them hears all of
/// SENSORS in its first tick: what the first one has looked through the others need not check
/// again, nor keep once more.
class NameDirectory {
 public:
  /// As many as there are numbers, and as SENSORS has parts at most.
  static constexpr size_t kMostNames = 32768;

  /// A part of SENSORS whose names have been added.
  struct Part {
    int64_t tick = 0;
    int part = 0, num_parts = 0;
    std::vector<uint16_t> modules;  ///< Whose readings stand in it, in order.
    /// Whether the module's reading does.
    [[nodiscard]] bool Holds(uint16_t module) const {
      return std::ranges::binary_search(modules, module);
    }
  };
  /// Adds the names in a part of SENSORS, which was checked. `sensors` is what was decoded of it
  /// besides the readings.
  void Learn(const morphbus::sensors_t& sensors, const uint8_t* data, size_t size);
  /// The part with these bytes (XXH3 of the message), if it was added; null if it was not.
  [[nodiscard]] const Part* PartOf(uint64_t digest) const {
    const auto found = parts_.find(digest);
    return found == parts_.end() ? nullptr : &found->second;
  }
  /// Null if SENSORS has not mentioned that module.
  [[nodiscard]] const std::string* NameOf(uint16_t module) {
    const auto at = Find(module);
    return at != names_.end() && at->first == module ? &at->second : nullptr;
  }

 private:
  using Names = std::vector<std::pair<uint16_t, std::string>>;
  /// Notes a name that can be one, if none is known of that module.
  void Add(uint16_t module, std::string_view name);
  /// The entry of that number, or the one before which it belongs.
  Names::iterator Find(uint16_t module) {
    return std::lower_bound(names_.begin(), names_.end(), module,
                            [](const auto& entry, uint16_t other) { return entry.first < other; });
  }

  Names names_;
  std::unordered_map<uint64_t, Part> parts_;
};

}  // namespace morphbus::bridge
