#pragma once
// The samples of a run while its log is read. A recording by another tool may have its messages in
// any order, so that a series is only put into order of time when all of it is there.

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "logger/log/run_log.h"

namespace morphbus::logger {

/// Gathers samples by module and by sim time, and becomes the series of a RunLog in the end. Times
/// are µs of sim time since the run's start.
class SeriesCollector {
 public:
  /// The series of a module, empty when it is first heard of. The reference is valid until
  /// Finish().
  ModuleSeries& Module(std::string_view name);
  /// What is known of the simulated world at a time: its bodies come in several messages.
  WorldSample& World(int64_t time_us);
  /// A control tick began at this time; one that is told of twice counts once.
  void AddTick(int64_t time_us) { ticks_.insert(time_us); }
  /// How many control ticks were told of.
  [[nodiscard]] int64_t num_ticks() const { return static_cast<int64_t>(ticks_.size()); }

  /// Moves all that was gathered to `log`: each series in order of time, the modules in the order
  /// of `log->robot`, which must be set before if the log has a model. Nothing is left here.
  void Finish(RunLog* log);

 private:
  std::map<std::string, ModuleSeries, std::less<>> modules_;
  std::map<int64_t, WorldSample> world_;
  std::set<int64_t> ticks_;
};

}  // namespace morphbus::logger
