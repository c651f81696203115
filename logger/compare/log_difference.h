#pragma once
// The first message in which two logs differ, byte by byte: for runs that should be one and the
// same.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridge/wire/channels.h"
#include "compiler/base/result.h"
#include "logger/log/run_facts.h"

namespace morphbus::logger {

/// A message of one number on one channel that is not the same in both logs.
struct UnlikeMessage {
  bridge::Topic topic = bridge::Topic::kClock;
  /// The channel without the run's name: "m5/ACTUATOR".
  std::string channel;
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  int64_t sequence = 0;
  /// The whole messages; empty for a log that does not have it.
  std::vector<uint8_t> first, second;
};

/// What FirstUnlikeMessage() found.
struct LogDifference {
  int64_t compared = 0;  ///< Messages of the first log that the second one was asked for.
  int64_t differing = 0;
  std::optional<UnlikeMessage> first;  ///< By tick; within one by topic, as a tick goes its way.
};

/// Compares all sound messages on the channels that count for a run's hash, by channel and number.
/// `first` and `second` are the facts of two logs of one run each; if `first` is not whole, what it
/// lacks is no difference. Keeps some 40 bytes a message. Fails if a file cannot be read.
Result<LogDifference> FirstUnlikeMessage(const LogFacts& first, const LogFacts& second);

}  // namespace morphbus::logger
