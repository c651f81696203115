#include "tools/commands/command_line.h"

#include <fmt/format.h>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The end of `morphbus --help`.
constexpr const char* kExamples =
    "Examples:\n"
    "  morphbus check models/mtran.m3l\n"
    "  morphbus roles models/mtran.m3l models/programs/quadruped.dyn --robot quadruped\n"
    "  morphbus run models/mtran.m3l models/programs/quadruped.dyn --robot quadruped \\\n"
    "      --seconds 30 --isolate --log walk.log\n"
    "  morphbus compare walk.log other.log --report report.html\n"
    "\n"
    "Exit status: 0 done; 1 the answer is no; 2 unusable input or options; 3 a process failed.";

/// A full disk or a closed pipe behind stdout must not pass for success. {fmt} throws where printf
/// would return.
int Perform(const Action& action) {
  // The action prints as it goes; what fails in it otherwise it reports itself.
  int status = kUnusable;
  try {
    status = action();
  } catch (const std::system_error& error) {
    return Unusable(fmt::format("cannot write: {}", error.code().message()));
  }
  // Output is buffered: that it did not fit the disk may show only now.
  const bool flushed = std::fflush(stdout) == 0;
  const int reason = errno;
  // A command that failed has said why; a second message would hide the first.
  if (status >= kUnusable || (flushed && std::ferror(stdout) == 0)) return status;
  return Unusable(flushed
                      ? "cannot write all of the standard output"
                      : fmt::format("cannot write to standard output: {}", std::strerror(reason)));
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CommandLine line("morphbus", "Morphbus: programs for modular robots, by role and not by module.",
                   kExamples, "morphbus " MORPHBUS_VERSION);
  // Each function adds one subcommand. The help lists them in this order: models and programs,
  // running robots, logs.
  for (const auto add :
       {AddCheck,   AddConnections, AddFk,     AddGraph,  AddEquivalent, AddVariants, AddRoles,
        AddCompile, AddDisasm,      AddExport, AddFormat, AddDraw,       AddRun,      AddSim,
        AddModule,  AddLog,         AddReplay, AddSpy,    AddMonitor,    AddControl,  AddRuns,
        AddDoctor,  AddCompare,     AddInfo,   AddVerify, AddRepair,     AddReport,   AddConvert}) {
    add(&line);
  }
  if (const std::optional<int> status = line.Parse(argc, argv)) return *status;
  return Perform(line.action());
}

}  // namespace morphbus::tools
