#include "logger/log/ended_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "bridge/wire/status_codec.h"
#include "compiler/base/text.h"
#include "vm/image/source_places.h"

namespace morphbus::logger {
namespace {

/// The kind of the task that a fault has ended; every fault here has ended one.
vm::TaskKind KindOf(const FaultFact& fault) {
  return static_cast<vm::TaskKind>(fault.fault.ended_task);
}

/// Function and place: "Leg.walk (walk.dyn:7)".
std::string TaskText(const FaultFact& fault) {
  if (fault.fault.line <= 0) return fault.task;
  return fmt::format("{} ({})", fault.task, vm::PlaceText({fault.file, fault.fault.line}));
}

/// The first ten of a kind by name, those of one place together, "m2, m3 Leg.walk (walk.dyn:7)",
/// and how many more there are of `count`.
std::string Names(const std::vector<FaultFact>& faults, vm::TaskKind kind, int64_t count) {
  constexpr int64_t kShown = 10;
  // In the order in which the first of each has ended.
  std::vector<std::pair<std::string, std::string>> modules_of;
  int64_t shown = 0;
  for (const FaultFact& fault : faults) {
    if (KindOf(fault) != kind || shown == kShown) continue;
    ++shown;
    const std::string task = TaskText(fault);
    const auto known =
        std::ranges::find(modules_of, task, &std::pair<std::string, std::string>::first);
    if (known == modules_of.end()) {
      modules_of.emplace_back(task, fault.module);
    } else {
      known->second += ", " + fault.module;
    }
  }
  std::string text;
  for (const auto& [task, modules] : modules_of) {
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", modules, task);
  }
  if (count > shown) text += fmt::format("{}{} more", shown > 0 ? " and " : "", count - shown);
  return text;
}

}  // namespace

void EndedTasks::Take(const ProgramFact& reported, const morphbus::status_t& status) {
  Module& module = modules_[reported.module];
  // Several tell of one tick; one of an earlier tick tells nothing new.
  if (status.header.tick < module.tick) return;
  // Another role, program or incarnation begins all tasks afresh: what had ended before no longer
  // counts.
  auto identity = std::tie(module.role, module.program_hash, module.incarnation);
  const std::tuple<int, int64_t, int> now(status.role, status.header.program_hash,
                                          status.incarnation);
  if (identity != now) {
    identity = now;
    module.faults.clear();
  }
  module.tick = status.header.tick;
  module.behaviors = status.ended_behaviors;
  module.startup = status.startup_ended != 0;
  // A command or a handler that a fault has ended runs again when it is called again.
  for (const morphbus::fault_t& wire : status.faults) {
    const vm::Fault fault = bridge::FromFault(wire);
    const bool for_good = fault.ended_task == static_cast<int>(vm::TaskKind::kStartup) ||
                          fault.ended_task == static_cast<int>(vm::TaskKind::kBehavior);
    if (for_good) module.faults.push_back({reported, fault, {}, {}});
  }
  // The role may have been left and taken again between two messages.
  if (module.behaviors == 0 && !module.startup) module.faults.clear();
}

EndedFacts EndedTasks::Facts(const std::map<std::string, int64_t>& lost) const {
  EndedFacts facts;
  for (const auto& [name, module] : modules_) {
    // A lost module plays no part in whether the program still does what it should.
    if (lost.contains(name)) continue;
    facts.behaviors += module.behaviors;
    facts.startups += module.startup ? 1 : 0;
    facts.faults.insert(facts.faults.end(), module.faults.begin(), module.faults.end());
  }
  // The same order however the file has its messages: m2 stands before m10.
  std::ranges::stable_sort(facts.faults, {}, [](const FaultFact& fault) {
    return std::tuple(fault.time_us, fault.module.size(), std::string_view(fault.module));
  });
  return facts;
}

std::vector<std::string> EndedLines(const EndedFacts& ended) {
  std::vector<std::string> lines;
  const auto add = [&](int64_t count, vm::TaskKind kind, const char* consequence) {
    if (count == 0) return;
    lines.push_back(EscapeControl(
        fmt::format("{} {} ended by a fault{}: {}", Counted(count, vm::TaskKindName(kind)),
                    count == 1 ? "has" : "have", consequence, Names(ended.faults, kind, count))));
  };
  // A behavior ends alone, but a startup keeps everything else of its role from starting.
  add(ended.behaviors, vm::TaskKind::kBehavior, "");
  add(ended.startups, vm::TaskKind::kStartup, ", and nothing else of the role has started");
  return lines;
}

nlohmann::json EndedKind(const FaultFact& fault) {
  if (fault.fault.ended_task < 0) return nullptr;
  return vm::TaskKindName(KindOf(fault));
}

nlohmann::json EndedJson(const EndedFacts& ended) {
  nlohmann::json tasks = nlohmann::json::array();
  for (const FaultFact& fault : ended.faults) {
    // The file is not known of a program that is not known here.
    const bool placed = fault.fault.line > 0 && !fault.file.empty();
    tasks.push_back(
        {{"module", fault.module},
         {"time", Seconds(fault.time_us)},
         {"role", fault.role},
         {"kind", vm::TaskKindName(KindOf(fault))},
         {"function", fault.task},
         {"file", placed ? nlohmann::json(fault.file) : nlohmann::json(nullptr)},
         {"line", placed ? nlohmann::json(fault.fault.line) : nlohmann::json(nullptr)}});
  }
  return {
      {"behaviors", ended.behaviors}, {"startups", ended.startups}, {"tasks", std::move(tasks)}};
}

}  // namespace morphbus::logger
