#include "tools/commands/command_line.h"

#include <fmt/format.h>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "compiler/base/version.h"
#include "compiler/source/diagnostics.h"
#include "sim/arithmetic.h"
#include "tools/base/print.h"
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

/// What decides whether two machines give a run the same hash: the build, and how it computes here.
std::string VersionAndArithmetic() {
  return fmt::format("morphbus {}, arithmetic {}", Version(), sim::ArithmeticFingerprint());
}

/// Carries the action out. What it cannot use it says itself; only the system's own words, as on a
/// working directory that is gone, come as exceptions.
int Perform(const Action& action) {
  try {
    return action();
  } catch (const std::system_error& error) {
    return Unusable(error.what());
  }
}

/// `status`, unless what was printed could not be written: then the result is lost, which a full
/// disk behind stdout must not let pass for success.
int WithResultWritten(int status) {
  // Output is buffered: that it did not fit the disk may show only now.
  const int reason = FlushResult();
  // A command that failed has said why; a second message would hide the first.
  if (reason == 0 || status >= kUnusable) return status;
  // A reader that went away has what it wanted, as `| head` has: the status says that it was not
  // all.
  if (reason == EPIPE) return kUnusable;
  return Unusable(fmt::format("cannot write to standard output: {}", std::strerror(reason)));
}

}  // namespace

int RunCommandLine(int argc, const char* const* argv) {
  CommandLine line("morphbus", "Morphbus: programs for modular robots, by role and not by module.",
                   kExamples, VersionAndArithmetic);
  // Each function adds one subcommand. The help lists them in this order: models and programs,
  // running robots, logs.
  for (const auto add :
       {AddCheck,     AddConnections, AddFk,        AddGraph,  AddEquivalent, AddVariants,
        AddRoles,     AddCompile,     AddDisasm,    AddExport, AddFormat,     AddDraw,
        AddBuild,     AddNew,         AddLsp,       AddRun,    AddSweep,      AddOptimise,
        AddBenchmark, AddSim,         AddModule,    AddLog,    AddReplay,     AddSpy,
        AddMonitor,   AddControl,     AddRuns,      AddDoctor, AddCompare,    AddInfo,
        AddVerify,    AddRepair,      AddReproduce, AddReport, AddConvert,    AddCompletion,
        AddManual}) {
    add(&line);
  }
  if (const std::optional<int> status = line.Parse(argc, argv)) return WithResultWritten(*status);
  return WithResultWritten(Perform(line.action()));
}

}  // namespace morphbus::tools
