#include "test/support/doctored_log.h"

#include <map>

#include "bridge/wire/stream_hash.h"
#include "logger/log/event_log.h"

namespace morphbus::test {

using bridge::Topic;

DoctoredLog::DoctoredLog(const std::string& path) {
  auto reader = logger::EventLogReader::Open(path);
  MORPHBUS_CHECK(reader.has_value());
  logger::LogEvent event;
  while ((*reader)->Next(&event)) {
    events_.push_back({event.timestamp_us, std::string(event.channel),
                       std::vector<uint8_t>(event.data.begin(), event.data.end())});
  }
}

void DoctoredLog::DropChannels(Topic topic, std::string_view process) {
  std::erase_if(events_, [&](const SyntheticEvent& event) {
    const auto name = bridge::ParseChannel(event.channel);
    return name && name->topic == topic && (process.empty() || name->process == process);
  });
}

void DoctoredLog::Write(const std::string& path) {
  struct Stream {
    bool hashed = false;
    std::map<int64_t, const std::vector<uint8_t>*> by_number;  ///< Hashed in order of number.
  };
  // The distinct messages of each channel; other channels are counted as they stand.
  std::map<std::string, Stream> streams;
  for (const SyntheticEvent& event : events_) {
    const auto name = bridge::ParseChannel(event.channel);
    if (!name || name->topic == Topic::kEnd) continue;
    Stream& stream = streams[event.channel];
    stream.hashed = bridge::IsHashed(name->topic);
    header_t header;
    int64_t number = static_cast<int64_t>(stream.by_number.size());
    if (stream.hashed) {
      MORPHBUS_CHECK(
          bridge::DecodeHeader(event.payload.data(), event.payload.size(), &header).has_value());
      number = header.sequence;
    }
    stream.by_number.emplace(number, &event.payload);
  }

  std::vector<bridge::ChannelTotal> totals;
  std::vector<bridge::ChannelTotal> hashed;
  for (const auto& [channel, stream] : streams) {
    bridge::StreamHash hash;
    for (const auto& [number, payload] : stream.by_number) {
      hash.Update(payload->data(), payload->size());
    }
    totals.push_back({channel, static_cast<int64_t>(stream.by_number.size()),
                      static_cast<int64_t>(hash.Digest()), stream.hashed});
    if (stream.hashed) hashed.push_back(totals.back());
  }

  Change<log_end_t>(Topic::kEnd, "", [&](log_end_t* end) {
    end->channels = totals;
    end->num_channels = static_cast<int16_t>(end->channels.size());
    end->run_hash = bridge::RunHash(hashed);
    if (on_end_) on_end_(end);
  });
  WriteBytes(path, EncodeLog(events_));
}

}  // namespace morphbus::test
