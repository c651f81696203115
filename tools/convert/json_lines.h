#pragma once
// A log as JSON lines: one object a message, on a line of its own, in the order of the log.

#include <cstdint>
#include <string>

#include "compiler/base/name_pattern.h"
#include "compiler/base/result.h"
#include "logger/log/byte_sink.h"
#include "tools/convert/event_decoder.h"

namespace morphbus::tools {

/// What a conversion of events wrote and could not read.
struct EventsWritten {
  int64_t events = 0;
  /// Events whose bytes no message definition fits; they are written as bytes.
  int64_t unknown = 0;
  /// Further messages, made of several events each, for viewers (WriteMcap).
  int64_t for_viewers = 0;
  /// Findings of the log reader that are damage.
  bool damaged = false;
};

/// Writes every event on a channel whose whole name matches `channels`: `event` (its number in the
/// log), `received_us` (wall clock, since 1970), `channel`, `type` (null if unknown), `sim_time_us`
/// (null without one), `message` (its members in their order; arrays of bytes as hexadecimal text),
/// or, for an unknown type, `bytes` (hexadecimal) and `error`. Floating-point numbers are the
/// shortest text that reads back as the same double; what is not finite becomes null. Fails as
/// `write` does, or if the log cannot be read to its end.
Result<EventsWritten> WriteJsonLines(EventDecoder* decoder, const NamePattern& channels,
                                     const logger::ByteSink& write);

}  // namespace morphbus::tools
