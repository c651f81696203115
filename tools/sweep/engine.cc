#include "tools/sweep/engine.h"

#include "tools/machine/child_process.h"
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

EngineResult RunByEngine(const EngineOptions& options, RowSource* source) {
  if (options.settings.kind == EngineKind::kSlurm) return RunOnSlurm(options, source);
  if (options.settings.kind == EngineKind::kSsh) return RunOverSsh(options, source);
  const int jobs = options.jobs > 0 ? options.jobs : ProcessorCount();
  const Result<void> run = RunLocally({jobs, options.timeout_s}, source);
  if (!run) return Fail(run.error().message);
  return {};
}

}  // namespace morphbus::tools
