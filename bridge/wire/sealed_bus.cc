#include "bridge/wire/sealed_bus.h"

#include <algorithm>
#include <string>
#include <utility>

namespace morphbus::bridge {

void SealedBus::Publish(const std::string& channel, const uint8_t* data, size_t size) {
  if (key_.open()) return inner_->Publish(channel, data, size);
  // The caller's bytes are not changed, since it may keep them to send them again.
  sealed_.assign(data, data + size);
  key_.Seal(channel, sealed_.data(), size);
  inner_->Publish(channel, sealed_.data(), size);
}

void SealedBus::Receive(const Channels& channels, Handler handler) {
  if (hears_ == Hears::kAll) return inner_->Receive(channels, std::move(handler));
  inner_->Receive(channels, [this, handler = std::move(handler)](std::string_view channel,
                                                                 const uint8_t* data, size_t size) {
    // Handlers need not ask again who a message is from.
    if (!key_.IsAuthentic(channel, data, size)) return CountUnauthentic(channel);
    handler(channel, data, size);
  });
}

void SealedBus::CountUnauthentic(std::string_view channel) {
  ++unauthentic_.all;
  // Channels are counted by their name within the run.
  const std::string_view local = channel.substr(channel.find('/') + 1);
  const auto found = std::ranges::find(unauthentic_.channels, local, [](const auto& entry) {
    return std::string_view(entry.first);
  });
  if (found != unauthentic_.channels.end()) {
    ++found->second;
  } else if (unauthentic_.channels.size() < kMostChannels) {
    // A stranger may make up names without end: of so many the counts are kept.
    unauthentic_.channels.emplace_back(local, 1);
  }
}

std::string UnauthenticText(const UnauthenticCounts& counts) {
  if (counts.all == 0) return "";
  return "; " + std::to_string(counts.all) + (counts.all == 1 ? " message" : " messages") +
         " without the run's key came (the first on " + counts.channels.front().first +
         "): has everybody the same --key?";
}

}  // namespace morphbus::bridge
