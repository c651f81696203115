#include "tools/spy/channel_table.h"

#include "bridge/wire/codec.h"

namespace morphbus::tools {

void ChannelTable::TakeForeign(const uint8_t* data, size_t size, Stream* stream) const {
  const LcmType* type = schema_->Find(bridge::FingerprintOf(data, size));
  if (type == nullptr || !schema_->Fits(*type, data, size)) {
    ++stream->row.undecodable;
    // A type that nobody named is no fault of the message.
    if (type != nullptr) ++stream->row.bad;
    return;
  }
  stream->type = type;
}

void ChannelTable::Keep(std::string_view channel, const uint8_t* data, size_t size,
                        Stream* stream) {
  stream->kept = &kept_bytes_;
  kept_bytes_ -= stream->last.size();
  // Of what is too much, none is kept rather than a part, which could not be decoded.
  if (kept_bytes_ + size > kMostKeptBytes && channel != watched_) {
    std::vector<uint8_t>().swap(stream->last);
    return;
  }
  stream->last.assign(data, data + size);
  kept_bytes_ += size;
}

std::optional<bridge::RunMessage> ChannelTable::Take(std::string_view channel, const uint8_t* data,
                                                     size_t size, int64_t arrival_ns) {
  // Where there is no place for another name, the message is only counted.
  Stream* stream = streams_.Take(channel, arrival_ns);
  if (stream == nullptr) return std::nullopt;
  // Counts of all channels, also those of other programs.
  ++stream->row.messages;
  stream->row.bytes += static_cast<int64_t>(size);
  stream->row.last_bytes = size;
  stream->arrivals.Take(arrival_ns, size);
  stream->row.fingerprint = static_cast<uint64_t>(bridge::FingerprintOf(data, size));
  Keep(channel, data, size, stream);
  const std::optional<bridge::ChannelName> name = bridge::ParseChannel(channel);
  stream->row.ours = name.has_value();
  if (!name) {
    TakeForeign(data, size, stream);
    return std::nullopt;
  }
  // The key is that of one run, which the first message tells that it fits. From then on a message
  // of that run which it does not fit counts as made up.
  if (!key_.open() && (run_.empty() || name->run == run_)) {
    if (key_.IsAuthentic(channel, data, size)) {
      run_ = name->run;
    } else if (!run_.empty()) {
      ++stream->row.unauthentic;
      ++stream->row.bad;
      ++stream->row.undecodable;
      return std::nullopt;
    }
  }
  // Our own channels have a header, with a checksum, and a number that tells of losses.
  const Result<bridge::RunMessage> message = bridge::OpenMessage(channel, data, size);
  if (!message) {
    ++stream->row.bad;
    ++stream->row.undecodable;
    return std::nullopt;
  }
  // The type is what the message says, whatever its channel is called.
  const LcmType* type = schema_->Find(bridge::FingerprintOf(data, size));
  if (type != nullptr) stream->type = type;
  // On some channels many senders speak, each with numbers of its own.
  const bool fresh =
      bridge::HasManyPublishers(message->name.topic) || stream->gaps.Take(message->header.sequence);
  return fresh ? std::optional(*message) : std::nullopt;
}

void ChannelTable::Snapshot(int64_t now_ns, SpySnapshot* out) const {
  // What is beyond the table is told beside it, so that nobody takes it for the whole bus.
  out->channels.reserve(streams_.size());
  streams_.ForEach([&](const std::string& channel, const Stream& stream) {
    ChannelRow& row = out->channels.emplace_back(stream.row);
    row.channel = channel;
    if (stream.type != nullptr) row.type = stream.type->name;
    row.lost = stream.gaps.lost();
    row.arrivals = stream.arrivals.At(now_ns);
  });
  out->untold_messages = streams_.refused();
  out->dropped_channels = streams_.dropped();
}

const std::vector<uint8_t>* ChannelTable::Last(std::string_view channel) const {
  // Where the message was too much to be kept there is none, though something was heard.
  const Stream* stream = streams_.Find(channel);
  return stream == nullptr || (stream->last.empty() && stream->row.last_bytes > 0) ? nullptr
                                                                                   : &stream->last;
}

}  // namespace morphbus::tools
