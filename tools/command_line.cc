#include "tools/command_line.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "compiler/source/diagnostics.h"
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

/// The first argument, if it is meant as a subcommand and is none.
std::optional<std::string> UnknownCommand(const CLI::App& app, int argc, const char* const* argv) {
  if (argc < 2 || argv[1][0] == '-') return std::nullopt;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (sub->check_name(argv[1])) return std::nullopt;
  }
  return argv[1];
}

int ReportUnknownCommand(const CLI::App& app, const std::string& command) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  const std::string near = source::NearestName(command, names);
  return Unusable(fmt::format("there is no command '{}'{}; morphbus --help lists them", command,
                              near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near)));
}

/// A full disk or a closed pipe behind stdout must not pass for success. {fmt} throws where printf
/// would return.
int Perform(const Action& action) {
  int status = kUnusable;
  try {
    status = action();
  } catch (const std::system_error& error) {
    return Unusable(fmt::format("cannot write: {}", error.code().message()));
  }
  const bool flushed = std::fflush(stdout) == 0;
  const int reason = errno;
  if (status >= kUnusable || (flushed && std::ferror(stdout) == 0)) return status;
  return Unusable(flushed
                      ? "cannot write all of the standard output"
                      : fmt::format("cannot write to standard output: {}", std::strerror(reason)));
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CLI::App app("Morphbus: programs for modular robots, by role and not by module.", "morphbus");
  Action action;
  app.set_version_flag("--version", "morphbus " MORPHBUS_VERSION);
  app.require_subcommand(1);
  app.footer(kExamples);
  for (const auto add : {AddCheck, AddConnections, AddFk,     AddGraph,  AddEquivalent, AddVariants,
                         AddRoles, AddCompile,     AddDisasm, AddExport, AddFormat,     AddDraw,
                         AddRun,   AddSim,         AddModule, AddLog,    AddReplay,     AddSpy,
                         AddRuns,  AddCompare,     AddInfo,   AddVerify, AddRepair}) {
    add(app, &action);
  }
  if (const auto unknown = UnknownCommand(app, argc, argv)) {
    return ReportUnknownCommand(app, *unknown);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return ReportParseError(app, error);
  }
  return action ? Perform(action) : kUnusable;
}

}  // namespace morphbus::tools
