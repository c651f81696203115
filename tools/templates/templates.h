#pragma once
// The files that `morphbus new` begins with, built in.

#include <string_view>

namespace morphbus::tools {

/// The text of tools/templates/NAME; empty if there is none.
std::string_view TemplateText(std::string_view name);

}  // namespace morphbus::tools
