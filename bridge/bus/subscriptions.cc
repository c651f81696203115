#include "bridge/bus/subscriptions.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace morphbus::bridge {

const Subscriptions::Exact* Subscriptions::Add(const Channels& channels, Bus::Handler handler) {
  auto shared = std::make_shared<Bus::Handler>(std::move(handler));
  if (channels.by == Channels::By::kName) {
    // Messages that wait for the subscription are for the new handler.
    std::unique_ptr<Exact>& subscription = exact_[channels.name];
    if (subscription == nullptr) subscription = std::make_unique<Exact>();
    subscription->handler = std::move(shared);
    return subscription.get();
  }
  if (channels.by == Channels::By::kPrefix) {
    prefixes_[channels.name] = std::move(shared);
  } else {
    pattern_ = {channels.name, channels.suffix, std::move(shared)};
  }
  return nullptr;
}

bool Subscriptions::Remove(const std::string& name) {
  // A name may be that of a channel, of a prefix and of the pattern at once.
  const bool pattern = !name.empty() && pattern_.prefix == name;
  if (pattern) pattern_ = Pattern();
  return exact_.erase(name) + prefixes_.erase(name) + (pattern ? 1 : 0) > 0;
}

bool Subscriptions::Wants(std::string_view channel) const {
  return exact_.contains(channel) || pattern_.Matches(channel) ||
         std::any_of(prefixes_.begin(), prefixes_.end(),
                     [&](const auto& entry) { return channel.starts_with(entry.first); });
}

int Subscriptions::Dispatch(std::string_view channel, const uint8_t* data, size_t size) const {
  // The handlers that match now, whatever they change, are kept alive over the calls. Mostly there
  // is one.
  if (prefixes_.empty() && pattern_.prefix.empty()) {
    const auto found = exact_.find(channel);
    return found == exact_.end() ? 0 : Dispatch(*found->second, channel, data, size);
  }
  // A logger has one prefix and nothing else.
  if (exact_.empty() && pattern_.prefix.empty() && prefixes_.size() == 1) {
    if (!channel.starts_with(prefixes_.begin()->first)) return 0;
    const std::shared_ptr<Bus::Handler> handler = prefixes_.begin()->second;
    (*handler)(channel, data, size);
    return 1;
  }
  // In a fixed order: the channel's own, prefixes, the pattern.
  std::vector<std::shared_ptr<Bus::Handler>> called;
  if (const auto found = exact_.find(channel); found != exact_.end()) {
    called.push_back(found->second->handler);
  }
  for (const auto& [prefix, handler] : prefixes_) {
    if (channel.starts_with(prefix)) called.push_back(handler);
  }
  if (pattern_.Matches(channel)) called.push_back(pattern_.handler);
  for (const std::shared_ptr<Bus::Handler>& handler : called) (*handler)(channel, data, size);
  return static_cast<int>(called.size());
}

int Subscriptions::Dispatch(const Exact& subscription, std::string_view channel,
                            const uint8_t* data, size_t size) {
  // The handler is kept alive over the call, whatever it changes.
  const std::shared_ptr<Bus::Handler> handler = subscription.handler;
  if (handler == nullptr) return 0;
  (*handler)(channel, data, size);
  return 1;
}

}  // namespace morphbus::bridge
