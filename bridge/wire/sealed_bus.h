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

/// Seals what a process says, and is the only place where it asks whether what it hears is the
/// run's own. It stands next to the network, before everything that decodes, counts or decides.
class SealedBus : public ForwardingBus {
 public:
  /// Channels that are told apart in unauthentic(): their names may be anybody's inventions.
  static constexpr size_t kMostChannels = 16;
  /// What is to be heard: of a network what is authentic, of a hub within a process, on which
  /// nobody else is, all.
  enum class Hears : uint8_t { kAuthentic, kAll };

  /// @param inner  outlives this bus.
  SealedBus(Bus* inner, const RunKey& key, Hears hears = Hears::kAuthentic)
      : ForwardingBus(inner), key_(key), hears_(hears) {}

  // As in Bus.
  void Publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void Receive(const Channels& channels, Handler handler) override;
  [[nodiscard]] const UnauthenticCounts& unauthentic() const override { return unauthentic_; }

 private:
  /// Counts a message that is not authentic.
  void CountUnauthentic(std::string_view channel);

  RunKey key_;
  Hears hears_;
  std::vector<uint8_t> sealed_;  ///< What goes out; its memory is used again and again.
  UnauthenticCounts unauthentic_;
};

/// For people who wait in vain: how many messages had not the key, and where the first one came;
/// empty if there were none.
std::string UnauthenticText(const UnauthenticCounts& counts);

}  // namespace morphbus::bridge
