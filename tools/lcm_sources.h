#pragma once
// The text of every lcmtypes/*.lcm, built in: goes into each run's description, so that a log can
// be decoded as long as it exists, and lets the spy decode messages.

#include <string>

namespace morphbus::tools {

/// All files, one after the other, each with its `package` line.
std::string LcmSources();

}  // namespace morphbus::tools
