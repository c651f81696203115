#include "bridge/bus/lcm_fragments.h"

#include <algorithm>
#include <cstring>

#include "bridge/bus/bus.h"
#include "compiler/base/big_endian.h"

namespace morphbus::bridge {
namespace {

// Magic, sequence number, payload size, offset of the fragment (four bytes each), number of the
// fragment, number of fragments (two bytes each).
constexpr size_t kFragmentHeader = 20;

}  // namespace

void LcmFragments::Drop(Partials::iterator partial, bool whole) {
  if (!whole) {
    ++given_up_;
    // What still comes of this message must not count as another one given up.
    refused_sender_ = partial->first;
    refused_sequence_ = partial->second.sequence;
  }
  bytes_ -= partial->second.payload.size();
  partials_.erase(partial);
}

void LcmFragments::MakeRoom(size_t bytes, uint64_t except) {
  while (bytes_ + bytes > limits_.total_bytes) {
    // Few messages are under way at a time, so that looking at all of them costs little.
    auto oldest = partials_.end();
    for (auto it = partials_.begin(); it != partials_.end(); ++it) {
      if (it->first == except) continue;
      if (oldest == partials_.end() || it->second.begun < oldest->second.begun) oldest = it;
    }
    // Nothing is left to give up but the message that needs the room, whose size Begin has bounded.
    if (oldest == partials_.end()) return;
    Drop(oldest, false);
  }
}

LcmFragments::Partials::iterator LcmFragments::Begin(uint64_t sender, const uint8_t* data,
                                                     size_t size, size_t* header) {
  // The channel's name stands in the first fragment only, behind the header.
  const size_t rest = std::min(size - kFragmentHeader, kMaxChannelName + 1);
  const void* end = std::memchr(data + kFragmentHeader, 0, rest);
  const auto* name = reinterpret_cast<const char*>(data + kFragmentHeader);
  const size_t length =
      end == nullptr ? 0 : static_cast<size_t>(static_cast<const char*>(end) - name);
  Partial partial;
  partial.sequence = LoadBigEndian<uint32_t>(data + 4);
  partial.size = LoadBigEndian<uint32_t>(data + 8);
  partial.fragments = LoadBigEndian<uint16_t>(data + 18);
  // What cannot be, or is too long, is refused at once.
  if (length == 0 || LoadBigEndian<uint32_t>(data + 12) != 0 || partial.fragments == 0 ||
      partial.size > std::min(limits_.message_bytes, limits_.total_bytes)) {
    ++given_up_;
    refused_sender_ = sender;
    refused_sequence_ = partial.sequence;
    return partials_.end();
  }
  *header += length + 1;
  partial.channel.assign(name, length);
  partial.begun = begun_++;
  // One more message than may be under way: the oldest gives way.
  if (partials_.size() >= limits_.messages) {
    Drop(std::min_element(
             partials_.begin(), partials_.end(),
             [](const auto& a, const auto& b) { return a.second.begun < b.second.begun; }),
         false);
  }
  return partials_.emplace(sender, std::move(partial)).first;
}

void LcmFragments::Take(uint64_t sender, const uint8_t* data, size_t size, const Sink& sink) {
  if (size < kFragmentHeader) return;
  const uint32_t sequence = LoadBigEndian<uint32_t>(data + 4);
  const uint32_t number = LoadBigEndian<uint16_t>(data + 16);
  size_t header = kFragmentHeader;
  auto partial = partials_.find(sender);
  // A sender sends one message after the other: with the next one, the one before is over.
  if (partial != partials_.end() && (partial->second.sequence != sequence || number == 0)) {
    Drop(partial, false);
    partial = partials_.end();
  }
  if (partial == partials_.end()) {
    if (number != 0) {
      // Its beginning was lost, or it was given up; it counts once.
      if (refused_sender_ != sender || refused_sequence_ != int64_t{sequence}) ++given_up_;
      refused_sender_ = sender;
      refused_sequence_ = sequence;
      return;
    }
    partial = Begin(sender, data, size, &header);
    if (partial == partials_.end()) return;
  }
  Partial& message = partial->second;
  const size_t count = size - header;
  // The next fragment continues where the last one ended, of the same message, and ends within it.
  const bool fits = number == message.next && LoadBigEndian<uint32_t>(data + 8) == message.size &&
                    LoadBigEndian<uint32_t>(data + 12) == message.payload.size() &&
                    LoadBigEndian<uint16_t>(data + 18) == message.fragments &&
                    count <= message.size - message.payload.size();
  if (!fits) return Drop(partial, false);
  MakeRoom(count, sender);
  message.payload.insert(message.payload.end(), data + header, data + size);
  bytes_ += count;
  if (++message.next < message.fragments) return;
  // The last fragment: whole only if nothing is missing at the end.
  if (message.payload.size() != message.size) return Drop(partial, false);
  sink(message.channel, message.payload.data(), message.payload.size());
  Drop(partial, true);
}

}  // namespace morphbus::bridge
