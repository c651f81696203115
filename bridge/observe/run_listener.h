#pragma once
// One run among all that a bus or a log holds: whose a message is, and whether it came already.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/observe/run_channels.h"
#include "bridge/observe/run_message.h"

namespace morphbus::bridge {

/// Finds the messages of one run and lets each through once, in the order of its channel's numbers:
/// what is sent again, and what stands behind a later one, is known already or comes too late to be
/// told. Nothing is believed of the bytes. A copy goes on from where the original was.
class RunListener {
 public:
  /// `model_hash` is the one that all messages must name; 0: any. `modules` are the run's modules
  /// in order of the robot.
  RunListener(std::string run, uint64_t model_hash, const std::vector<std::string>& modules);

  /// What became of a message.
  enum class Kind {
    kOther,   ///< It is none of the run's.
    kBad,     ///< It is damaged, of another model, or of a time that the run cannot have.
    kRepeat,  ///< It came already, or is older than one that came on its channel.
    kNew,     ///< It is sound, and later than all that came on its channel.
  };
  /// Takes a message of any channel, and gives it to `handler` if it is new.
  Kind Take(std::string_view channel, const uint8_t* data, size_t size, RunMessageHandler* handler);

 private:
  RunChannels channels_;
  uint64_t model_hash_;
  /// The tick of the last CLOCK; -1 before the first.
  int64_t tick_ = -1;
};

}  // namespace morphbus::bridge
