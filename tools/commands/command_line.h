#pragma once
// The command line as a function, so that tests can drive it in-process.

namespace morphbus::tools {

/// Parses and runs one `morphbus` command with the arguments of main(), argv[0] included. Returns
/// the exit status (docs/cli.md); whatever went wrong has then been said on stderr.
int RunCommandLine(int argc, const char* const* argv);

}  // namespace morphbus::tools
