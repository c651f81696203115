#include "tools/base/json.h"

#include "tools/base/print.h"

namespace morphbus::tools {

// Two spaces a level are what jq prints too, so that outputs can be compared as text.
void PrintJson(const Json& json) { Print("{}\n", JsonText(json, 2)); }

}  // namespace morphbus::tools
