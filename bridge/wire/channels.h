#pragma once
// Names of the bus's channels. The table with types, rates and rules is lcmtypes/README.md. Full
// names are made and taken apart here.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "bridge/bus/bus.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// What a channel carries; each topic has one message type. The comments say where it stands: RUN
/// is the run's name.
enum class Topic : uint8_t {
  kClock,
  kSensors,
  kWorld,  // RUN/SIM/...
  kTransform,
  kActuator,
  kStatus,  // RUN/<module>/...
  kHealth,
  kResend,  // RUN/<process>/...; RESEND is named by who is asked.
  kAdmit,
  kLeave,
  kVerdict,
  kAnswer,    // RUN/SIM/...
  kProgress,  // RUN/SIM/... and RUN/LOG/...
  kBatch,     // RUN/LOG/...
  kHello,
  kTotals,
  kInfo,
  kControl,
  kFollow,
  kEnd,  // RUN/...
};

/// Process names that are not modules: the simulator's and the logger's. Modules are called by
/// their names in the model.
inline constexpr std::string_view kSimProcess = "SIM";
inline constexpr std::string_view kLogProcess = "LOG";

/// Longest names, bytes. They make up kMaxChannelName: 24 + 1 + 28 + 1 + 9 = 63, where 9 is the
/// length of TRANSFORM, the longest topic.
inline constexpr size_t kMaxRunName = 24;
inline constexpr size_t kMaxProcessName = 28;
inline constexpr size_t kMaxTopicName = 9;
/// Longest name of a channel without the run's.
inline constexpr size_t kMaxLocalChannel = kMaxProcessName + 1 + kMaxTopicName;

/// A channel name taken apart; the views point into the parsed text.
struct ChannelName {
  /// The run's name: "walk" in walk/m1/TRANSFORM.
  std::string_view run;
  /// The process whose channel it is ("m1"); empty for those of the run as a whole.
  std::string_view process;
  Topic topic = Topic::kClock;
};

/// Full name, e.g. "walk/m1/TRANSFORM". `process` is ignored by topics that have none, or that only
/// the simulator or the logger has. The names are not checked: see CheckRunName and
/// CheckModuleName.
std::string Channel(std::string_view run, std::string_view process, Topic topic);

/// Last part of the name, e.g. "TRANSFORM".
std::string_view TopicName(Topic topic);

/// The parts of a channel name; nothing if it is none of ours, because it is too long, because its
/// run or process cannot be called so, or because that process has no such topic.
std::optional<ChannelName> ParseChannel(std::string_view channel);

/// True if what travels there counts for the run's hash.
bool IsHashed(Topic topic);

/// True if several processes publish there, so that the sequence numbers have no common row.
bool HasManyPublishers(Topic topic);

/// Fails, in a sentence for people, unless this can be a run's name: 1..24 of A-Z a-z 0-9 _ -.
Result<void> CheckRunName(std::string_view run);

/// Fails, in a sentence for people, unless this can be a module's name on the bus: 1..28 of A-Z a-z
/// 0-9 _, and none of SIM, LOG and the channels of the run as a whole.
Result<void> CheckModuleName(std::string_view module);

/// The module that a control of CLOCK takes out of the run from that tick on ("lose m3"); empty if
/// the control does anything else. Whoever counts a module's messages needs to know.
std::string_view LostModule(std::string_view control);

}  // namespace morphbus::bridge
