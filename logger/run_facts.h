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

#include "logger/event_log.h"

namespace morphbus::logger {

/// One channel of the log.
struct ChannelFacts {
  std::string channel;
  int64_t events = 0;    ///< Events in the file.
  int64_t messages = 0;  ///< Distinct messages among them; foreign channels: all events.
  int64_t bytes = 0;     ///< Payload bytes of all events.
  int64_t first_us = 0;  ///< Wall clock of the first and last event, µs since 1970.
  int64_t last_us = 0;
  int64_t duplicates = 0;           ///< Sent again, byte for byte.
  int64_t lost = 0;                 ///< Sequence numbers missing below the last one.
  int64_t first_lost = -1;          ///< Sequence number of the first gap; -1: none.
  int64_t bad = 0;                  ///< Did not decode: CRC, version, size, values.
  bool ours = false;                ///< A channel of the run.
  bool hashed = false;              ///< Counts for the run's hash.
  uint64_t hash = 0;                ///< Hashed channels: XXH3 of the payloads in sequence order.
  double sim_seconds = 0.0;         ///< Sim time between the first and the last message.
  std::optional<bool> matches_end;  ///< Count and hash agree with the END event's, if it lists it.
};

/// Something wrong with the log itself.
struct LogDamage {
  std::string what;     ///< One sentence.
  uint64_t offset = 0;  ///< Byte in the file.
  int64_t time_us = 0;  ///< Sim time up to which the log was whole.
};

/// A fault that a module reported.
struct FaultFact {
  int64_t time_us = 0;
  std::string module;
  std::string role;
  int code = 0;
  std::string text;
  std::string function;
  int line = 0;
};

enum class EndState {
  kMissing,     ///< The log was cut.
  kUnreadable,  ///< There is one, but it does not decode.
  kMismatch,    ///< Count or hash of a channel is not what END says.
  kVerified,
};

/// See file comment.
struct LogFacts {
  std::string path;
  uint64_t file_bytes = 0;
  int64_t events = 0;
  int64_t first_us = 0;  ///< Wall clock of the first and last event.
  int64_t last_us = 0;
  std::string run;
  std::vector<std::string> other_runs;  ///< Further runs in the same file; not read.
  int64_t ticks = 0;                    ///< CLOCKs of control ticks.
  int32_t tick_us = 0;
  double seconds = 0.0;  ///< Sim time covered, ticks times tick length.
  std::map<std::string, ChannelFacts> channels;
  std::string run_hash;  ///< Computed from the log, 32 hexadecimal digits.
  EndState end_state = EndState::kMissing;
  std::optional<morphbus::log_end_t> end;
  std::map<std::string, morphbus::health_t> health;  ///< Last of each process.
  std::vector<FaultFact> faults;                     ///< At most 1000.
  int64_t num_faults = 0;
  std::vector<LogFinding> findings;  ///< Of the file's framing, harmless ones included.
  std::vector<LogDamage> damage;     ///< At most 1000; framing, payloads, numbers.
  int64_t num_damage = 0;
  std::vector<std::string> problems;  ///< Why the description or model could not be used.

  // From the description; empty or 0 without one.
  bool has_description = false;
  std::string model_file, robot, program_file, mode, build, started, root_module, world_hash;
  uint64_t model_hash = 0, program_hash = 0, seed = 0;
  double loss = 0.0;

  /// True if nothing is missing or wrong: no damage, no losses, END there and its hashes right.
  [[nodiscard]] bool whole() const;
  /// Missing sequence numbers over all channels of the run.
  [[nodiscard]] int64_t lost() const;
  /// Adds a damage entry, bounded.
  void AddDamage(std::string what, uint64_t offset, int64_t time_us);
};

/// "missing", "unreadable", "mismatch", "verified".
const char* EndStateName(EndState state);

/// Text for `morphbus info`, many lines.
std::string FactsText(const LogFacts& facts);
/// One line a problem, ending with a verdict line, for `morphbus verify`.
std::string VerifyText(const LogFacts& facts);
/// One of the `findings` of `info --json`.
nlohmann::json FindingJson(const LogFinding& finding);
/// The object of `info --json` and `verify --json`; keys in docs/log.md.
nlohmann::json FactsJson(const LogFacts& facts);

}  // namespace morphbus::logger
