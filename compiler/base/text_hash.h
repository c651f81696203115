#pragma once
// Hash tables of texts in which a view of a text is looked up without making a string of it.

#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace morphbus {

/// Hashes strings and views of them alike.
struct TextHash {
  using is_transparent = void;
  size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
};

/// Values by text, in no order.
template <class Value>
using TextTable = std::unordered_map<std::string, Value, TextHash, std::equal_to<>>;

}  // namespace morphbus
