// morphbus module: hands over to morphbus-module, the small program that is a module.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tools/commands/commands.h"
#include "tools/machine/child_process.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {
namespace {

/// The value of an option among the arguments, written `NAME VALUE` or `NAME=VALUE`; nothing if it
/// is not there.
std::optional<std::string> ValueOf(const std::string& name,
                                   const std::vector<std::string>& arguments) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i].starts_with(name + "=")) return arguments[i].substr(name.size() + 1);
    if (arguments[i] == name) return i + 1 < arguments.size() ? arguments[i + 1] : "";
  }
  return std::nullopt;
}

/// A module of a run that is on this machine has its key, or none if the run is open, unless the
/// arguments say otherwise.
void AddKeyOfRun(std::vector<std::string>* arguments) {
  const std::optional<std::string> run = ValueOf("--run", *arguments);
  if (!run || ValueOf("--key", *arguments) || ValueOf("--open", *arguments)) return;
  const Result<RunEntry> entry = FindRun(*run);
  if (!entry) return;
  // A run has its key before it can be found, so that one without is open.
  const std::string key = KeyPath(entry->folder);
  if (access(key.c_str(), F_OK) == 0) {
    arguments->insert(arguments->end(), {"--key", key});
  } else {
    arguments->push_back("--open");
  }
}

/// Replaces this process: a parent that watches its id then watches the module. It returns only if
/// the program cannot be started.
int BecomeModule(std::vector<std::string> arguments) {
  Result<std::string> program = ModuleProgram();
  if (!program) return Failed(program.error().message);
  AddKeyOfRun(&arguments);
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
