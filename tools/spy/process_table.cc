#include "tools/spy/process_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "compiler/base/text.h"

namespace morphbus::tools {
namespace {

// How often a module's poses are looked at: a robot at its fastest sends thousands of TRANSFORMs a
// second, and a screen shows one.
constexpr int64_t kPosePeriodNs = 50'000'000;
// The speed of a run is that of the last seconds, by so many CLOCKs at most.
constexpr int64_t kSpeedNs = 3'000'000'000;
constexpr int64_t kSpeedStepNs = 100'000'000;
// So many shares of a processor are kept of each process.
constexpr size_t kMostCpus = 60;

/// Names in the order of people: m2 before m10.
bool Before(const std::string& a, const std::string& b) {
  const auto number = [](const std::string& name) {
    // Of two numbers at the end the one of fewer digits is the smaller one.
    const size_t at = name.find_last_not_of("0123456789") + 1;
    return std::pair(name.substr(0, at), name.size() - at);
  };
  const auto [a_name, a_digits] = number(a);
  const auto [b_name, b_digits] = number(b);
  if (a_name != b_name) return a_name < b_name;
  return a_digits != b_digits ? a_digits < b_digits : a < b;
}

}  // namespace

ProcessTable::Process* ProcessTable::Note(std::string_view run, std::string_view process) {
  // Two runs may have modules of one name.
  Process* noted = processes_.Take(fmt::format("{}/{}", run, process), now_ns_);
  if (noted == nullptr) return nullptr;
  noted->row.run = run;
  noted->row.process = process;
  // What is neither the simulator nor the logger is a module: the spy has no description that lists
  // them.
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
  run->row.run = message.name.run;
  run->last_ns = now_ns_;
  // A run of the same name that begins anew begins a new row of times.
  auto& clocks = run->clocks;
  const int64_t time_us = clock.header.sim_time_us;
  if (!clocks.empty() && time_us < clocks.back().second) {
    clocks.clear();
    run->row.clock = bridge::RunClock();
  }
  run->row.clock.Take(clock);
  if (clocks.empty() || now_ns_ - clocks.back().first >= kSpeedStepNs) {
    clocks.emplace_back(now_ns_, time_us);
  }
  // Two must stay, or a slow run would never have a speed.
  while (clocks.size() > 2 && now_ns_ - clocks.front().first > kSpeedNs) clocks.pop_front();
}

void ProcessTable::OnStatus(const bridge::RunMessage& /*message*/, morphbus::status_t&& status) {
  process_->row.Take(std::move(status));
}

void ProcessTable::OnTransform(const bridge::RunMessage& /*message*/,
                               morphbus::transform_t&& transform) {
  process_->row.Take(transform);
}

void ProcessTable::OnHealth(const bridge::RunMessage& message, morphbus::health_t&& health) {
  const std::vector<morphbus::lateness_t> told = health.lateness;
  process_->row.Take(std::move(health));
  if (const std::optional<double>& cpu = process_->row.cpu) {
    std::vector<double>& history = process_->row.cpu_history;
    if (history.size() >= kMostCpus) history.erase(history.begin());
    history.push_back(*cpu);
  }
  // The simulator also tells how punctual the modules are, one that was never heard among them.
  // Noting another process may end the life of `process_`.
  for (const morphbus::lateness_t& lateness : told) {
    Process* module = Note(message.name.run, lateness.module_name);
    if (module != nullptr) module->row.lateness = lateness;
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
      const double sim = Seconds(row.clock.time_us() - clocks.front().second);
      row.speed = seconds <= 0.0 ? 0.0 : sim / seconds;
    }
    out->runs.push_back(std::move(row));
  });
  // Ages are in sim time, which needs the run's length of a tick.
  processes_.ForEach([&](const std::string& /*name*/, const Process& process) {
    ProcessRow row = process.row;
    const RunRow* run = out->Run(row.run);
    if (row.has_pose && run != nullptr) {
      row.pose_age_s = Seconds(row.pose_age_ticks * run->clock.tick_us());
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
  const auto found = std::ranges::find(channels, name, &ChannelRow::channel);
  return found == channels.end() ? nullptr : &*found;
}

const RunRow* SpySnapshot::Run(const std::string& name) const {
  const auto found = std::ranges::find(runs, name, &RunRow::run);
  return found == runs.end() ? nullptr : &*found;
}

}  // namespace morphbus::tools
