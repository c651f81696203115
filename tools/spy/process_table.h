#pragma once
// The processes of the runs that were heard, and the runs: what STATUS, TRANSFORM, HEALTH and CLOCK
// tell.

#include <cstdint>
#include <deque>
#include <morphbus/fault_t.hpp>
#include <morphbus/inspection_t.hpp>
#include <morphbus/status_t.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/observe/run_clock.h"
#include "bridge/observe/run_message.h"
#include "tools/spy/heard_names.h"
#include "tools/spy/spy_snapshot.h"

namespace morphbus::tools {

/// A fault as a sentence. The spy has no images of the run, so that it has numbers in place of
/// names.
std::string HeardFaultText(const morphbus::fault_t& wire);

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
  /// What is known of a process, and what its figures are computed from.
  struct Process {
    ProcessRow row;
    int64_t last_pose_ns = 0;    ///< When a TRANSFORM was read last.
    int64_t pose_age_ticks = 0;  ///< Below 0: without a pose.
    bool has_pose = false;
    int64_t health_wall_us = 0;                     ///< Of the last HEALTH; 0 before.
    int64_t health_cpu_us = 0;                      ///< Processor time that it had used by then.
    int64_t inspected_tick = -1;                    ///< Of the parts.
    std::vector<morphbus::inspection_t> inspected;  ///< Of an answer that is not whole yet.
  };
  /// What is known of a run.
  struct Run {
    std::string name;
    bridge::RunClock clock;
    int64_t last_ns = 0;  ///< Its last CLOCK.
    /// Times of arrival and sim times, microseconds, of the last seconds.
    std::deque<std::pair<int64_t, int64_t>> clocks;
  };

  bool Decodes(const bridge::RunMessage& message) override;
  void OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& clock) override;
  void OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) override;
  void OnTransform(const bridge::RunMessage& message, morphbus::transform_t&& transform) override;
  void OnHealth(const bridge::RunMessage& message, morphbus::health_t&& health) override;
  /// A part of what an inspected module tells.
  static void TakeInspection(const morphbus::status_t& status, Process* process);
  /// The process of this name, noted as heard; null if there is no place for it.
  Process* Note(std::string_view run, std::string_view process);

  // The message that is being read: when it came, and whose it is; null of CLOCK.
  int64_t now_ns_ = 0;
  Process* process_ = nullptr;
  HeardNames<Process> processes_{kMostProcesses};  ///< By RUN/PROCESS.
  HeardNames<Run> runs_{kMostRuns};
};

}  // namespace morphbus::tools
