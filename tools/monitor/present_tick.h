#pragma once
// The tick at which a run holds still, for a listener that came after its messages were sent.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "bridge/bus/bus.h"
#include "bridge/description/run_model.h"
#include "bridge/lockstep/outbox.h"
#include "bridge/observe/run_message.h"

namespace morphbus::tools {

/// A name under which a listener asks (resend_t::sender) that nobody else has: by it a run's
/// processes tell its requests from those of others, and from their repetitions.
std::string NameOfAsker();

/// Asks for what a late listener lacks. A run that is paused repeats its CLOCK and nothing else, so
/// whoever begins to listen then would see no robot until it goes on. The sim and the modules keep
/// what they sent last, and send it again when asked (resend_t); all others know these
/// messages and leave them out. A run that goes on is asked for nothing.
class PresentTick : private bridge::RunMessageHandler {
 public:
  /// @param bus  on which to ask; must outlive this.
  PresentTick(bridge::Bus* bus, std::shared_ptr<const bridge::RunModel> run);

  /// A sound message of the run, in the order of the bus.
  void Take(std::string_view channel, const uint8_t* data, size_t size);

 private:
  /// Messages of one channel that are asked for.
  struct Wanted {
    std::string process;
    bridge::Topic topic = bridge::Topic::kClock;
    int64_t first = 0, last = 0;  ///< Their numbers on the channel.
    int64_t come = 0;             ///< How many of them came since they were asked for.
  };

  /// A CLOCK came: if it is again that of the first tick that was heard, asks for what lacks.
  void OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& clock) override;
  /// Asks for messages first..last of a channel, now and with later repetitions until they come.
  void Want(std::string_view process, bridge::Topic topic, int64_t first, int64_t last);
  void Ask(const Wanted& wanted);

  std::shared_ptr<const bridge::RunModel> run_;
  bridge::Ledger ledger_;
  bridge::Outbox outbox_;
  int64_t first_tick_ = -1;  ///< Of the first CLOCK; -1 before it.
  int times_asked_ = 0;      ///< For the first tick.
  bool over_ = false;        ///< The run has gone on, all is there, or nobody answers.
  std::map<std::string, Wanted, std::less<>> wanted_;  ///< By channel.
};

}  // namespace morphbus::tools
