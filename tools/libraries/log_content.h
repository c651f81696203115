#pragma once
// What is inside the logs of the library observe, for the libraries above it.

#include <morphbus/observe/log.h>

#include <optional>

#include "logger/log/run_log.h"

namespace morphbus {

/// A log, and the robot that ran.
class MORPHBUS_HIDDEN Log::Content {
 public:
  explicit Content(logger::RunLog log);
  /// A copy's robot would stand in the original's model.
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  /// The series of the module of that name; throws Failure where there is none.
  [[nodiscard]] const logger::ModuleSeries& FindModule(std::string_view name) const;

  logger::RunLog log;
  /// Absent if the log does not say which robot ran.
  std::optional<morphbus::Robot> robot;
};

}  // namespace morphbus
