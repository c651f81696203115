#pragma once
// What the spy knows at one moment, as plain values: what its table, its JSON and its screen show.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridge/observe/process_state.h"
#include "bridge/observe/run_clock.h"
#include "tools/spy/arrival_stats.h"
#include "tools/spy/run_names.h"

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

/// A process of a run: a module, the simulator (SIM) or the logger (LOG), and what it has told
/// since the spy began to listen.
struct ProcessRow : bridge::ProcessState {
  std::string run;
  std::string process;
  bool is_module = false;
  /// Sim time since the root sent what the module's poses rest on, seconds; absent without a pose.
  std::optional<double> pose_age_s;
  /// `cpu` as its HEALTHs told it one after the other, oldest first; the last 60.
  std::vector<double> cpu_history;
};

/// A run.
struct RunRow {
  std::string run;
  bridge::RunClock clock;
  /// Sim time a second of wall time over the last seconds; absent before the second CLOCK.
  std::optional<double> speed;
  double silent_s = 0.0;  ///< Since its last CLOCK.
  RunNames names;         ///< By its description, if that was heard or is at hand.
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

  /// The channel or run of this name; null if there is none.
  [[nodiscard]] const ChannelRow* Channel(const std::string& name) const;
  [[nodiscard]] const RunRow* Run(const std::string& name) const;
};

}  // namespace morphbus::tools
