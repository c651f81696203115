#include "tools/sweep/engine.h"

#include <fmt/format.h>

#include "compiler/base/text.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/child_process.h"
#include "tools/machine/program_output.h"
#include "tools/machine/wall_clock.h"
#include "tools/sweep/chunk_stream.h"
#include "tools/sweep/local_engine.h"
#include "tools/sweep/slurm_engine.h"
#include "tools/sweep/ssh_engine.h"

namespace morphbus::tools {

Result<std::string> BinaryOf(const EngineSettings& settings, const std::string& of_host) {
  if (!of_host.empty()) return of_host;
  if (!settings.binary.empty()) return settings.binary;
  const std::string own = OwnProgram();
  // The kernel's own name for it means another program elsewhere.
  if (!own.starts_with("/proc/")) return own;
  return Fail(
      "this program was replaced since it started: start it again, or say [engine] binary = \"…\"");
}

namespace {

/// A program that has not said after so long what it is, is none that runs rows, s.
constexpr double kAnswerSeconds = 60;

/// Whether another program than this one may run rows in its place.
EngineResult CheckBinary(const std::string& binary) {
  // With nothing to do it says what it is and ends.
  WakingTimer timer;
  const Result<ProgramOutput> said = RunProgram({binary, "sweep", "worker"}, [&timer] {
    return CaughtSignal() == 0 && timer.seconds() < kAnswerSeconds;
  });
  if (!said) return NoEngine(said.error().message);
  const Result<StreamHello> hello = ReadHello(said->output.substr(0, said->output.find('\n')));
  if (!hello) {
    const std::string last = EscapeControl(LastLine(said->errors));
    return NoEngine(fmt::format("{} is no morphbus that runs rows{}", binary,
                                last.empty() ? "" : fmt::format(" ({})", last)));
  }
  const std::string difference = BuildDifference(hello->version, hello->arithmetic);
  if (!difference.empty()) return NoEngine(fmt::format("{}: {}", binary, difference));
  return {};
}

}  // namespace

EngineResult RunByEngine(const EngineOptions& options, RowSource* source) {
  if (options.settings.kind == EngineKind::kSlurm) return RunOnSlurm(options, source);
  if (options.settings.kind == EngineKind::kSsh) return RunOverSsh(options, source);
  const int jobs = options.jobs > 0 ? options.jobs : ProcessorCount();
  std::string binary;
  if (!options.settings.binary.empty()) {
    Result<std::string> found = FindProgram(options.settings.binary);
    if (!found) return NoEngine(found.error().message);
    binary = std::move(*found);
    if (EngineResult fits = CheckBinary(binary); !fits) return fits;
  }
  const Result<void> run = RunLocally({jobs, options.timeout_s, binary}, source);
  if (!run) return Fail(run.error().message);
  return {};
}

}  // namespace morphbus::tools
