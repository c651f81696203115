#pragma once
// The events of a log one by one, decoded by the .lcm definitions that the log itself carries, or
// else by ours.

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "logger/log/event_log.h"
#include "logger/log/ordered_log.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// One event, and what its bytes mean.
struct DecodedEvent {
  /// As it stands in the file; valid until the next event is read.
  logger::LogEvent event;
  /// The type by whose definition the bytes were read; null if no definition fits them.
  const LcmType* type = nullptr;
  /// The definitions among which the type is; null without one.
  const LcmSchema* schema = nullptr;
  /// The members, arrays of bytes as hexadecimal text; an object only if there is a type.
  nlohmann::ordered_json message;
  /// Why the bytes mean nothing to us; empty if there is a type.
  std::string why_not;
  /// Sim time of the message's header, µs since the run's start; none if it has no such header.
  std::optional<int64_t> sim_time_us;
};

/// Reads a log front to back, with one event in memory at a time.
class EventDecoder {
 public:
  /// Opens the log. Its description says how the message types were defined when it was recorded;
  /// `description` is a serialized one (ReadDescription) that takes the place of a missing one, and
  /// may be empty. `in_order`: events come in the order of the run's ticks (OrderedLogReader), else
  /// in that of the file. Fails if the log cannot be read.
  static Result<std::unique_ptr<EventDecoder>> Open(const std::string& path,
                                                    const std::string& description, bool in_order);

  /// Reads the next event; false at the end. Damage is read past.
  bool Next(DecodedEvent* decoded);
  /// The run's serialized description, the log's own or the lent one; empty if there is none.
  [[nodiscard]] const std::string& description() const { return description_; }
  /// The reader beneath, for what it found.
  [[nodiscard]] const logger::EventLogReader& reader() const { return reader_->file(); }

 private:
  EventDecoder(std::unique_ptr<logger::OrderedLogReader> reader, std::string description,
               std::vector<LcmSchema> schemas)
      : reader_(std::move(reader)),
        description_(std::move(description)),
        schemas_(std::move(schemas)) {}

  std::unique_ptr<logger::OrderedLogReader> reader_;
  std::string description_;
  /// The log's own definitions, if it has some, then ours.
  std::vector<LcmSchema> schemas_;
};

}  // namespace morphbus::tools
