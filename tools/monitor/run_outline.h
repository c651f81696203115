#pragma once
// Of a run that goes on what matching it with another one needs.

#include <cstdint>
#include <memory>
#include <string_view>

#include "bridge/description/run_model.h"
#include "bridge/observe/run_listener.h"
#include "bridge/observe/run_message.h"
#include "logger/log/run_log.h"
#include "logger/log/series_collector.h"

namespace morphbus::tools {

/// Keeps of a run's messages what logger::RunLogOptions::outline keeps of a log, less the STATUS
/// that repeat what was known: who had which role, labels and conventions, and where it then was.
/// So it grows by changes only, and not with time.
class RunOutline : private bridge::RunMessageHandler {
 public:
  explicit RunOutline(std::shared_ptr<const bridge::RunModel> run);
  /// Takes a message of the bus.
  void Take(std::string_view channel, const uint8_t* data, size_t size) {
    listener_.Take(channel, data, size, this);
  }
  /// Grows with what Log() has.
  [[nodiscard]] int64_t version() const { return version_; }
  /// All that was kept so far, as a log that ends here.
  [[nodiscard]] logger::RunLog Log() const;

 private:
  bool Decodes(const bridge::RunMessage& message) override;
  void OnChecked(const bridge::RunMessage& message) override;
  void OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& clock) override;
  void OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) override;

  std::shared_ptr<const bridge::RunModel> run_;
  bridge::RunListener listener_;
  logger::SeriesCollector series_;
  int64_t time_us_ = 0;
  int64_t version_ = 0;
};

}  // namespace morphbus::tools
