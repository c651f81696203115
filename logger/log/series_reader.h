#pragma once
// Reads the series of a log stretch by stretch, so that a log of any length needs little memory.

#include <cstdint>
#include <memory>

#include "bridge/observe/run_channels.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"
#include "logger/log/series_collector.h"

namespace morphbus::logger {

/// Goes once through the file of a log that was loaded as an outline. ReadUntil() may run in a
/// thread of its own while somebody uses what Install() put into the log before.
class SeriesReader {
 public:
  /// Opens the log's file again. `log` is an outline (RunLogOptions::outline) and outlives the
  /// reader.
  static Result<std::unique_ptr<SeriesReader>> Open(RunLog* log);

  /// Reads on until all samples before sim time `end_us` (µs) are there; at the end of the file
  /// that is so for any time.
  void ReadUntil(int64_t end_us);
  /// Puts the samples before that time into the log's series, in place of those that are there.
  /// STATUS stays: an outline has all of it.
  void Install(int64_t end_us);

 private:
  SeriesReader(RunLog* log, std::unique_ptr<EventLogReader> reader);
  void Take(const LogEvent& event);

  RunLog& log_;
  std::unique_ptr<EventLogReader> reader_;
  bridge::RunChannels channels_;
  /// Samples that were read and not installed yet.
  SeriesCollector ahead_;
  /// The latest sim time read, µs.
  int64_t now_us_ = -1;
  bool ended_ = false;
};

}  // namespace morphbus::logger
