#pragma once
// Who wants which channels: what every bus that receives keeps.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "bridge/bus/bus.h"
#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// The subscriptions of one bus. A handler may change them while it is called: it stays alive until
/// it returns, and what it changes holds from the next message on.
class Subscriptions {
 public:
  /// A subscription to one channel. A bus that keeps a pointer to it beside a message that waits
  /// needs no look-up by name to hand the message over; it forgets the pointer before Remove.
  struct Exact {
    /// Shared, so that it can be replaced while it runs; null: the message is for no handler.
    std::shared_ptr<Bus::Handler> handler;
  };
  /// By the channel's name; a subscription stays where it is until it is removed.
  using Book = TextTable<std::unique_ptr<Exact>>;
  /// Handlers by the prefix, in its order; shared, so that one can be replaced while it runs.
  using OrderedBook = std::map<std::string, std::shared_ptr<Bus::Handler>, std::less<>>;

  /// As Bus::Receive. Returns the subscription to one channel, null for others. No process needs
  /// two of Channels::By::kBothEnds, so that a further one replaces the first.
  const Exact* Add(const Channels& channels, Bus::Handler handler);
  /// Drops channel and prefix of this name; false if there was neither.
  bool Remove(const std::string& name);

  /// Whether any subscription matches the channel.
  [[nodiscard]] bool Wants(std::string_view channel) const;
  /// Calls the handlers that match: first the channel's own, then the prefixes' in order of prefix,
  /// then that of both ends. Returns how many there were.
  int Dispatch(std::string_view channel, const uint8_t* data, size_t size) const;
  /// The same for a message of which this subscription is known to match, and no other does.
  static int Dispatch(const Exact& subscription, std::string_view channel, const uint8_t* data,
                      size_t size);

  /// Channels that were subscribed to by their names' two ends.
  struct Pattern {
    /// How the names begin and end; no prefix: there is no such subscription.
    std::string prefix, suffix;
    std::shared_ptr<Bus::Handler> handler;
    [[nodiscard]] bool Matches(std::string_view channel) const {
      return !prefix.empty() && channel.size() > prefix.size() + suffix.size() &&
             channel.starts_with(prefix) && channel.ends_with(suffix);
    }
  };

  /// What was subscribed to by its exact name, by prefix, and by both ends.
  [[nodiscard]] const Book& exact() const { return exact_; }
  [[nodiscard]] const OrderedBook& prefixes() const { return prefixes_; }
  [[nodiscard]] const Pattern& pattern() const { return pattern_; }

 private:
  // A channel and a prefix may have the same name.
  Book exact_;
  OrderedBook prefixes_;
  Pattern pattern_;
};

}  // namespace morphbus::bridge
