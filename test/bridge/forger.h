#pragma once
// Somebody on the bus of a run who speaks in other processes' names: with sound messages, whose CRC
// fits. The forger knows beforehand what everybody will say, for runs repeat.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/wire/codec.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {

/// A message as it travels.
struct Spoken {
  std::string channel;
  std::vector<uint8_t> bytes;
};

/// What a whole run comes to, as witnesses see it who take no part in the comparison of totals: the
/// robot, the programs, and whoever copies down what the logger takes.
struct Outcome {
  /// The simulator says that all went well, and the logger may call its log clean.
  bool sim_ok = false, log_clean = false;
  std::string error;      ///< The sim's, or else the logger's.
  std::string published;  ///< The run's hash, by its publishers.
  std::string recorded;   ///< The same, by the logger.
  /// The robot's state and all programs', to the bit, and how often it was moved.
  std::vector<uint8_t> state;
  int64_t moves = 0;
  /// Refused by all processes together.
  Ledger refused;
  double seconds = 0;  ///< Wall time of the run, in its virtual time.
  /// The same up to where the launcher sees that all is not well: when the simulator is done, or
  /// the logger leaves and says why, or a module with an error.
  double seconds_to_end = 0;
};

/// Runs `run` to its end and says what came of it.
Outcome OutcomeOf(FakeRun* run);

/// Everything that is said in a run that nobody disturbs, in order. `prepare` (may be empty) is
/// called before it begins.
std::vector<Spoken> Overhear(const FakeRunOptions& options,
                             const std::function<void(FakeRun*)>& prepare = {});

/// An endpoint on a run's bus that hears everything and may say anything.
class Forger {
 public:
  /// Calls `on_message` with each message of others and how many came before it.
  Forger(FakeRun* run, std::function<void(int64_t count, const Spoken& message)> on_message);

  void Say(const Spoken& message) {
    said_.insert(MessageDigest(message.bytes.data(), message.bytes.size()));
    bus_->Publish(message.channel, message.bytes.data(), message.bytes.size());
  }

 private:
  std::unique_ptr<Bus> bus_;
  int64_t heard_ = 0;
  std::set<uint64_t> said_;  ///< Hashes of its own messages, which come back to it.
};

/// The message with a change, the CRC that belongs to it, and the auth that it had.
template <class M>
Spoken Altered(const Spoken& original, const std::function<void(M*)>& change) {
  M message;
  if (!Decode(original.bytes.data(), original.bytes.size(), {}, &message)) return original;
  change(&message);
  Spoken altered{original.channel, {}};
  Encode(message, &altered.bytes);
  std::copy_n(original.bytes.begin() + kAuthOffset, kContentOffset - kAuthOffset,
              altered.bytes.begin() + kAuthOffset);
  PatchCrc(altered.bytes.data(), altered.bytes.size());
  return altered;
}

/// What is said on a topic for the lockstep only, as somebody makes it up who hears a module's
/// ACTUATOR.
Spoken MadeUp(Topic topic, const Spoken& command, std::mt19937_64* random);

/// The message so many ticks later, as its header says; its content is what it was.
Spoken Displaced(const Spoken& original, int64_t ticks);

/// The message with another content, of the same place in the run.
Spoken AlteredContent(const Spoken& original, std::mt19937_64* random);

/// Changes something in a message of any kind, so that it says something else: its content, its
/// place in the run, or both.
Spoken AlteredAnyhow(const Spoken& original, std::mt19937_64* random);

}  // namespace morphbus::bridge
