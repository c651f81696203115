#pragma once
// Faults of the bus on purpose, for tests and experiments: messages that are lost, doubled, late or
// damaged. bridge/bus/fault_plan.h reads them from a file.

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/bus/bus_adapters.h"
#include "compiler/base/split_mix.h"

namespace morphbus::bridge {

/// What happens to messages that reach a process on some of its channels, and when. Each chance is
/// a probability, 0 to 1, and drawn for each message by itself.
struct FaultRule {
  /// Receivers and channels by pattern (MatchesPattern). A channel is named without the run's name:
  /// "m1/TRANSFORM".
  std::string process = "*";
  std::string channel = "*";
  /// Which messages by the tick and the sim time (microseconds) that stand in their headers: those
  /// from `from_...` on and before `until_...`. HELLO and whatever else precedes tick 1 has 0.
  int64_t from_tick = 0, until_tick = std::numeric_limits<int64_t>::max();
  int64_t from_us = 0, until_us = std::numeric_limits<int64_t>::max();
  /// The message does not arrive at all.
  double loss = 0;
  /// It arrives twice. The two are then late or damaged independently of each other.
  double duplicate = 0;
  /// It arrives after 1 to `delay` of the messages that follow it at this receiver, all numbers
  /// being equally likely.
  double reorder = 0;
  int delay = 4;
  /// It arrives later by 1 to `by_us` microseconds of the receiver's clock, all being equally
  /// likely, whatever else comes meanwhile.
  double late = 0;
  int64_t by_us = 0;
  /// One to three of its bits are flipped: CRC-32 finds all of these in messages of our size
  /// (Koopman, "32-Bit Cyclic Redundancy Codes for Internet Applications", DSN 2002: Hamming
  /// distance 4 up to 91,607 bits).
  double corrupt = 0;
};

/// All faults of a run.
struct FaultPlan {
  /// Of the random numbers; nothing if the file leaves it to --seed.
  std::optional<uint64_t> seed;
  std::vector<FaultRule> rules;
};

/// Adds the loss of `loss` (0 to 1) of all messages at all receivers (--loss), and says which seed
/// holds if the plan has none of its own.
FaultPlan WithLoss(FaultPlan plan, double loss, uint64_t seed);

/// Whether the whole text fits the pattern, in which `*` stands for any characters, none included,
/// and `?` for any one.
bool MatchesPattern(std::string_view pattern, std::string_view text);

/// Does to what arrives what the rules for one process say: the same with the same seed, rules,
/// name and arrivals (splitmix64). Publishing is left alone: faults are at the receiver, so that
/// each has its own. A message that is held back for later ones waits for as long as none come; one
/// that is late until DeliverLate is called (bridge/lockstep/late_messages.h).
class FaultyBus : public ForwardingBus {
 public:
  /// @param inner    outlives this bus.
  /// @param process  the receiver's name, by which rules are chosen; receivers of unlike names draw
  ///                 unlike numbers from the same seed.
  /// @param now_us   the receiver's clock, microseconds; without one nothing is late.
  FaultyBus(Bus* inner, const FaultPlan& plan, std::string_view process,
            std::function<int64_t()> now_us = {});

  // As in Bus; what is received may suffer.
  void Receive(const Channels& channels, Handler handler) override;
  void Unsubscribe(const std::string& channel) override;
  [[nodiscard]] BusLosses losses() const override;

  /// When the next late message is due, on the receiver's clock; nothing if none is under way.
  [[nodiscard]] std::optional<int64_t> next_late_us() const;
  /// Delivers the late messages that are due.
  void DeliverLate();

 private:
  /// The channels of a subscription by their name, and what it says of them.
  using Key = std::pair<std::string, Channels::By>;
  /// A message that later ones overtake.
  struct Delayed {
    Key key;  ///< Under which its handler is.
    std::string channel;
    std::vector<uint8_t> bytes;
    bool damaged = false;
    int remaining = 0;  ///< Messages that still come before it; a late one waits for none.
  };
  /// What befalls one copy of a message.
  struct Fate {
    int delay = 0;
    int64_t late_us = 0;
    bool damaged = false;
  };

  /// A handler for the inner bus that lets the message suffer before its subscriber gets it.
  Handler Wrap(const Key& key);
  /// What happens to the copies of a message; empty if it is lost.
  std::vector<Fate> Draw(std::string_view channel, const uint8_t* data, size_t size);
  /// Hands a message to its subscriber, if there still is one.
  void Deliver(const Delayed& message);
  /// Another message has come: delivers those of the first `count` delayed ones that waited for it.
  void Overtake(size_t count);
  /// Flips one to three bits.
  void Damage(std::vector<uint8_t>* bytes);
  /// Whether something of this probability happens.
  bool Happens(double probability);

  std::vector<FaultRule> rules_;  ///< Those for this process.
  SplitMix64 random_;             ///< Decides what becomes of a message.
  /// Shared, so that one may replace itself.
  std::map<Key, std::shared_ptr<Handler>> handlers_;
  std::vector<Delayed> delayed_;          ///< Oldest first.
  std::multimap<int64_t, Delayed> late_;  ///< By when they are due; of equal ones the oldest first.
  std::function<int64_t()> now_us_;
  BusLosses injected_;  ///< What was done to messages here.
};

}  // namespace morphbus::bridge
