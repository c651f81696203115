#pragma once
// Reads the series of a log stretch by stretch, so that a log of any length needs little memory.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/wire/channels.h"
#include "compiler/base/text_hash.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"

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
  /// What a channel carries, if its samples are wanted.
  struct Wanted {
    bool any = false;
    bridge::Topic topic = bridge::Topic::kClock;
    /// Index into RunLog::modules; -1 for the simulator's channels.
    int module = -1;
  };

  SeriesReader(RunLog* log, std::unique_ptr<EventLogReader> reader);
  const Wanted& WantedOf(std::string_view channel);
  void Take(const LogEvent& event, const Wanted& wanted);
  void TakeSensors(const LogEvent& event);
  void TakeTransform(const LogEvent& event, int module);
  void TakeActuator(const LogEvent& event, int module);
  void TakeWorld(const LogEvent& event);

  RunLog& log_;
  std::unique_ptr<EventLogReader> reader_;
  TextTable<Wanted> channels_;
  TextTable<int> modules_;
  /// Samples that were read and not installed yet, by index into RunLog::modules.
  std::vector<ModuleSeries> ahead_;
  std::vector<WorldSample> world_ahead_;
  /// The latest sim time read, µs.
  int64_t now_us_ = -1;
  bool ended_ = false;
};

}  // namespace morphbus::logger
