#pragma once
// A log as an MCAP file, for Foxglove and whatever else reads that format.

#include "tools/convert/json_lines.h"

namespace morphbus::tools {

/// Writes every event on a channel whose whole name matches `channels` as one message: the topic is
/// the channel's name, the schema that of LcmProto, the sequence the event's number, the log time
/// when it was received (nanoseconds since 1970), the publish time the sim time of its header
/// (nanoseconds since the run's start; the log time for a message without). An event whose type is
/// unknown keeps its bytes, under the message encoding "lcm" without a schema.
///
/// If the log has a usable description, the topics for viewers of docs/monitor-protocol.md come
/// besides (/RUN/tf, /RUN/scene ...), as far as their names match `channels`: of the described run,
/// with the number and log time of the event that completed them, and their own sim time. Fails as
/// `write` does, or if the log cannot be read to its end.
Result<EventsWritten> WriteMcap(EventDecoder* decoder, const NamePattern& channels,
                                const logger::ByteSink& write);

}  // namespace morphbus::tools
