#include "logger/compare/source_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <tuple>

#include "bridge/description/program_words.h"
#include "bridge/wire/channels.h"
#include "logger/compare/module_rerun.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;

/// Within a tick: the world is sensed, then modules report, tell each other and command.
int OrderOf(Topic topic) {
  static constexpr Topic kOrder[] = {Topic::kWorld, Topic::kSensors, Topic::kStatus,
                                     Topic::kTransform, Topic::kActuator};
  return static_cast<int>(std::find(std::begin(kOrder), std::end(kOrder), topic) - kOrder);
}

/// The pair and the joint that an item is of; null for items of something else.
std::pair<const ModulePair*, const JointPair*> JointOf(const RunLog& a, const RunLog& b,
                                                       const Comparison& comparison,
                                                       const Item& item) {
  // An item knows its modules and its label by name only.
  for (const ModulePair& pair : comparison.matching.pairs) {
    if (a.modules[pair.a].name != item.module_a || b.modules[pair.b].name != item.module_b) {
      continue;
    }
    for (const JointPair& joint : pair.joints) {
      if (joint.label == item.label) return {&pair, &joint};
    }
  }
  return {nullptr, nullptr};
}

/// Which command of the joint had begun at `time_us`, from 0; -1 before the first.
int CommandAt(const std::vector<CommandStart>& starts, int64_t time_us) {
  const auto after = std::ranges::upper_bound(starts, time_us, {}, &CommandStart::time_us);
  return static_cast<int>(after - starts.begin()) - 1;
}

/// The tick of a time in a log; -1 if its ticks have no length.
int64_t TickOf(const RunLog& log, int64_t time_us) {
  return log.tick_us > 0 ? time_us / log.tick_us : -1;
}

/// Whether a program is the one of the log's description, perhaps with other values of parameters.
bool IsRunsOwn(const RunLog& log, uint64_t hash) {
  if (hash == log.facts.program_hash) return true;
  const auto image = log.deployed.find(hash);
  if (image == log.deployed.end() || log.described == nullptr) return false;
  bridge::ModuleImages images;
  const std::string& bytes = image->second;
  return images.AddProgram("program", {bytes.begin(), bytes.end()}).has_value() &&
         bridge::IsOwnProgram(*log.described, images.program());
}

/// Fills in the call by which a module commanded a joint at the message's tick.
void FindLine(const RunLog& log, int module, int joint, TracedMessage* message) {
  // The module is run again, since no message says which line a command came from.
  const Result<CommandingCall> call = FindCommandingCall(log, module, joint, message->tick);
  if (!call) {
    message->why_not = call.error().message;
    return;
  }
  // The run may have been started from an image, which names its source itself.
  const bool as_run =
      IsRunsOwn(log, call->program_hash) && log.facts.program_file.ends_with(".dyn");
  const vm::SourcePlace place = call->files.Of(call->line, as_run ? log.facts.program_file : "");
  message->line = SourceLine{place.file, place.line, call->function};
}

}  // namespace

std::optional<Trace> TraceDivergence(const RunLog& a, const RunLog& b,
                                     const Comparison& comparison) {
  // The earliest of all that is beyond its tolerance, and of one time the cause.
  std::optional<size_t> first;
  std::tuple<int64_t, int> earliest;
  for (size_t i = 0; i < comparison.items.size(); ++i) {
    const Item& item = comparison.items[i];
    const std::optional<Topic> carrier = InfoOf(item.quantity).carrier;
    if (item.first_over_us < 0 || !carrier) continue;
    const std::tuple<int64_t, int> at(item.first_over_us, OrderOf(*carrier));
    if (first && at >= earliest) continue;
    first = i;
    earliest = at;
  }
  // What differs may be in no message at all, as the length of a run.
  if (!first) return std::nullopt;
  Trace trace;
  trace.item = *first;
  const Item& item = comparison.items[*first];
  const Topic carrier = *InfoOf(item.quantity).carrier;
  // Where the message stands in both runs; WORLD and SENSORS are the simulator's.
  const bool of_sim = carrier == Topic::kWorld || carrier == Topic::kSensors;
  const auto place = [&](const RunLog& log, const std::string& module, TracedMessage* message) {
    if (!of_sim && module.empty()) return;
    message->channel = bridge::Channel(log.facts.run, of_sim ? "" : module, carrier);
    message->tick = TickOf(log, item.first_over_us);
  };
  place(a, item.module_a, &trace.a);
  place(b, item.module_b, &trace.b);
  if (carrier != Topic::kActuator) return trace;
  // A command: who gave it. Aligned runs give the same one in unlike ticks.
  const auto [pair, joint] = JointOf(a, b, comparison, item);
  if (joint == nullptr) return trace;
  if (!comparison.alignment.by_ticks) {
    const auto in_a =
        CommandStarts(a.modules[pair->a], joint->joint_a, SignsOfA(a.modules[pair->a], *joint));
    const auto in_b =
        CommandStarts(b.modules[pair->b], joint->joint_b, SignsOfB(b.modules[pair->b], *joint));
    // In A the time says which command of the joint it is; in B it is the one of the same number.
    const int number = CommandAt(in_a, item.first_over_us);
    if (number < 0 || number >= static_cast<int>(in_b.size())) {
      trace.b.tick = -1;
      trace.b.why_not = "B has no such command";
    } else {
      trace.b.tick = TickOf(b, in_b[number].time_us);
    }
  }
  // A run that lacks the command has no tick, and no call to look for.
  if (trace.a.tick >= 0) FindLine(a, pair->a, joint->joint_a, &trace.a);
  if (trace.b.tick >= 0) FindLine(b, pair->b, joint->joint_b, &trace.b);
  return trace;
}

std::string SourceLineText(const SourceLine& line) {
  return fmt::format("{}:{} in {}", line.file, line.line, line.function);
}

}  // namespace morphbus::logger
