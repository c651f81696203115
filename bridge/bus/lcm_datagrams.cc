#include "bridge/bus/lcm_datagrams.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace morphbus::bridge {
namespace {

constexpr uint32_t kShortMagic = 0x4c433032;     // "LC02"
constexpr uint32_t kFragmentMagic = 0x4c433033;  // "LC03"
constexpr size_t kShortHeader = 8;               // Magic, sequence number.
constexpr size_t kFragmentHeader = 20;
constexpr size_t kLongestChannel = 63;

/// Numbers in network order.
uint32_t Big32(const uint8_t* p) {
  return uint32_t{p[0]} << 24 | uint32_t{p[1]} << 16 | uint32_t{p[2]} << 8 | uint32_t{p[3]};
}
uint32_t Big16(const uint8_t* p) { return uint32_t{p[0]} << 8 | uint32_t{p[1]}; }

/// The NUL-terminated channel at the start of `data`; empty if there is none of a legal length.
std::string_view ChannelAt(const uint8_t* data, size_t size) {
  const void* end = std::memchr(data, 0, std::min(size, kLongestChannel + 1));
  if (end == nullptr) return {};
  const auto length = static_cast<size_t>(static_cast<const uint8_t*>(end) - data);
  return {reinterpret_cast<const char*>(data), length};
}

}  // namespace

struct LcmDatagrams::Fragment {
  uint64_t sender = 0;
  uint32_t sequence = 0;
  uint32_t message_size = 0;
  uint32_t offset = 0;
  uint32_t number = 0;
  uint32_t count = 0;
  std::string_view channel;  ///< Of the first fragment only.
  const uint8_t* payload = nullptr;
  size_t payload_size = 0;

  /// Takes a datagram apart, as the protocol lays it out: magic, sequence number, size of the
  /// message and place of the fragment in it (4 bytes each), number of the fragment and of
  /// fragments (2 bytes each). False if the datagram contradicts itself.
  bool Read(const uint8_t* data, size_t size) {
    if (size < kFragmentHeader) return false;
    sequence = Big32(data + 4);
    message_size = Big32(data + 8);
    offset = Big32(data + 12);
    number = Big16(data + 16);
    count = Big16(data + 18);
    payload = data + kFragmentHeader;
    payload_size = size - kFragmentHeader;
    // Only the first fragment names the channel.
    if (number == 0) {
      channel = ChannelAt(payload, payload_size);
      if (channel.empty()) return false;
      payload += channel.size() + 1;
      payload_size -= channel.size() + 1;
    }
    // Nothing may lie beyond the message's end, nor may a message be larger than what is ever kept.
    return number < count && message_size <= kMostBytes && offset <= message_size &&
           payload_size <= message_size - offset;
  }
};

void LcmDatagrams::Take(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink) {
  // The first four bytes tell short messages from fragments, and both from strangers.
  const uint32_t magic = size >= kShortHeader ? Big32(data) : 0;
  if (magic == kShortMagic) {
    TakeShort(data, size, sink);
  } else if (magic == kFragmentMagic) {
    TakeFragment(sender, data, size, sink);
  } else {
    ++bad_;
  }
}

void LcmDatagrams::TakeShort(const uint8_t* data, size_t size, const Sink& sink) {
  const std::string_view channel = ChannelAt(data + kShortHeader, size - kShortHeader);
  if (channel.empty()) {
    ++bad_;
    return;
  }
  // What follows the channel's name is the message.
  const size_t header = kShortHeader + channel.size() + 1;
  sink(channel, data + header, size - header);
}

void LcmDatagrams::TakeFragment(uint64_t sender, const uint8_t* data, size_t size,
                                const Sink& sink) {
  Fragment fragment;
  fragment.sender = sender;
  if (!fragment.Read(data, size)) {
    ++bad_;
    return;
  }
  // A fragment that came before changes nothing.
  const auto message = Find(fragment);
  if (message == unfinished_.end() || message->arrived[fragment.number]) return;
  message->arrived[fragment.number] = true;
  --message->missing;
  if (fragment.number == 0) message->channel = fragment.channel;
  if (fragment.payload_size > 0) {
    std::memcpy(message->bytes.data() + fragment.offset, fragment.payload, fragment.payload_size);
  }
  // The last one that was missing completes the message.
  if (message->missing > 0) return;
  const Unfinished whole = std::move(*message);
  unfinished_.erase(message);
  bytes_held_ -= whole.bytes.size();
  sink(whole.channel, whole.bytes.data(), whole.bytes.size());
}

// The unfinished message that the fragment belongs to, begun if need be; end() if it belongs to
// none, because it contradicts those that came before it.
std::list<LcmDatagrams::Unfinished>::iterator LcmDatagrams::Find(const Fragment& fragment) {
  const auto found =
      std::find_if(unfinished_.begin(), unfinished_.end(), [&](const Unfinished& one) {
        return one.sender == fragment.sender && one.sequence == fragment.sequence;
      });
  if (found != unfinished_.end()) {
    if (found->bytes.size() == fragment.message_size && found->arrived.size() == fragment.count) {
      return found;
    }
    ++bad_;
    return unfinished_.end();
  }
  // The first fragment to come says how large the message will be.
  MakeRoom(fragment.message_size);
  Unfinished begun;
  begun.sender = fragment.sender;
  begun.sequence = fragment.sequence;
  begun.bytes.resize(fragment.message_size);
  begun.arrived.resize(fragment.count);
  begun.missing = fragment.count;
  bytes_held_ += fragment.message_size;
  return unfinished_.insert(unfinished_.end(), std::move(begun));
}

void LcmDatagrams::MakeRoom(size_t bytes) {
  // The oldest are the least likely to be finished.
  while (!unfinished_.empty() &&
         (unfinished_.size() >= kMostUnfinished || bytes_held_ + bytes > kMostBytes)) {
    bytes_held_ -= unfinished_.front().bytes.size();
    unfinished_.pop_front();
    ++abandoned_;
  }
}

}  // namespace morphbus::bridge
