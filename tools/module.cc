// morphbus module: hands over to morphbus-module, the small program that is a module.

#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cerrno>
#include <cstring>

#include "tools/child_process.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

int BecomeModule(std::vector<std::string> arguments) {
  std::string program = ExecutableFolder() + "/morphbus-module";
  std::vector<char*> argv = {program.data()};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  return Failed(fmt::format("cannot start {}: {}", program, std::strerror(errno)));
}

}  // namespace

void AddModule(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand(
      "module", "One module of a run, for starting by hand (see morphbus-module --help)");
  sub->prefix_command();
  sub->set_help_flag();  // --help is the other program's
  sub->callback([sub, action] {
    *action = [arguments = sub->remaining()] { return BecomeModule(arguments); };
  });
}

}  // namespace morphbus::tools
