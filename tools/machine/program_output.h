#pragma once
// Other people's programs: where they are, and what they say.

#include <functional>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::tools {

/// The path of the program of this name, as a shell would find it ($PATH). Fails, saying so, if
/// there is none.
Result<std::string> FindProgram(const std::string& name);

/// How a program ended, and what it said.
struct ProgramOutput {
  /// Exit status, or 128 + signal.
  int status = 0;
  std::string output, errors;
};

/// Runs a program to its end, with nothing on its stdin; argv[0] is its name. `go_on` is asked
/// several times a second: where it says false the program is killed, as where it says more than
/// 64 MB. Fails if the program cannot be started, or was killed so.
Result<ProgramOutput> RunProgram(std::vector<std::string> argv, const std::function<bool()>& go_on);

/// The last line of a text that is not empty, for a message.
std::string LastLine(const std::string& text);

}  // namespace morphbus::tools
