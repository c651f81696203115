#pragma once
// The JSON of the command line.

#include <nlohmann/json.hpp>
#include <string>

#include "tools/base/print.h"

namespace morphbus::tools {

/// JSON whose keys keep the order in which docs/cli.md lists them.
using Json = nlohmann::ordered_json;

/// `json` on one line, or indented by `indent` spaces a level if that is not negative. File names
/// are bytes and need not be UTF-8, which JSON must be: such bytes become U+FFFD here, where
/// nlohmann's own dump() would throw.
template <typename AnyJson>
std::string JsonText(const AnyJson& json, int indent = -1) {
  return json.dump(indent, ' ', false, AnyJson::error_handler_t::replace);
}

/// Prints one JSON object on stdout, indented as jq does it, with a line feed at its end.
inline void PrintJson(const Json& json) { PrintText(JsonText(json, 2) + "\n"); }

}  // namespace morphbus::tools
