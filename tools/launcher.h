#pragma once
// Starts a run's processes, watches them, and makes sure that all of them end.

#include <list>
#include <optional>
#include <string>
#include <vector>

#include "tools/child_process.h"
#include "tools/control_link.h"
#include "tools/run_outcome.h"
#include "tools/run_plan.h"
#include "tools/run_registry.h"
#include "tools/wall_clock.h"

namespace morphbus::tools {

/// One sim, one process a module and a logger, on LCM. None outlives the launcher, however it ends.
class Launcher {
 public:
  /// @param log  path of the log to write. All arguments outlive the launcher.
  Launcher(const RunPlan& plan, const RunOptions& options, const RunDirectory& directory,
           std::string log);

  /// Runs until the run is over, a process fails, or a signal ends it. A process that dies ends the
  /// run at once: it is named in `error`, the log is closed and kept, the others are stopped.
  RunOutcome Run();

 private:
  Result<void> WriteInputs();
  Result<void> StartAll();
  Result<void> StartModule(size_t module);
  Result<ControlLink> StartLinked(const std::string& name, std::vector<std::string> argv,
                                  int death_signal);
  void Watch();
  void TakeMessages();
  void CheckChildren();
  void CheckPatience();
  void Fail(const std::string& error);
  void StopAll();
  void AwaitEnd(double seconds);
  [[nodiscard]] bool AllEnded() const;
  ChildProcess* Find(const std::string& name);

  const RunPlan& plan_;
  const RunOptions& options_;
  const RunDirectory& directory_;
  std::list<ChildProcess> children_;
  std::optional<ControlLink> sim_;
  std::optional<ControlLink> log_;
  RunOutcome outcome_;
  bool sim_reported_ = false;
  bool log_reported_ = false;
  bool interrupted_ = false;
  WallTimer since_interrupted_;
  std::string first_leaver_;  ///< Who ended, without an error, before the simulator's report.
  WallTimer since_left_;
};

}  // namespace morphbus::tools
