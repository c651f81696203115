#include "tools/convert/mcap_log.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bridge/outward/converter.h"
#include "bridge/outward/topics.h"
#include "logger/log/mcap_writer.h"
#include "tools/convert/lcm_proto.h"

namespace morphbus::tools {
namespace {

/// Nanoseconds of a time in microseconds; what cannot be told so, as a damaged log may hold, is 0.
uint64_t Nanoseconds(int64_t time_us) {
  constexpr int64_t kLatest = INT64_MAX / 1000;
  return time_us < 0 || time_us > kLatest ? 0 : static_cast<uint64_t>(time_us) * 1000;
}

/// The schemas and channels of one file, each made when it is first needed.
class McapTopics {
 public:
  explicit McapTopics(logger::McapWriter* writer) : writer_(*writer) {}

  /// Whether the file may be about to have more channels than MCAP can number.
  [[nodiscard]] bool full() const { return channels_.size() >= 60'000; }
  /// The channel for messages of a type on a topic.
  uint16_t ChannelFor(const DecodedEvent& decoded) {
    const std::string topic(decoded.event.channel);
    // One topic may have messages of several types, as of any program's; each pair is a channel of
    // its own, as MCAP has it.
    const auto [channel, is_new] = channels_.emplace(std::pair(topic, decoded.type), 0);
    if (is_new) {
      const Schema* schema = decoded.type == nullptr ? nullptr : &SchemaFor(decoded);
      const bool typed = schema != nullptr && schema->proto != nullptr;
      channel->second =
          writer_.AddChannel(typed ? schema->id : 0, topic, typed ? "protobuf" : "lcm");
    }
    return channel->second;
  }

  /// The message as its schema has it; none if the type has no schema.
  std::optional<std::string> Encode(const DecodedEvent& decoded) {
    if (decoded.type == nullptr) return std::nullopt;
    const Schema& schema = SchemaFor(decoded);
    if (schema.proto == nullptr) return std::nullopt;
    return schema.proto->Convert(decoded.message);
  }

 private:
  struct Schema {
    uint16_t id = 0;
    std::unique_ptr<LcmProto> proto;  ///< Null if Protocol Buffers cannot express the type.
  };

  const Schema& SchemaFor(const DecodedEvent& decoded) {
    const LcmType& type = *decoded.type;
    const auto [schema, is_new] = schemas_.try_emplace(&type);
    if (!is_new) return schema->second;
    Result<std::unique_ptr<LcmProto>> proto = LcmProto::Create(*decoded.schema, type);
    if (proto) {
      // A type that cannot be expressed stays in the map without a number, so that it is tried
      // once.
      schema->second.id = writer_.AddSchema(type.name, (*proto)->schema());
      schema->second.proto = std::move(*proto);
    }
    return schema->second;
  }

  logger::McapWriter& writer_;
  std::map<const LcmType*, Schema> schemas_;
  std::map<std::pair<std::string, const LcmType*>, uint16_t> channels_;
};

/// The messages for viewers, made of the run's own.
class ViewerTopics {
 public:
  ViewerTopics(const std::string& description, const NamePattern& channels,
               logger::McapWriter* writer)
      : channels_(channels), writer_(*writer) {
    auto run = bridge::ReadRunWithRobot(description);
    if (run) converter_.emplace(*run, (*run)->run, nullptr);
  }

  /// Writes what an event completes.
  void Take(const logger::LogEvent& event) {
    if (!converter_) return;
    const bridge::OutwardSink sink = SinkAt(event);
    if (!begun_) converter_->Begin(sink);
    begun_ = true;
    converter_->Take(event.channel, event.data.data(), event.data.size(), sink);
    // The views end with the event, which the reader then overwrites; number and times are kept.
    last_ = event;
    last_.channel = {};
    last_.data = {};
  }
  /// Writes what waited for messages that did not come.
  void Finish() {
    if (converter_ && begun_) converter_->Finish(SinkAt(last_));
  }

  [[nodiscard]] int64_t written() const { return written_; }
  /// The first failure of the writer.
  [[nodiscard]] const Result<void>& result() const { return result_; }

 private:
  /// Takes messages that are completed by this event.
  bridge::OutwardSink SinkAt(const logger::LogEvent& event) {
    return [this, number = event.number, log_time_ns = Nanoseconds(event.timestamp_us)](
               bridge::OutwardTopic topic, int64_t time_ns, const std::string& bytes) {
      const std::optional<uint16_t> channel = ChannelFor(topic);
      if (!channel || !result_) return;
      result_ = writer_.Write(*channel, static_cast<uint32_t>(number), log_time_ns,
                              static_cast<uint64_t>(std::max<int64_t>(time_ns, 0)),
                              {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
      ++written_;
    };
  }

  /// The channel of a topic; none if the user does not want it.
  std::optional<uint16_t> ChannelFor(bridge::OutwardTopic topic) {
    // A topic that is not wanted stays in the table without a channel, and is not looked at again.
    const auto [channel, is_new] = by_topic_.try_emplace(topic);
    const std::string path = bridge::TopicPath(converter_->run().run, topic);
    if (!is_new || !channels_.Matches(path)) return channel->second;
    const std::string name(bridge::RowOf(topic).schema);
    const auto [schema, is_first] = schemas_.try_emplace(name, 0);
    if (is_first) schema->second = writer_.AddSchema(name, bridge::SchemaOf(name));
    channel->second = writer_.AddChannel(schema->second, path, "protobuf");
    return channel->second;
  }

  const NamePattern& channels_;
  logger::McapWriter& writer_;
  /// None without a usable description.
  std::optional<bridge::Converter> converter_;
  bool begun_ = false;
  /// Number and times of the last event.
  logger::LogEvent last_;
  std::map<bridge::OutwardTopic, std::optional<uint16_t>> by_topic_;
  std::map<std::string, uint16_t> schemas_;
  int64_t written_ = 0;
  Result<void> result_;
};

}  // namespace

Result<EventsWritten> WriteMcap(EventDecoder* decoder, const NamePattern& channels,
                                const logger::ByteSink& write) {
  EventsWritten written;
  logger::McapWriter writer(write);
  McapTopics topics(&writer);
  ViewerTopics viewers(decoder->description(), channels, &writer);
  DecodedEvent decoded;
  while (decoder->Next(&decoded)) {
    const logger::LogEvent& event = decoded.event;
    // What viewers know how to draw is made of the same event, and stands before it.
    viewers.Take(event);
    if (!viewers.result()) return tl::unexpected(viewers.result().error());
    if (!channels.Matches(event.channel)) continue;
    if (topics.full()) return Fail("the log has more than 60,000 channels, as MCAP cannot");
    // An event of an unknown type goes into the file as the bytes that it is.
    const uint16_t channel = topics.ChannelFor(decoded);
    const std::optional<std::string> message = topics.Encode(decoded);
    const auto* bytes = message ? reinterpret_cast<const uint8_t*>(message->data()) : nullptr;
    // A message without sim time has its log time as publish time, which MCAP demands.
    const uint64_t log_time_ns = Nanoseconds(event.timestamp_us);
    const Result<void> added =
        writer.Write(channel, static_cast<uint32_t>(event.number), log_time_ns,
                     decoded.sim_time_us ? Nanoseconds(*decoded.sim_time_us) : log_time_ns,
                     message ? std::span<const uint8_t>(bytes, message->size()) : event.data);
    if (!added) return tl::unexpected(added.error());
    ++written.events;
    if (!message) ++written.unknown;
  }
  // A log that could not be read to its end has no export; a damaged one has what could be read.
  const logger::EventLogReader& reader = decoder->reader();
  if (!reader.io_error().empty()) return Fail("reading failed: " + reader.io_error());
  written.damaged = reader.damaged();
  viewers.Finish();
  written.for_viewers = viewers.written();
  if (Result<void> closed = writer.Close(); !closed) return tl::unexpected(closed.error());
  return written;
}

}  // namespace morphbus::tools
