#include "tools/command_line.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"

namespace morphbus::tools {
namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  morphbus check models/mtran.m3l\n"
    "  morphbus roles models/mtran.m3l models/programs/quadruped.dyn --robot quadruped\n"
    "  morphbus run models/mtran.m3l models/programs/quadruped.dyn --robot quadruped \\\n"
    "      --seconds 30 --isolate --log walk.log\n"
    "  morphbus compare walk.log other.log --report report.html\n"
    "\n"
    "Exit status: 0 done; 1 the answer is no; 2 unusable input or options; 3 a process failed.";

/// Says what is wrong with the options; help and version are no errors.
int ReportParseError(const CLI::App& app, const CLI::ParseError& error) {
  const auto status = static_cast<CLI::ExitCodes>(error.get_exit_code());
  if (status == CLI::ExitCodes::Success) return app.exit(error);
  std::string command = "morphbus";
  for (const CLI::App* sub : app.get_subcommands()) command += " " + sub->get_name();
  return Unusable(fmt::format("{} (see {} --help)", error.what(), command));
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CLI::App app("Morphbus: programs for modular robots, by role and not by module.", "morphbus");
  Action action;
  app.set_version_flag("--version", "morphbus " MORPHBUS_VERSION);
  app.require_subcommand(1);
  app.footer(kExamples);
  for (const auto add : {AddCheck, AddConnections, AddFk, AddGraph, AddRoles, AddCompile, AddDisasm,
                         AddExport, AddDraw, AddRun, AddSim, AddModule, AddLog, AddReplay, AddSpy,
                         AddRuns, AddCompare, AddInfo, AddVerify}) {
    add(app, &action);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return ReportParseError(app, error);
  }
  return action ? action() : kUnusable;
}

}  // namespace morphbus::tools
