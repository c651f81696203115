#pragma once
// The text of every lcmtypes/*.lcm, built in: goes into each run's description, so that a log can
// be decoded as long as it exists, and lets the spy decode messages.

#include <string>

namespace morphbus::tools {

/// All files, one after the other, each with its `package` line. CMake writes them into the source
/// of this function (lcm_sources.cc.in), so the text is that of the build.
std::string LcmSources();

}  // namespace morphbus::tools
