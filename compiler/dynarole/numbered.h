#pragma once
// Tables of an image in which equal entries share a number.

#include <map>
#include <vector>

namespace morphbus::dynarole {

/// Entries that are each there once, numbered from 0 in the order in which they were first needed.
template <typename T>
class Numbered {
 public:
  /// The number of this entry, which is added if it is not there.
  int NumberOf(const T& entry) {
    const auto [it, is_new] = numbers_.emplace(entry, static_cast<int>(all_.size()));
    if (is_new) all_.push_back(entry);
    return it->second;
  }
  /// The entries by their numbers.
  [[nodiscard]] const std::vector<T>& all() const { return all_; }

 private:
  std::vector<T> all_;
  std::map<T, int> numbers_;
};

}  // namespace morphbus::dynarole
