#include "tools/convert/json_lines.h"

#include <fmt/format.h>

#include "tools/base/json.h"

namespace morphbus::tools {

Result<EventsWritten> WriteJsonLines(EventDecoder* decoder, const NamePattern& channels,
                                     const logger::ByteSink& write) {
  EventsWritten written;
  DecodedEvent decoded;
  while (decoder->Next(&decoded)) {
    const logger::LogEvent& event = decoded.event;
    if (!channels.Matches(event.channel)) continue;
    // Every line has the same keys up to the message.
    const bool known = decoded.type != nullptr;
    Json line = {{"event", event.number},
                 {"received_us", event.timestamp_us},
                 {"channel", event.channel},
                 {"type", known ? Json(decoded.type->name) : Json(nullptr)},
                 {"sim_time_us", decoded.sim_time_us ? Json(*decoded.sim_time_us) : Json(nullptr)}};
    // What no definition fits is kept as the bytes that it was.
    if (known) {
      line["message"] = std::move(decoded.message);
    } else {
      line["bytes"] = fmt::format("{:02x}", fmt::join(event.data, ""));
      line["error"] = decoded.why_not;
      ++written.unknown;
    }
    // JSON writes a line break within a text as an escape, so that a line is one event.
    const std::string text = JsonText(line) + "\n";
    const auto* bytes = reinterpret_cast<const uint8_t*>(text.data());
    if (Result<void> r = write({bytes, text.size()}); !r) return tl::unexpected(r.error());
    ++written.events;
  }
  // A failing disk is an error, a damaged log is not.
  const logger::EventLogReader& reader = decoder->reader();
  if (!reader.io_error().empty()) return Fail("reading failed: " + reader.io_error());
  written.damaged = reader.damaged();
  return written;
}

}  // namespace morphbus::tools
