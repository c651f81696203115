#pragma once
// What the spy knows at one moment, as plain values: what its table, its JSON and its screen show.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/spy/arrival_stats.h"

namespace morphbus::tools {

/// A channel. Counts are since the spy began to listen.
struct ChannelRow {
  std::string channel;
  std::string type;          ///< Full name; "" while no message's type was known.
  uint64_t fingerprint = 0;  ///< The first eight bytes of the last message; 0 if it had fewer.
  bool ours = false;         ///< By its name, a channel of a run.
  int64_t messages = 0;
  int64_t bytes = 0;        ///< Of payload, without the headers of LCM and UDP.
  size_t last_bytes = 0;    ///< Of the last message.
  int64_t lost = 0;         ///< By the numbers in our messages' headers; others' have none.
  int64_t bad = 0;          ///< Ours that are damaged, others' that do not fit their type.
  int64_t unauthentic = 0;  ///< Of these, messages of a run whose key is known that have it not.
  int64_t undecodable = 0;  ///< Bad, or of a type that nobody named.
  ArrivalFigures arrivals;
};

/// How punctual a module is in real time, as the simulator tells it: ticks that were over before
/// its answer came, how many of those answers came late, and the latest of them, µs after its tick.
struct ModuleLateness {
  int64_t missed = 0, late = 0, worst_us = 0;
};

/// A process of a run: a module, the simulator (SIM) or the logger (LOG). What is told by messages
/// that have not come yet is absent.
struct ProcessRow {
  std::string run;
  std::string process;
  std::string type;  ///< Of the module.
  std::string role;  ///< "" while it has none.
  bool is_module = false;
  bool has_status = false;          ///< Whether a STATUS has come, which tells what follows.
  bool frozen = false;              ///< It has changed its role too often, and keeps it.
  std::vector<std::string> labels;  ///< "hip: joint 1".
  std::vector<int> joint_signs;     ///< +1, -1, or 0 without a convention, by joint.
  std::vector<std::string> tasks;   ///< What it runs, with the line.
  /// Behaviors of the role held that a fault has ended, and whether a startup of it has ended so.
  int ended_behaviors = 0;
  bool startup_ended = false;
  /// What it held when it was inspected last, a line for each field and call; and when, as text.
  std::vector<std::string> held;
  std::string held_at;
  /// Sim time since the root sent what the module's poses rest on, seconds; absent without a pose.
  std::optional<double> pose_age_s;
  bool pose_stale = false;               ///< The root has gone silent.
  int hops = 0;                          ///< Modules between the root and this one.
  int64_t faults = 0;                    ///< Since the spy began to listen.
  std::vector<std::string> last_faults;  ///< The newest 8, oldest first.
  bool has_health = false;
  /// Processor time a second of wall time, 1: one core; absent before the second HEALTH.
  std::optional<double> cpu;
  int64_t max_rss_kb = 0;  ///< Largest resident memory so far, KiB.
  // Its ledger (bridge::Ledger), as it was last told.
  int64_t received = 0, sent = 0, lost = 0, resent = 0, asked = 0, bad = 0, restarts = 0;
  int64_t missed_deadlines = 0;
  std::string first_refused;
  std::optional<ModuleLateness> lateness;
};

/// A run, as its CLOCK tells.
struct RunRow {
  std::string run;
  int64_t tick = 0;         ///< Of the last CLOCK.
  int64_t sim_time_us = 0;  ///< Of that tick.
  int64_t tick_us = 0;      ///< Length of a tick, µs of sim time.
  /// Sim time a second of wall time over the last seconds; absent before the second CLOCK.
  std::optional<double> speed;
  /// What a command asked for, that CLOCK named; 0: as fast as possible.
  std::optional<double> asked_speed;
  bool paused = false;  ///< By a command that CLOCK named.
  bool ended = false;   ///< CLOCK said END.
  std::string end_reason;
  double silent_s = 0.0;  ///< Since its last CLOCK.
};

/// Everything at one moment.
struct SpySnapshot {
  double seconds = 0.0;              ///< Since the first message.
  std::vector<ChannelRow> channels;  ///< In order of name.
  std::vector<ProcessRow>
      processes;             ///< In order of run; modules in order of name and number, then others.
  std::vector<RunRow> runs;  ///< In order of name.
  /// Messages on channels that found no place in a full table, and channels that had to make room.
  int64_t untold_messages = 0;
  int64_t dropped_channels = 0;
  /// What the listener itself missed (bridge::TapLosses).
  int64_t missing = 0, overflowed = 0, incomplete = 0, not_lcm = 0;

  /// The channel, process or run of this name; null if there is none.
  [[nodiscard]] const ChannelRow* Channel(const std::string& name) const;
  [[nodiscard]] const ProcessRow* Process(const std::string& run, const std::string& name) const;
  [[nodiscard]] const RunRow* Run(const std::string& name) const;
};

}  // namespace morphbus::tools
