#pragma once
// What is sound in a damaged or cut log, as a log of its own.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "logger/log/event_log.h"

namespace morphbus::logger {

/// What RepairLog() did and found, for `repair` to print.
struct RepairReport {
  /// Events copied to the new log.
  int64_t events_kept = 0;
  /// Size of the input (decompressed, if it is compressed) less that of the output, in bytes.
  uint64_t bytes_dropped = 0;
  /// What was wrong with the input, in order of the file; at most 1000 findings are kept.
  std::vector<LogFinding> findings;
  /// All findings, those beyond 1000 included.
  int64_t num_findings = 0;
};

/// Copies every sound event of `in_path` to `out_path`, numbered anew, timestamps kept. An event on
/// a channel of ours is sound if its payload also fits its CRC and our protocol; of other channels
/// nothing is known but the framing. Returns what was wrong with the input. An END event is copied
/// as it is, so a log that lost events stays visibly incomplete. Fails, and then leaves neither
/// `out_path` nor a part of it and `in_path` as it is, if that cannot be read or holds no sound
/// event, if `out_path` cannot be written (EventLogWriter), or if writing it, or
/// `out_path`.partial, would overwrite `in_path`.
Result<RepairReport> RepairLog(const std::string& in_path, const std::string& out_path);

}  // namespace morphbus::logger
