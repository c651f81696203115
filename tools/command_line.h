#pragma once
// The command line as a function, so that tests can drive it in-process.

namespace morphbus::tools {

/// Parses and runs one `morphbus` command. Returns the exit status (docs/cli.md).
int RunCommandLine(int argc, const char* const* argv);

}  // namespace morphbus::tools
