#pragma once
// What a module's neighbours say, and which modules it listens to for that.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/lockstep/sequence_tracker.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// Listens to TRANSFORM of the modules that are or were mated to one module, and keeps what each
/// said last. Which ticks that is of, the state machine knows (ModuleLockstep::Has).
class NeighbourMail {
 public:
  /// What came from one module.
  struct Box {
    std::string name;         ///< By which its channel is called.
    SequenceTracker tracker;  ///< Of the numbers on its channel.
    /// By parity of the tick: the machine needs the present tick's and the last one's only. They
    /// come last, since they are large and the rest is then close together in memory.
    std::array<vm::NeighbourMessage, 2> messages;
    /// The place of the message of a tick.
    vm::NeighbourMessage& MessageOf(int64_t tick) {
      return messages[static_cast<size_t>(tick & 1)];
    }
  };
  /// Is given each TRANSFORM of a module that is listened to.
  using Handler = std::function<void(uint16_t mate, const uint8_t* data, size_t size)>;

  /// `bus` and `ledger`, in which bad messages are counted, outlive this. The bus keeps its
  /// address, so it stays where it is until the bus is gone.
  /// @param run         name of the run, the first part of every channel.
  /// @param model_hash  messages that speak of another model are bad.
  NeighbourMail(Bus* bus, std::string run, uint64_t model_hash, Ledger* ledger, Handler handler);

  /// Until it is known who the neighbours are, keeps the first that any module says: a fast one may
  /// have answered tick 0 by then.
  void ListenToAll();
  /// From here on only those that are known are listened to.
  void ListenToKnown();
  /// Listens to a module from now on, if that is not done already. What it said before is given to
  /// the handler at once.
  void Listen(uint16_t mate, const std::string& name);
  /// Whether there are so many boxes that those of former neighbours must make room.
  [[nodiscard]] bool full() const;
  /// Stops listening to all modules but these; returns those that are forgotten.
  std::vector<uint16_t> ForgetAllBut(const std::vector<uint16_t>& mates);
  /// What came from a module; null if it is not listened to.
  [[nodiscard]] Box* BoxOf(uint16_t mate);

 private:
  /// TRANSFORM's channel of the module of that name.
  [[nodiscard]] std::string ChannelOf(const std::string& name) const;

  Bus* bus_;
  std::string run_;
  uint64_t model_hash_;
  Ledger* ledger_;
  Handler handler_;
  std::map<uint16_t, Box> boxes_;  ///< By module.
  bool listens_to_all_ = false;
  /// TRANSFORM of modules that were not known as neighbours, by channel.
  std::map<std::string, std::vector<uint8_t>> early_;
};

}  // namespace morphbus::bridge
