#pragma once
// JSON as text. File names are bytes and need not be UTF-8, which JSON must be: such bytes become
// U+FFFD here, where nlohmann's own dump() would throw.

#include <nlohmann/json.hpp>
#include <string>

namespace morphbus::tools {

/// `json` on one line, or indented by `indent` spaces a level if that is not negative.
template <typename Json>
std::string JsonText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace morphbus::tools
