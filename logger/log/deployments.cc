#include "logger/log/deployments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bridge/control/control_command.h"
#include "compiler/base/text.h"
#include "logger/log/text_lines.h"

namespace morphbus::logger {
namespace {

/// No run has so many; a damaged log may say anything.
constexpr size_t kMaxChanges = 10'000;

/// "m1 m2 m3 at tick 340, m4 at tick 341, m5 never": modules that did the same stand together.
std::string WhoWhen(const DeploymentFact& deployment) {
  // Modules by the tick in which they went over; those that never did by themselves.
  std::map<int64_t, std::vector<std::string>> by_tick;
  std::vector<std::string> never;
  for (const auto& [module, tick] : deployment.switched) {
    (tick ? by_tick[*tick] : never).push_back(module);
  }
  std::vector<std::string> parts;
  for (const auto& [tick, modules] : by_tick) {
    // All at once is the rule, and the shortest to say.
    const bool all = modules.size() == deployment.switched.size();
    const std::string who = all ? fmt::format("all {} modules", modules.size())
                                : fmt::format("{}", fmt::join(modules, " "));
    parts.push_back(fmt::format("{} at tick {}", who, tick));
  }
  if (!never.empty()) parts.push_back(fmt::format("{} never", fmt::join(never, " ")));
  return parts.empty() ? "no module is heard of" : fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

void ProgramChanges::Take(std::string_view module, int64_t tick, uint64_t program_hash) {
  // Nearly every message is of a module that is known, and then no string is made of its name.
  const auto found = modules_.find(module);
  Module& m = found != modules_.end() ? found->second : modules_[std::string(module)];
  // A message that stands behind a later one in the file changes nothing.
  if (tick <= m.tick) return;
  m.tick = tick;
  // Only a change is of interest; the first message counts as one.
  const bool same = !m.changes.empty() && m.changes.back().program_hash == program_hash;
  if (!same && m.changes.size() < kMaxChanges) m.changes.push_back({tick, program_hash});
}

void ProgramChanges::TakeDeployment(int64_t tick, const bridge::ControlCommand& command) {
  // Whether the command was carried out is not asked here: the modules' own words tell.
  Deployment deployment;
  deployment.fact.tick = tick;
  deployment.fact.program = command.program;
  deployment.fact.parameter = command.parameter;
  deployment.fact.value = command.value;
  deployment.fact.program_hash = command.program_hash;
  deployment.fact.to = command.to;
  deployment.at = command.at;
  deployments_.emplace(tick, std::move(deployment));
}

std::vector<DeploymentFact> ProgramChanges::Deployments(int32_t tick_us) const {
  std::vector<DeploymentFact> deployments;
  for (const auto& [tick, deployment] : deployments_) {
    DeploymentFact& fact = deployments.emplace_back(deployment.fact);
    // "at" is a sim time in seconds; modules switch in the tick of that time.
    if (deployment.at && tick_us > 0) {
      fact.switch_tick = std::llround(*deployment.at * 1e6 / tick_us);
    }
  }
  for (size_t i = 0; i < deployments.size(); ++i) {
    DeploymentFact& fact = deployments[i];
    // From the same program's next deployment on, who goes over to it does so for that one.
    int64_t until = INT64_MAX;
    for (size_t k = i + 1; k < deployments.size() && until == INT64_MAX; ++k) {
      if (deployments[k].program_hash == fact.program_hash) until = deployments[k].tick;
    }
    // Of each module the first change to this program in that time.
    for (const auto& [name, module] : modules_) {
      const auto change =
          std::find_if(module.changes.begin(), module.changes.end(), [&](const Change& c) {
            return c.program_hash == fact.program_hash && c.tick >= fact.tick && c.tick < until;
          });
      fact.switched[name] =
          change == module.changes.end() ? std::nullopt : std::optional(change->tick);
    }
  }
  return deployments;
}

std::string ProgramChanges::WhoseIsForeign(uint64_t own,
                                           const std::vector<DeploymentFact>& deployments) const {
  // A program is known from its deployment on, and not before: nothing could have brought it to the
  // module.
  const auto known = [&](const Change& change) {
    return change.program_hash == own ||
           std::any_of(deployments.begin(), deployments.end(), [&](const DeploymentFact& fact) {
             return fact.program_hash == change.program_hash && fact.tick <= change.tick;
           });
  };
  // Of all modules the earliest one.
  const Change* first = nullptr;
  const std::string* whose = nullptr;
  for (const auto& [name, module] : modules_) {
    const auto change = std::find_if_not(module.changes.begin(), module.changes.end(), known);
    if (change == module.changes.end() || (first != nullptr && first->tick <= change->tick)) {
      continue;
    }
    first = &*change;
    whose = &name;
  }
  // All programs are accounted for.
  if (first == nullptr) return "";
  return fmt::format(
      "{} names program {:016x} from tick {} on, which is not the run's and which nobody deployed",
      *whose, first->program_hash, first->tick);
}

void AddTilts(const TiltTrack& tilts, int32_t tick_us, std::vector<DeploymentFact>* deployments) {
  for (DeploymentFact& fact : *deployments) {
    // The first module that goes over can be the one that makes the robot stumble.
    std::optional<int64_t> first;
    for (const auto& [module, tick] : fact.switched) {
      if (tick) first = std::min(first.value_or(*tick), *tick);
    }
    // Without a module that went over nothing can have come of it.
    if (!first) continue;
    const int64_t begin_us = *first * tick_us;
    fact.max_tilt_rad = tilts.Largest(begin_us, begin_us + std::llround(kTiltSeconds * 1e6));
  }
}

std::string DeploymentsText(const std::vector<DeploymentFact>& deployments, int32_t tick_us) {
  std::string text;
  if (deployments.empty()) return text;
  AddLine(&text, "{} (when each module went over to the program):",
          Counted(static_cast<int64_t>(deployments.size()), "deployment"));
  // A line for each: when it was commanded, what to whom, for when, and what came of it.
  for (const DeploymentFact& d : deployments) {
    const std::string when = d.switch_tick < 0
                                 ? "at once"
                                 : fmt::format("for tick {} ({:.2f} s)", d.switch_tick,
                                               Seconds(d.switch_tick * tick_us));
    const std::string tilt = d.max_tilt_rad
                                 ? fmt::format("; tilted {:.1f} degrees at most in the next {:g} s",
                                               *d.max_tilt_rad * kDegrees, kTiltSeconds)
                                 : "";
    const std::string what =
        d.parameter.empty() ? fmt::format("{} to {}", d.program, d.to.empty() ? "the root" : d.to)
                            : fmt::format("set {} {}", d.parameter, d.value);
    AddLine(&text, "  {} {}, {}: {}{}", d.tick, what, when, WhoWhen(d), tilt);
  }
  return text;
}

}  // namespace morphbus::logger
