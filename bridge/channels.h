#pragma once
// Names of the bus's channels. The table with types, rates and rules is lcmtypes/README.md.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "compiler/source/result.h"

namespace morphbus::bridge {

/// What a channel carries.
enum class Topic : uint8_t {
  kClock,
  kSensors,
  kWorld,  // RUN/SIM/...
  kTransform,
  kActuator,
  kStatus,  // RUN/<module>/...
  kHealth,
  kAsk,  // RUN/<process>/...; ASK is named by the addressee.
  kHello,
  kInfo,
  kControl,
  kEnd,  // RUN/...
};

/// Process names that are not modules. Modules are called by their names in the model.
inline constexpr std::string_view kSimProcess = "SIM";
inline constexpr std::string_view kLogProcess = "LOG";

inline constexpr size_t kMaxChannelName = 63;  ///< LCM's limit.
inline constexpr size_t kMaxRunName = 24;
inline constexpr size_t kMaxProcessName = 28;  ///< 24 + 1 + 28 + 1 + 9 = 63.

/// A channel name taken apart; the views point into the parsed text.
struct ChannelName {
  std::string_view run;
  std::string_view process;  ///< Empty for kHello, kInfo, kControl, kEnd.
  Topic topic = Topic::kClock;
};

/// Full name, e.g. "walk/m1/TRANSFORM". `process` is ignored by topics that have none; for kClock,
/// kSensors and kWorld it is always "SIM".
std::string Channel(std::string_view run, std::string_view process, Topic topic);

/// Last part of the name, e.g. "TRANSFORM".
std::string_view TopicName(Topic topic);

/// The parts of a channel name; nothing if it is none of ours.
std::optional<ChannelName> ParseChannel(std::string_view channel);

/// True if what travels there counts for the run's hash.
bool IsHashed(Topic topic);

/// A run's name: 1..24 of A-Z a-z 0-9 _ -.
Result<void> CheckRunName(std::string_view run);

/// A module's name on the bus: 1..28 of A-Z a-z 0-9 _, and none of SIM, LOG, HELLO, INFO, CONTROL,
/// END.
Result<void> CheckModuleName(std::string_view module);

}  // namespace morphbus::bridge
