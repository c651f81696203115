#pragma once
// Where the program's own data is.

#include <string>

namespace morphbus::tools {

/// share/morphbus/NAME beside the folder of the running program, where the build leaves what is no
/// program: the monitor's page, the scripts of reports. It need not be there.
std::string ShareFolder(const std::string& name);

}  // namespace morphbus::tools
