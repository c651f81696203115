#pragma once

#include <optional>
#include <string>
#include <vector>

#include "logger/log/event_log.h"

/// Which run of a log file is read if nobody names one, and why none can be.
namespace morphbus::logger {

/// The first run that the file names in a CLOCK or INFO; nothing if it names none. Reads on until
/// then, so that the reader cannot be used for the file's first events afterwards.
std::optional<std::string> FindRun(EventLogReader* reader);

/// Why no run is found in the log at `path`, which `reader` has read to its end.
std::string WhyNoRun(const std::string& path, const EventLogReader& reader);

/// Why the log at `path` is not read: it has no message of `run`, but of `others`, of which eight
/// at most are named.
std::string NoSuchRun(const std::string& path, const std::string& run,
                      const std::vector<std::string>& others);

}  // namespace morphbus::logger
