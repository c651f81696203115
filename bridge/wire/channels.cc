#include "bridge/wire/channels.h"

#include <algorithm>
#include <array>

namespace morphbus::bridge {
namespace {

/// What is known of a topic: its name, whose channels have it, whether it counts for the run's
/// hash, whether several processes publish there.
struct TopicRow {
  Topic topic;
  std::string_view name;
  // Whose name stands before the topic; channels of the run as a whole have none there.
  enum class Owner : uint8_t { kSim, kLog, kSimAndLog, kModule, kProcess, kRun } owner;
  bool hashed = false;
  bool many_publishers = false;
};
using Owner = TopicRow::Owner;

// In the order of Topic, which is their index.
constexpr std::array<TopicRow, 20> kTopics = {{
    {Topic::kClock, "CLOCK", Owner::kSim, true},
    {Topic::kSensors, "SENSORS", Owner::kSim, true},
    {Topic::kWorld, "WORLD", Owner::kSim, true},
    {Topic::kTransform, "TRANSFORM", Owner::kModule, true},
    {Topic::kActuator, "ACTUATOR", Owner::kModule, true},
    {Topic::kStatus, "STATUS", Owner::kModule, true},
    {Topic::kHealth, "HEALTH", Owner::kProcess},
    {Topic::kResend, "RESEND", Owner::kProcess, false, true},
    {Topic::kAdmit, "ADMIT", Owner::kSim},
    {Topic::kLeave, "LEAVE", Owner::kSim},
    {Topic::kVerdict, "VERDICT", Owner::kSim},
    {Topic::kAnswer, "ANSWER", Owner::kSim},
    {Topic::kProgress, "PROGRESS", Owner::kSimAndLog},
    {Topic::kBatch, "BATCH", Owner::kLog},
    {Topic::kHello, "HELLO", Owner::kRun, false, true},
    {Topic::kTotals, "TOTALS", Owner::kRun, false, true},
    {Topic::kInfo, "INFO", Owner::kRun},
    {Topic::kControl, "CONTROL", Owner::kRun, false, true},
    {Topic::kFollow, "FOLLOW", Owner::kRun, false, true},
    {Topic::kEnd, "END", Owner::kRun},
}};

const TopicRow& RowOf(Topic topic) { return kTopics[static_cast<size_t>(topic)]; }

/// Names that a module must not have, because channels use them.
bool IsReserved(std::string_view name) {
  return name == kSimProcess || name == kLogProcess ||
         std::ranges::any_of(kTopics, [name](const TopicRow& row) {
           return row.owner == Owner::kRun && row.name == name;
         });
}

/// Letters, digits and '_', and '-' where allowed.
bool IsWord(std::string_view text, bool dash) {
  // Written out, because isalnum depends on the locale of the process.
  return std::all_of(text.begin(), text.end(), [dash](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           (dash && c == '-');
  });
}

/// Whether a module can be called so on the bus.
bool IsModuleName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxProcessName && IsWord(name, false) &&
         !IsReserved(name);
}

/// Whether a run can be called so.
bool IsRunName(std::string_view run) {
  return !run.empty() && run.size() <= kMaxRunName && IsWord(run, true);
}

/// Whether a topic exists at that process.
bool OwnerFits(Owner owner, std::string_view process) {
  switch (owner) {
    case Owner::kSim:
      return process == kSimProcess;
    case Owner::kLog:
      return process == kLogProcess;
    case Owner::kSimAndLog:
      return process == kSimProcess || process == kLogProcess;
    case Owner::kModule:
      return IsModuleName(process);
    case Owner::kProcess:
      return process == kSimProcess || process == kLogProcess || IsModuleName(process);
    case Owner::kRun:
      return process.empty();
  }
  return false;
}

}  // namespace

std::string Channel(std::string_view run, std::string_view process, Topic topic) {
  const TopicRow& row = RowOf(topic);
  std::string name(run);
  name += '/';
  // The process's part is left out where the topic belongs to the run.
  if (row.owner != Owner::kRun) {
    name += row.owner == Owner::kSim   ? kSimProcess
            : row.owner == Owner::kLog ? kLogProcess
                                       : process;
    name += '/';
  }
  name += row.name;
  return name;
}

std::string_view TopicName(Topic topic) { return RowOf(topic).name; }

std::optional<ChannelName> ParseChannel(std::string_view channel) {
  // RUN/TOPIC or RUN/PROCESS/TOPIC.
  const size_t first = channel.find('/');
  const size_t last = channel.rfind('/');
  if (first == std::string_view::npos || channel.size() > kMaxChannelName) return std::nullopt;
  // The views point into the name that was given; nothing is copied.
  ChannelName name;
  name.run = channel.substr(0, first);
  if (last > first) name.process = channel.substr(first + 1, last - first - 1);
  const std::string_view topic = channel.substr(last + 1);
  if (!IsRunName(name.run) || (last > first && name.process.empty())) return std::nullopt;
  // The topic says whose channel it can be.
  for (const TopicRow& row : kTopics) {
    if (row.name != topic) continue;
    if (!OwnerFits(row.owner, name.process)) return std::nullopt;
    name.topic = row.topic;
    return name;
  }
  return std::nullopt;
}

bool IsHashed(Topic topic) { return RowOf(topic).hashed; }

bool HasManyPublishers(Topic topic) { return RowOf(topic).many_publishers; }

Result<void> CheckRunName(std::string_view run) {
  if (IsRunName(run)) return {};
  return Fail("'" + std::string(run) +
              "' cannot name a run: use 1 to 24 letters, digits, '_' or '-'");
}

Result<void> CheckModuleName(std::string_view module) {
  if (IsModuleName(module)) return {};
  // The two ways to be wrong need different advice.
  if (IsReserved(module)) {
    return Fail("'" + std::string(module) +
                "' cannot name a module: the bus uses that name itself");
  }
  return Fail("'" + std::string(module) +
              "' cannot name a module on the bus: use 1 to 28 letters, digits or '_'");
}

std::string_view LostModule(std::string_view control) {
  constexpr std::string_view kLose = "lose ";
  return control.starts_with(kLose) ? control.substr(kLose.size()) : std::string_view();
}

}  // namespace morphbus::bridge
