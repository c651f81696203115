#include "tools/base/json.h"

#include <fmt/format.h>

namespace morphbus::tools {

// Two spaces a level are what jq prints too, so that outputs can be compared as text.
void PrintJson(const Json& json) { fmt::print("{}\n", JsonText(json, 2)); }

}  // namespace morphbus::tools
