// morphbus module: hands over to morphbus-module, the small program that is a module.

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "tools/commands/commands.h"
#include "tools/launch/child_process.h"

namespace morphbus::tools {
namespace {

/// Replaces this process: whoever watches its id then watches the module. It returns only if the
/// program cannot be started.
int BecomeModule(std::vector<std::string> arguments) {
  Result<std::string> program = ModuleProgram();
  if (!program) return Failed(program.error().message);
  std::vector<char*> argv = {program->data()};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  // The list of arguments ends in a null pointer, as execv demands.
  argv.push_back(nullptr);
  execv(program->c_str(), argv.data());
  return Failed(fmt::format("cannot start {}: {}", *program, std::strerror(errno)));
}

}  // namespace

void AddModule(CommandLine* line) {
  Subcommand sub =
      line->Add("module", "One module of a run, for starting by hand (see morphbus-module --help)");
  sub.PassArguments(BecomeModule);
}

}  // namespace morphbus::tools
