#include "tools/spy/process_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

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

ProcessTable::Process* ProcessTable::Note(std::string_view run, std::string_view process) {
  // Two runs may have modules of one name.
  Process* noted = processes_.Take(fmt::format("{}/{}", run, process), now_ns_);
  if (noted == nullptr) return nullptr;
  noted->row.run = run;
  noted->row.process = process;
  noted->row.is_module = process != bridge::kSimProcess && process != bridge::kLogProcess;
  return noted;
}

void ProcessTable::Take(const bridge::RunMessage& message, int64_t arrival_ns) {
  using bridge::Topic;
  // Other channels say nothing of their publisher that is shown.
  const Topic topic = message.name.topic;
  if (topic != Topic::kClock && topic != Topic::kStatus && topic != Topic::kTransform &&
      topic != Topic::kHealth) {
    return;
  }
  now_ns_ = arrival_ns;
  process_ = topic == Topic::kClock ? nullptr : Note(message.name.run, message.name.process);
  if (topic == Topic::kClock || process_ != nullptr) bridge::ReadMessage(message, this);
}

bool ProcessTable::Decodes(const bridge::RunMessage& message) {
  if (message.name.topic != bridge::Topic::kTransform) return true;
  // Of thousands of poses a second a screen shows a few.
  const int64_t last_ns = process_->last_pose_ns;
  if (last_ns != 0 && now_ns_ >= last_ns && now_ns_ - last_ns < kPosePeriodNs) return false;
  process_->last_pose_ns = now_ns_;
  return true;
}

void ProcessTable::OnClock(const bridge::RunMessage& message, morphbus::sim_clock_t&& clock) {
  Run* run = runs_.Take(message.name.run, now_ns_);
  if (run == nullptr) return;
  run->name = message.name.run;
  run->last_ns = now_ns_;
  // A run of the same name that begins anew begins a new row of times.
  auto& clocks = run->clocks;
  const int64_t time_us = clock.header.sim_time_us;
  if (!clocks.empty() && time_us < clocks.back().second) {
    clocks.clear();
    run->clock = bridge::RunClock();
  }
  run->clock.Take(clock);
  if (clocks.empty() || now_ns_ - clocks.back().first >= kSpeedStepNs) {
    clocks.emplace_back(now_ns_, time_us);
  }
  while (clocks.size() > 2 && now_ns_ - clocks.front().first > kSpeedNs) clocks.pop_front();
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

void ProcessTable::OnStatus(const bridge::RunMessage& /*message*/, morphbus::status_t&& status) {
  ProcessRow& row = process_->row;
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
  TakeInspection(status, process_);
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

void ProcessTable::OnTransform(const bridge::RunMessage& /*message*/,
                               morphbus::transform_t&& transform) {
  // How old the pose is, in ticks: what a tick is worth, CLOCK says.
  process_->has_pose = transform.has_pose != 0;
  process_->row.pose_stale = transform.pose_stale != 0;
  process_->row.hops = transform.hops;
  // The root numbers its broadcasts by its ticks.
  process_->pose_age_ticks = std::max<int64_t>(0, transform.header.tick - transform.root_sequence);
}

void ProcessTable::OnHealth(const bridge::RunMessage& message, morphbus::health_t&& health) {
  ProcessRow& row = process_->row;
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
  const bool first = process_->health_wall_us == 0;
  const int64_t wall_us = health.wall_time_us - process_->health_wall_us;
  const int64_t cpu_us = health.cpu_us - process_->health_cpu_us;
  if (first || wall_us < 0 || wall_us >= kLeastUs) {
    if (!first && wall_us > 0 && cpu_us >= 0) {
      row.cpu = static_cast<double>(cpu_us) / static_cast<double>(wall_us);
    }
    process_->health_wall_us = health.wall_time_us;
    process_->health_cpu_us = health.cpu_us;
  }
  // The simulator also tells how punctual the modules are, one that was never heard among them.
  // Noting another process may end the life of `process_`.
  for (const morphbus::lateness_t& lateness : health.lateness) {
    Process* module = Note(message.name.run, lateness.module_name);
    if (module == nullptr) continue;
    module->row.lateness = {lateness.missed, lateness.late, lateness.worst_us};
  }
}

void ProcessTable::Snapshot(int64_t now_ns, SpySnapshot* out) const {
  runs_.ForEach([&](const std::string& /*name*/, const Run& run) {
    const bridge::RunClock& clock = run.clock;
    RunRow row;
    row.run = run.name;
    row.tick = clock.tick();
    row.sim_time_us = clock.time_us();
    row.tick_us = clock.tick_us();
    row.asked_speed = clock.speed();
    row.paused = clock.paused();
    row.ended = clock.ended();
    row.end_reason = clock.end_reason();
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
