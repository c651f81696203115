#include "tools/spy/process_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <morphbus/health_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>

#include "bridge/control/control_command.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/held_state.h"
#include "bridge/wire/vm_codec.h"
#include "compiler/base/text.h"
#include "vm/image/fault_text.h"

namespace morphbus::tools {
namespace {

// Faults that are kept of a module, and how often its poses are looked at: a robot at its fastest
// sends thousands of TRANSFORMs a second, and a screen shows one.
constexpr size_t kKeptFaults = 8;
constexpr int64_t kPosePeriodNs = 50'000'000;
// The speed of a run is that of the last seconds, by so many CLOCKs at most.
constexpr int64_t kSpeedNs = 3'000'000'000;
constexpr int64_t kSpeedStepNs = 100'000'000;

// What is kept of an inspected module: parts of its answer, and lines of so many bytes.
constexpr int kMostParts = 32;
constexpr size_t kMostHeldLines = 64;
constexpr size_t kLongestHeldLine = 200;

/// A line for each field, task and call, as far as there is room for them.
std::vector<std::string> HeldLines(const bridge::HeldState& held) {
  std::vector<std::string> lines;
  const auto add = [&lines](const std::string& line) {
    if (lines.size() < kMostHeldLines) lines.push_back(bridge::CutText(line, kLongestHeldLine));
  };
  for (const bridge::HeldValue& field : held.fields) {
    add(fmt::format("field {} = {} ({})", field.name, field.value, field.type));
  }
  for (const bridge::HeldTask& task : held.tasks) {
    add(task.routine);
    for (const bridge::HeldCall& call : task.calls) {
      std::string locals;
      for (const bridge::HeldValue& local : call.locals) {
        locals += fmt::format("{} {} = {}", locals.empty() ? ":" : ",", local.name, local.value);
      }
      add(fmt::format("  in {}, line {}{}", call.function, call.line, locals));
    }
  }
  return lines;
}

/// Names in the order of people: m2 before m10.
bool Before(const std::string& a, const std::string& b) {
  const auto number = [](const std::string& name) {
    const size_t at = name.find_last_not_of("0123456789") + 1;
    return std::pair(name.substr(0, at), name.size() - at);
  };
  const auto [a_name, a_digits] = number(a);
  const auto [b_name, b_digits] = number(b);
  if (a_name != b_name) return a_name < b_name;
  return a_digits != b_digits ? a_digits < b_digits : a < b;
}

}  // namespace

std::string HeardFaultText(const morphbus::fault_t& wire) {
  const vm::Fault fault = bridge::FromFault(wire);
  return vm::FaultLine("", fault.line, vm::FaultSentence(fault, {}),
                       vm::FaultFunction(fault, nullptr));
}

ProcessTable::Process* ProcessTable::Note(std::string_view run, std::string_view process,
                                          int64_t now_ns) {
  // Two runs may have modules of one name.
  Process* noted = processes_.Take(fmt::format("{}/{}", run, process), now_ns);
  if (noted == nullptr) return nullptr;
  noted->row.run = run;
  noted->row.process = process;
  noted->row.is_module = process != bridge::kSimProcess && process != bridge::kLogProcess;
  return noted;
}

void ProcessTable::Take(const bridge::ChannelName& name, const uint8_t* data, size_t size,
                        int64_t arrival_ns) {
  using bridge::Topic;
  if (name.topic == Topic::kClock) return TakeClock(name, data, size, arrival_ns);
  // Other channels say nothing of their publisher that is shown.
  if (name.topic != Topic::kStatus && name.topic != Topic::kTransform &&
      name.topic != Topic::kHealth) {
    return;
  }
  Process* process = Note(name.run, name.process, arrival_ns);
  if (process == nullptr) return;
  if (name.topic == Topic::kStatus) TakeStatus(data, size, process);
  if (name.topic == Topic::kTransform) TakeTransform(data, size, arrival_ns, process);
  if (name.topic == Topic::kHealth) TakeHealth(name, data, size, arrival_ns, process);
}

void ProcessTable::TakeClock(const bridge::ChannelName& name, const uint8_t* data, size_t size,
                             int64_t now_ns) {
  morphbus::sim_clock_t clock;
  if (!bridge::Decode(data, size, {}, &clock)) return;
  Run* run = runs_.Take(name.run, now_ns);
  if (run == nullptr) return;
  // Where the run is, by its last CLOCK.
  RunRow& row = run->row;
  row.run = name.run;
  row.tick = clock.header.tick;
  row.sim_time_us = clock.header.sim_time_us;
  row.tick_us = clock.tick_us;
  row.ended = clock.phase == morphbus::sim_clock_t::PHASE_END;
  row.end_reason = clock.end_reason;
  run->last_ns = now_ns;
  // Of the commands that took effect, these last.
  for (const std::string& text : clock.controls) {
    const Result<bridge::ControlCommand> command = bridge::ParseControl(text);
    if (!command) continue;
    if (command->kind == bridge::ControlKind::kPause) row.paused = true;
    if (command->kind == bridge::ControlKind::kResume) row.paused = false;
    if (command->kind == bridge::ControlKind::kSpeed) row.asked_speed = command->speed;
  }
  // A run of the same name that begins anew begins a new row of times.
  auto& clocks = run->clocks;
  if (!clocks.empty() && row.sim_time_us < clocks.back().second) {
    clocks.clear();
    row.paused = false;
    row.asked_speed.reset();
  }
  if (clocks.empty() || now_ns - clocks.back().first >= kSpeedStepNs) {
    clocks.emplace_back(now_ns, row.sim_time_us);
  }
  while (clocks.size() > 2 && now_ns - clocks.front().first > kSpeedNs) clocks.pop_front();
}

void ProcessTable::TakeInspection(const morphbus::status_t& status, Process* process) {
  if (status.inspections.empty()) return;
  // Parts come in order; what has gaps is passed over.
  const morphbus::inspection_t& part = status.inspections.front();
  if (part.part == 0 || process->inspected_tick != status.header.tick) process->inspected.clear();
  process->inspected_tick = status.header.tick;
  if (part.num_parts > kMostParts || part.part != std::ssize(process->inspected)) return;
  process->inspected.push_back(part);
  if (part.part + 1 < part.num_parts) return;
  const Result<bridge::HeldState> held = bridge::JoinHeld(process->inspected);
  process->inspected.clear();
  if (!held) return;
  process->row.held = HeldLines(*held);
  process->row.held_at = fmt::format("{:.2f} s", Seconds(status.header.sim_time_us));
}

void ProcessTable::TakeStatus(const uint8_t* data, size_t size, Process* process) {
  morphbus::status_t status;
  if (!bridge::Decode(data, size, {}, &status)) return;
  ProcessRow& row = process->row;
  // The last STATUS is all there is to say of role, labels and tasks.
  row.has_status = true;
  row.type = status.type_name;
  row.role = status.role_name;
  row.frozen = status.frozen != 0;
  row.labels.clear();
  for (const morphbus::label_t& label : status.labels) {
    const bool joint = label.kind == morphbus::label_t::KIND_JOINT;
    row.labels.push_back(
        fmt::format("{}: {} {}", label.name, joint ? "joint" : "link", label.index));
  }
  row.joint_signs.assign(status.joint_sign.begin(), status.joint_sign.end());
  row.tasks.clear();
  for (const morphbus::task_t& task : status.tasks) {
    row.tasks.push_back(fmt::format("{} at line {}", task.function_name, task.line));
  }
  row.ended_behaviors = status.ended_behaviors;
  row.startup_ended = status.startup_ended != 0;
  TakeInspection(status, process);
  // Faults beyond those that a message holds are counted all the same.
  row.faults += static_cast<int64_t>(status.faults.size()) + status.faults_dropped;
  for (const morphbus::fault_t& fault : status.faults) {
    row.last_faults.push_back(
        fmt::format("{:.2f} s: {}", Seconds(status.header.sim_time_us), HeardFaultText(fault)));
  }
  if (row.last_faults.size() > kKeptFaults) {
    row.last_faults.erase(row.last_faults.begin(),
                          row.last_faults.end() - static_cast<ptrdiff_t>(kKeptFaults));
  }
}

void ProcessTable::TakeTransform(const uint8_t* data, size_t size, int64_t now_ns,
                                 Process* process) {
  if (process->last_pose_ns != 0 && now_ns - process->last_pose_ns < kPosePeriodNs &&
      now_ns >= process->last_pose_ns) {
    return;
  }
  process->last_pose_ns = now_ns;
  morphbus::transform_t transform;
  if (!bridge::Decode(data, size, {}, &transform)) return;
  // How old the pose is, in ticks: what a tick is worth, CLOCK says.
  process->has_pose = transform.has_pose != 0;
  process->row.pose_stale = transform.pose_stale != 0;
  process->row.hops = transform.hops;
  // The root numbers its broadcasts by its ticks.
  process->pose_age_ticks = std::max<int64_t>(0, transform.header.tick - transform.root_sequence);
}

void ProcessTable::TakeHealth(const bridge::ChannelName& name, const uint8_t* data, size_t size,
                              int64_t now_ns, Process* process) {
  morphbus::health_t health;
  if (!bridge::Decode(data, size, {}, &health)) return;
  ProcessRow& row = process->row;
  row.has_health = true;
  // The process's own word on what it uses and what it missed.
  row.max_rss_kb = health.max_rss_kb;
  row.received = health.received;
  row.sent = health.sent;
  row.lost = health.lost;
  row.resent = health.resent;
  row.asked = health.asked;
  row.bad = health.bad;
  row.restarts = health.restarts;
  row.missed_deadlines = health.missed_deadlines;
  row.first_refused = health.first_refused;
  // Both counters begin anew when the process does. Of two HEALTHs within a moment, as at a run's
  // end, the difference says nothing.
  constexpr int64_t kLeastUs = 200'000;
  const bool first = process->health_wall_us == 0;
  const int64_t wall_us = health.wall_time_us - process->health_wall_us;
  const int64_t cpu_us = health.cpu_us - process->health_cpu_us;
  if (first || wall_us < 0 || wall_us >= kLeastUs) {
    if (!first && wall_us > 0 && cpu_us >= 0) {
      row.cpu = static_cast<double>(cpu_us) / static_cast<double>(wall_us);
    }
    process->health_wall_us = health.wall_time_us;
    process->health_cpu_us = health.cpu_us;
  }
  // The simulator also tells how punctual the modules are, one that was never heard among them.
  // Noting another process may end the life of `process`.
  for (const morphbus::lateness_t& lateness : health.lateness) {
    Process* module = Note(name.run, lateness.module_name, now_ns);
    if (module == nullptr) continue;
    module->row.lateness = {lateness.missed, lateness.late, lateness.worst_us};
  }
}

void ProcessTable::Snapshot(int64_t now_ns, SpySnapshot* out) const {
  runs_.ForEach([&](const std::string& /*name*/, const Run& run) {
    RunRow row = run.row;
    row.silent_s = std::max(0.0, static_cast<double>(now_ns - run.last_ns) * 1e-9);
    const auto& clocks = run.clocks;
    // A run that holds still has the speed 0, whatever it had before, and if it was held before
    // that could be measured.
    if (!clocks.empty() && row.silent_s > 1.0) {
      row.speed = 0.0;
    } else if (clocks.size() >= 2) {
      const auto last = std::max(run.last_ns, clocks.back().first);
      const auto seconds = static_cast<double>(last - clocks.front().first) * 1e-9;
      const double sim = Seconds(row.sim_time_us - clocks.front().second);
      row.speed = seconds <= 0.0 ? 0.0 : sim / seconds;
    }
    out->runs.push_back(std::move(row));
  });
  // Ages are in sim time, which needs the run's length of a tick.
  processes_.ForEach([&](const std::string& /*name*/, const Process& process) {
    ProcessRow row = process.row;
    const RunRow* run = out->Run(row.run);
    if (process.has_pose && run != nullptr) {
      row.pose_age_s = Seconds(process.pose_age_ticks * run->tick_us);
    }
    out->processes.push_back(std::move(row));
  });
  // By run, modules before simulator and logger, in the order of people.
  std::stable_sort(out->processes.begin(), out->processes.end(),
                   [](const ProcessRow& a, const ProcessRow& b) {
                     if (a.run != b.run) return a.run < b.run;
                     if (a.is_module != b.is_module) return a.is_module;
                     return Before(a.process, b.process);
                   });
}

const ChannelRow* SpySnapshot::Channel(const std::string& name) const {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const ChannelRow& row) { return row.channel == name; });
  return found == channels.end() ? nullptr : &*found;
}

const ProcessRow* SpySnapshot::Process(const std::string& run, const std::string& name) const {
  const auto found = std::find_if(processes.begin(), processes.end(), [&](const ProcessRow& row) {
    return row.run == run && row.process == name;
  });
  return found == processes.end() ? nullptr : &*found;
}

const RunRow* SpySnapshot::Run(const std::string& name) const {
  const auto found =
      std::find_if(runs.begin(), runs.end(), [&](const RunRow& row) { return row.run == name; });
  return found == runs.end() ? nullptr : &*found;
}

}  // namespace morphbus::tools
