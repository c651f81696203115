#pragma once
// A log made ready to be played from anywhere: its run, its length, and places to begin at.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bridge/outward/converter.h"
#include "compiler/base/result.h"

namespace morphbus::tools {

/// A place in a log, and all that the converter knew there.
struct LogCheckpoint {
  int64_t time_us = 0;  ///< Sim time.
  uint64_t offset = 0;  ///< Byte of the file from which on events are read.
  bridge::Converter converter;
};

/// What was learnt of a log when it was read once. It does not change.
struct LogIndex {
  std::string path;
  std::shared_ptr<const bridge::RunModel> run;
  int64_t disorder = 0;              ///< Of the file, as OrderedLogReader has it.
  int64_t begin_us = 0, end_us = 0;  ///< Sim time of the first and the last tick.
  /// In order of time; the first is the log's begin. 256 at most, evenly spread.
  std::vector<LogCheckpoint> checkpoints;
  /// What channels had said by then, with rates since the one before: serialized
  /// morphbus::Channels, in order of sim time (µs). 1024 at most, evenly spread; never empty.
  std::vector<std::pair<int64_t, std::string>> counts;
};

/// The model of the first run in a log, by the description in its INFO, which goes to
/// `description`, serialized.
Result<std::shared_ptr<const bridge::RunModel>> ReadLogModel(const std::string& path,
                                                             std::string* description);

/// Reads a log of that run. Fails if the file cannot be read or holds no tick of the run. Damage is
/// passed over. `source` and `text` are for the converter.
Result<std::shared_ptr<const LogIndex>> IndexLog(const std::string& path,
                                                 std::shared_ptr<const bridge::RunModel> run,
                                                 const std::string& source,
                                                 const bridge::ProgramText& text);

}  // namespace morphbus::tools
