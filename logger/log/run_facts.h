#pragma once
// What `info` and `verify` say of a log: run, channels with counts, rates and losses, faults,
// damage.

#include <cstdint>
#include <map>
#include <morphbus/health_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/description/described_run.h"
#include "compiler/base/text.h"
#include "compiler/dynarole/parameters.h"
#include "logger/log/deployments.h"
#include "logger/log/docking_changes.h"
#include "logger/log/ended_tasks.h"
#include "logger/log/event_log.h"
#include "logger/log/program_facts.h"

namespace morphbus::logger {

/// One channel of the file, counted by Loader (run_log.cc).
struct ChannelFacts {
  /// Full name, control characters made visible.
  std::string channel;
  /// Events in the file, repetitions and damaged ones included.
  int64_t events = 0;
  /// Distinct messages among them; for channels of other runs and programs, all events.
  int64_t messages = 0;
  /// Payload bytes of all events.
  int64_t bytes = 0;
  /// Wall clock of the first and the last event, microseconds since 1970.
  int64_t first_us = 0;
  int64_t last_us = 0;
  /// Messages that came again, byte for byte.
  int64_t duplicates = 0;
  /// Messages that are missing: gaps in the sequence numbers, and those that other messages
  /// promise.
  int64_t lost = 0;
  /// Sequence number of the first one that is missing; -1 if none is.
  int64_t first_lost = -1;
  /// Messages that did not decode: wrong CRC, version, size, values or model.
  int64_t bad = 0;
  /// True for a channel of the run that was read.
  bool ours = false;
  /// True if its messages count for the run's hash.
  bool hashed = false;
  /// XXH3 (64 bits) of the payloads: in order of their numbers if `hashed`, else in the file's.
  uint64_t hash = 0;
  /// Sim time between the first and the last message, seconds.
  double sim_seconds = 0.0;
  /// Whether END lists the same count and hash; none if END is missing or unreadable, or does not
  /// list a channel outside the hash.
  std::optional<bool> matches_end;
};

/// A place where the log itself is wrong.
struct LogDamage {
  /// What is wrong, one sentence for people.
  std::string what;
  /// Byte of the file; 0 if the damage has no one place.
  uint64_t offset = 0;
  /// Sim time (µs) up to which the log was whole: what it says until then can be trusted.
  int64_t time_us = 0;
};

/// What became of the END event, by which a log vouches for its own content.
enum class EndState {
  /// There is none: the log was cut.
  kMissing,
  /// There is one, and it does not decode.
  kUnreadable,
  /// It decodes, and the count or hash of a channel, or the run's hash or name, is another.
  kMismatch,
  /// It decodes, and everything in it is true of the log.
  kVerified,
};

/// All that is told of a log besides its messages. LoadRunLog() fills it; `info`, `verify`, `run`
/// and the comparison print it. `run` is the run that was read.
struct LogFacts : bridge::DescribedRun {
  /// Of the program, with the values that the run began with; none without a description.
  std::vector<dynarole::ProgramParameter> parameters;
  std::string path;
  uint64_t file_bytes = 0;
  /// Whether the file was compressed with zstd; offsets are those of the decompressed log.
  bool compressed = false;
  /// Size of the log itself: `file_bytes`, or what the file decompresses to.
  uint64_t log_bytes = 0;
  int64_t events = 0;
  /// Wall clock of the first and the last event, microseconds since 1970.
  int64_t first_us = 0;
  int64_t last_us = 0;
  /// Further runs in the same file, which were not read.
  std::vector<std::string> other_runs;
  /// Control ticks that a CLOCK dates; in real time, where some of those are lost, all before the
  /// CLOCK that ends the run.
  int64_t ticks = 0;
  /// Length of a control tick, µs of sim time; 0 if no CLOCK was seen.
  int32_t tick_us = 0;
  /// Sim time covered, in seconds: ticks times tick length.
  double seconds = 0.0;
  /// Every channel of the file by name, those of other runs too; 10,000 and a few at most.
  std::map<std::string, ChannelFacts> channels;
  /// Computed from the log, 32 hexadecimal digits, as in END.
  std::string run_hash;
  EndState end_state = EndState::kMissing;
  /// The END event, if it decodes.
  std::optional<morphbus::log_end_t> end;
  /// The last HEALTH of each process: what it received, lost and asked for again.
  std::map<std::string, morphbus::health_t> health;
  /// Of runs in real time: what the simulator said last of each module that missed a deadline.
  std::map<std::string, morphbus::lateness_t> lateness;
  /// The first RunLogOptions::max_faults faults; num_faults counts all.
  std::vector<FaultFact> faults;
  int64_t num_faults = 0;
  /// Which tasks had ended by a fault when the log ends.
  EndedFacts ended;
  /// The first RunLogOptions::max_faults lines that the program printed; num_prints counts all,
  /// also those that modules dropped.
  std::vector<PrintFact> prints;
  int64_t num_prints = 0;
  /// Commands that people gave to the run, and the ticks at which CLOCK named them, in their order.
  std::multimap<int64_t, std::string> commands;
  /// The deployments among them, in their order.
  std::vector<DeploymentFact> deployments;
  /// Whose commands name a program that is neither the description's nor deployed: one sentence;
  /// empty if nobody's do, or without a description.
  std::string foreign_program;
  /// The first 1000 connections of the robot that opened or closed; num_dockings counts all.
  std::vector<DockingFact> dockings;
  int64_t num_dockings = 0;
  /// The tick after the last one, and why the run ended, as CLOCK says; -1 and empty if the log
  /// does not hold the run's end.
  int64_t end_tick = -1;
  std::string end_reason;
  /// Modules that the run went on without, and from which sim time on (µs).
  std::map<std::string, int64_t> lost_modules;
  /// What the reader found in the file's framing, harmless things included.
  std::vector<LogFinding> findings;
  /// The first 1000 places of damage, in framing, payloads and numbers; num_damage counts all.
  std::vector<LogDamage> damage;
  int64_t num_damage = 0;
  /// Why the description or its model could not be used, or that there is none; and whose messages
  /// name a program that it does not.
  std::vector<std::string> problems;

  /// True if nothing is missing or wrong: no damage, no losses, END there and its hashes right. It
  /// says nothing of whether the run ended well (END's `clean`).
  [[nodiscard]] bool whole() const;
  /// Missing messages over all channels.
  [[nodiscard]] int64_t lost() const;
  /// Counts a place of damage, and keeps it if there are fewer than 1000. `offset` is a byte of the
  /// file, `time_us` the sim time (µs) up to which the log was whole.
  void AddDamage(std::string what, uint64_t offset, int64_t time_us);
  /// Compares what `end` vouches for with the channels, `run` and `run_hash`, which must be
  /// complete; sets `end_state`, and `matches_end` of each channel that it concerns. `end_seen`
  /// says whether the log has an END event at all, be it unreadable.
  void VerifyEnd(bool end_seen);
};

/// The name in JSON: "missing", "unreadable", "mismatch" or "verified".
const char* EndStateName(EndState state);

/// Hertz of `count` events spread evenly over `seconds`; 0 for fewer than two.
double EventRate(int64_t count, double seconds);
/// The last ledger of each process, by name.
nlohmann::json HealthJson(const LogFacts& facts);
/// Modules that missed deadlines in real time, by name: `missed`, `late`, `worst_us`.
nlohmann::json LatenessJson(const LogFacts& facts);
/// One of the `findings` of `info --json`; offsets are bytes of the file.
nlohmann::json FindingJson(const LogFinding& finding);
/// The printed lines, with time (s of sim time), module, role, text and source line.
nlohmann::json PrintsJson(const LogFacts& facts);
/// The object of `info --json` and `verify --json`; times in it are seconds, and docs/log.md has
/// the keys.
nlohmann::json FactsJson(const LogFacts& facts);

}  // namespace morphbus::logger
