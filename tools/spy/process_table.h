#pragma once
// The processes of the runs that were heard, and the runs: what STATUS, TRANSFORM, HEALTH and CLOCK
// tell.

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>

#include "bridge/observe/run_message.h"
#include "tools/spy/heard_names.h"
#include "tools/spy/spy_snapshot.h"

namespace morphbus::tools {

/// All processes, 1024 at most, and all runs, 64 at most.
class ProcessTable : private bridge::RunMessageHandler {
 public:
  static constexpr size_t kMostProcesses = 1024;
  static constexpr size_t kMostRuns = 64;

  /// A message that was not heard before. What its type does not allow is passed over.
  void Take(const bridge::RunMessage& message, int64_t arrival_ns);

  /// Fills in processes and runs as of `now_ns`, on the clock of Take; nanoseconds.
  void Snapshot(int64_t now_ns, SpySnapshot* out) const;

 private:
  /// What is known of a process.
  struct Process {
    ProcessRow row;
    int64_t last_pose_ns = 0;  ///< When a TRANSFORM was read last.
  };
  /// What is known of a run.
  struct Run {
    RunRow row;
    int64_t last_ns = 0;  ///< Its last CLOCK.
    /// Times of arrival and sim times, microseconds, of the last seconds.
    std::deque<std::pair<int64_t, int64_t>> clocks;
  };

  bool Decodes(const bridge::RunMessage& message) override;
  void OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& clock) override;
  void OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) override;
  void OnTransform(const bridge::RunMessage& message, morphbus::transform_t&& transform) override;
  void OnHealth(const bridge::RunMessage& message, morphbus::health_t&& health) override;
  /// The process of this name, noted as heard; null if there is no place for it.
  Process* Note(std::string_view run, std::string_view process);

  // The message that is being read: when it came, and whose it is; null of CLOCK.
  int64_t now_ns_ = 0;
  Process* process_ = nullptr;
  HeardNames<Process> processes_{kMostProcesses};  ///< By RUN/PROCESS.
  HeardNames<Run> runs_{kMostRuns};
};

}  // namespace morphbus::tools
