#pragma once
// The samples of a run while its log is read. A recording by another tool may have its messages in
// any order, so that a series is only put into order of time when all of it is there.

#include <cstdint>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/world_t.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/observe/run_message.h"
#include "compiler/base/text_hash.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// Gathers samples by module and by sim time, and becomes the series of a RunLog in the end. Times
/// are µs of sim time since the run's start. What comes twice counts once. Of TRANSFORM only single
/// fields are read, for poses are most of a log.
class SeriesCollector : public bridge::RunMessageHandler {
 public:
  /// The series of a module, empty when it is first heard of. The reference is valid until
  /// Finish().
  ModuleSeries& Module(std::string_view name);

  // A message that is sound becomes samples. Bodies of one instant come in several of WORLD.
  bool Decodes(const bridge::RunMessage& message) override;
  void OnChecked(const bridge::RunMessage& message) override { TakeTransform(message, false); }
  void OnSensors(const bridge::RunMessage& message, morphbus::sensors_t&& sensors) override;
  void OnActuator(const bridge::RunMessage& message, morphbus::actuator_t&& actuator) override;
  void OnWorld(const bridge::RunMessage& message, morphbus::world_t&& world) override;
  /// A TRANSFORM, by its bytes. `only_changes`: it is left out unless a role is taken with it or it
  /// is the first with poses after that.
  void TakeTransform(const bridge::RunMessage& message, bool only_changes);
  /// What a module reported of itself; its faults and printed lines are dropped. A
  /// report like the one before it is left out if it tells of traced fields, as that is why it
  /// came, or with `only_changes`.
  void TakeStatus(std::string_view module, int64_t time_us, morphbus::status_t&& status,
                  bool only_changes);
  /// The values of traced fields that a module's report has.
  void TakeTraces(std::string_view module, int64_t time_us, const morphbus::status_t& status);
  /// A control tick began at this time; one that is told of twice counts once.
  void AddTick(int64_t time_us) { ticks_.insert(time_us); }
  /// How many control ticks were told of.
  [[nodiscard]] int64_t num_ticks() const { return static_cast<int64_t>(ticks_.size()); }

  /// Moves all that was gathered to `log`: each series in order of time, the modules in the order
  /// of `log->robot`, which must be set before if the log has a model. Nothing is left here.
  void Finish(RunLog* log);
  /// Moves the samples before that time to `log`, in place of those of sensors, poses, commands and
  /// world that it has; what is later stays here, and what is of modules that the log does not know
  /// is dropped.
  void MoveBefore(int64_t end_us, RunLog* log);

 private:
  TextTable<ModuleSeries> modules_;
  std::vector<WorldSample> world_;
  std::set<int64_t> ticks_;
};

}  // namespace morphbus::logger
