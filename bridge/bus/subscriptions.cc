#include "bridge/bus/subscriptions.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace morphbus::bridge {

void Subscriptions::Add(const std::string& channel, Bus::Handler handler) {
  exact_[channel] = std::make_shared<Bus::Handler>(std::move(handler));
}

void Subscriptions::AddPrefix(const std::string& prefix, Bus::Handler handler) {
  prefixes_[prefix] = std::make_shared<Bus::Handler>(std::move(handler));
}

bool Subscriptions::Remove(const std::string& name) {
  return exact_.erase(name) + prefixes_.erase(name) > 0;
}

bool Subscriptions::Wants(std::string_view channel) const {
  return exact_.contains(channel) ||
         std::any_of(prefixes_.begin(), prefixes_.end(),
                     [&](const auto& entry) { return channel.starts_with(entry.first); });
}

int Subscriptions::Dispatch(std::string_view channel, const uint8_t* data, size_t size) const {
  // Those that match now, whatever they change; they are kept alive over the calls.
  std::vector<std::shared_ptr<Bus::Handler>> called;
  if (const auto found = exact_.find(channel); found != exact_.end()) {
    called.push_back(found->second);
  }
  for (const auto& [prefix, handler] : prefixes_) {
    if (channel.starts_with(prefix)) called.push_back(handler);
  }
  for (const std::shared_ptr<Bus::Handler>& handler : called) (*handler)(channel, data, size);
  return static_cast<int>(called.size());
}

}  // namespace morphbus::bridge
