#pragma once
// Hash tables of texts in which a view of a text is looked up without making a string of it.

#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace morphbus {

/// Hashes strings and views of them alike: the standard says that std::hash gives both the same
/// number.
struct TextHash {
  /// By this name the tables know that they may be asked for a view (C++20).
  using is_transparent = void;
  size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
};

/// Values by text, in an order that differs from library to library: no output may depend on it.
template <class Value>
using TextTable = std::unordered_map<std::string, Value, TextHash, std::equal_to<>>;

}  // namespace morphbus
