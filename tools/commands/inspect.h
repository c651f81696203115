#pragma once
// morphbus control inspect: what modules of a running robot hold, from their STATUS.

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/bus/bus.h"
#include "bridge/lockstep/participant.h"
#include "bridge/observe/process_state.h"
#include "bridge/observe/run_message.h"
#include "tools/base/inspection_report.h"
#include "tools/control/controlled_run.h"

namespace morphbus::tools {

/// Collects the answers of modules. SENSORS says who was asked, STATUS what they say.
class InspectionListener : private bridge::RunMessageHandler {
 public:
  /// Listens from now on, so that no answer to a command that is given later is missed. `bus` and
  /// `run` outlive the listener.
  /// @param module  the one that will be asked; empty for all
  InspectionListener(bridge::Bus* bus, const ControlledRun& run, std::string module);

  /// Waits for the answers to a command that takes effect at `tick`, as long as the run has not got
  /// there, and then for some 5 s. Empty, or why not all have come; answers() has the others.
  /// `stop` ends the wait.
  std::string Await(int64_t tick, const bridge::TimeSource& time,
                    const std::function<bool()>& stop);

  /// What the modules said, in the order of the robot (InspectionJson).
  [[nodiscard]] Json answers() const;

 private:
  /// Whom SENSORS of a tick asks, as far as its parts have come.
  struct Asked {
    std::set<int16_t> parts;
    int16_t num_parts = 0;
    std::set<std::string> modules;
  };

  void Take(std::string_view channel, const uint8_t* data, size_t size);
  void OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& clock) override;
  void OnSensors(const bridge::RunMessage& message, morphbus::sensors_t&& sensors) override;
  void OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) override;
  /// The module's answer of that tick or later; null if there is none.
  [[nodiscard]] const Inspection* AnswerOf(const std::string& module) const;
  /// Modules that were asked and have not answered. Where SENSORS was missed, all are asked.
  [[nodiscard]] std::vector<std::string> Missing() const;
  [[nodiscard]] Json AnswerJson(int module, const Inspection& answer) const;

  bridge::Bus& bus_;
  const ControlledRun& run_;
  const std::string module_;
  int64_t asked_tick_ = 0;
  // What was heard, of the latest ticks.
  std::map<int64_t, Asked> asked_;
  std::map<std::string, bridge::InspectionCollector> collectors_;
  std::map<std::string, std::map<int64_t, Inspection>> answers_;
  int64_t clock_tick_ = -1;
  bool clock_heard_ = false, ended_ = false;
};

}  // namespace morphbus::tools
