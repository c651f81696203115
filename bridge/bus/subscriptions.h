#pragma once
// Who wants which channels: what every bus that receives keeps.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// The subscriptions of one bus. A handler may change them while it is called: it stays alive until
/// it returns, and what it changes holds from the next message on.
class Subscriptions {
 public:
  /// By the channel's name, or by the prefix. Handlers are shared, so that one can be replaced
  /// while it runs.
  using Book = std::map<std::string, std::shared_ptr<Bus::Handler>, std::less<>>;

  /// As Bus::Subscribe and Bus::SubscribePrefix: an earlier handler of the same name is replaced.
  void Add(const std::string& channel, Bus::Handler handler);
  void AddPrefix(const std::string& prefix, Bus::Handler handler);
  /// Drops channel and prefix of this name; false if there was neither.
  bool Remove(const std::string& name);

  /// Whether any subscription matches the channel.
  [[nodiscard]] bool Wants(std::string_view channel) const;
  /// Calls the handlers that match: first the channel's own, then the prefixes' in order of prefix.
  /// Returns how many there were.
  int Dispatch(std::string_view channel, const uint8_t* data, size_t size) const;

  /// What was subscribed to by its exact name, and by prefix.
  [[nodiscard]] const Book& exact() const { return exact_; }
  [[nodiscard]] const Book& prefixes() const { return prefixes_; }

 private:
  // A channel and a prefix may have the same name.
  Book exact_, prefixes_;
};

}  // namespace morphbus::bridge
