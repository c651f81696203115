#pragma once
// The channels of one run among all that a bus or a log has, each found by its name once.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/wire/channels.h"
#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// Knows a run's channels by their names. A million messages have some dozens of channels, so that
/// what a name says is found out once. Only channels that the run can have get a place, whatever
/// names come.
class RunChannels {
 public:
  /// A channel of the run.
  struct Channel {
    Topic topic = Topic::kClock;
    /// The process whose channel it is; empty where the topic has none.
    std::string process;
    /// Its index among the run's modules; -1 if it is none of them.
    int module = -1;
    /// For who counts: the highest number that came there; -1 before the first.
    int64_t newest = -1;
  };

  /// `modules` are the run's, in order of the robot.
  RunChannels(std::string run, const std::vector<std::string>& modules);

  /// The channel of this name; null if the run has none of that name. It stays where it is.
  Channel* Find(std::string_view channel);
  [[nodiscard]] const std::string& run() const { return run_; }

 private:
  std::string run_;
  TextTable<int> module_index_;
  TextTable<Channel> channels_;
};

}  // namespace morphbus::bridge
