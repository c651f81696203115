#pragma once
// The bus of a run's process: what goes out carries the run's key, and what comes in without it
// goes no further.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/bus/bus_adapters.h"
#include "bridge/wire/run_key.h"

namespace morphbus::bridge {

/// Seals what a process says, and lets through all that it hears: for a run in one process, on
/// whose hub nobody else is.
class SealingBus : public ForwardingBus {
 public:
  /// @param inner  outlives this bus.
  SealingBus(Bus* inner, const RunKey& key) : ForwardingBus(inner), key_(key) {}

  // As in Bus.
  void Publish(const std::string& channel, const uint8_t* data, size_t size) override;
  using Bus::Subscribe;
  void Subscribe(const std::string& channel, Handler handler, const Interest& interest) override {
    inner_->Subscribe(channel, std::move(handler), interest);
  }
  void SubscribePrefix(const std::string& prefix, Handler handler) override {
    inner_->SubscribePrefix(prefix, std::move(handler));
  }
  void SubscribeQuietly(const std::string& prefix, const std::string& suffix,
                        Handler handler) override {
    inner_->SubscribeQuietly(prefix, suffix, std::move(handler));
  }

 protected:
  RunKey key_;

 private:
  std::vector<uint8_t> sealed_;  ///< What goes out; its memory is used again and again.
};

/// The only place where a process checks what it hears. It stands next to the network, before
/// everything that decodes, counts or decides.
class SealedBus : public SealingBus {
 public:
  /// Channels that are told apart in unauthentic(): their names may be anybody's inventions.
  static constexpr size_t kMostChannels = 16;

  using SealingBus::SealingBus;

  // As in Bus.
  using Bus::Subscribe;
  void Subscribe(const std::string& channel, Handler handler, const Interest& interest) override;
  void SubscribePrefix(const std::string& prefix, Handler handler) override;
  void SubscribeQuietly(const std::string& prefix, const std::string& suffix,
                        Handler handler) override;
  [[nodiscard]] const UnauthenticCounts& unauthentic() const override { return unauthentic_; }

 private:
  /// A handler for the inner bus that passes on what is authentic, and counts the rest.
  Handler Checked(Handler handler);
  /// Counts a message that is not.
  void CountUnauthentic(std::string_view channel);

  UnauthenticCounts unauthentic_;
};

/// For people who wait in vain: how many messages had not the key, and where the first one came;
/// empty if there were none.
std::string UnauthenticText(const UnauthenticCounts& counts);

}  // namespace morphbus::bridge
