#include "bridge/log_lockstep.h"

#include <algorithm>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/party.h"

namespace morphbus::bridge {
namespace {

using Kind = LogAction::Kind;

/// Numbers beyond a gap that a row remembers at most; far more than a window of ticks can hold.
constexpr size_t kMostBeyond = 4096;
/// Gaps asked for in one round and row at most; the rest follows in later rounds.
constexpr int kMostGapsARow = 32;
/// A listener in real time gives a gap up after so many later messages.
constexpr size_t kPatience = 64;

}  // namespace

LogLockstep::LogLockstep(const Config& config) : config_(config) {}

bool LogLockstep::Row::Take(int64_t sequence, bool passive) {
  if (sequence < next) return false;
  if (sequence > next) {
    const auto at = std::lower_bound(beyond.begin(), beyond.end(), sequence);
    if ((at != beyond.end() && *at == sequence) || beyond.size() >= kMostBeyond) return false;
    beyond.insert(at, sequence);
    // Passive: nobody will send it again.
    if (passive && beyond.size() > kPatience) next = beyond.front();
  } else {
    ++next;
  }
  size_t used = 0;
  while (used < beyond.size() && beyond[used] == next) ++used, ++next;
  beyond.erase(beyond.begin(), beyond.begin() + static_cast<std::ptrdiff_t>(used));
  return true;
}

void LogLockstep::Begin(int64_t now_us, Actions* out) {
  phase_ = Phase::kRun;
  silence_.Heard(now_us);
  out->push_back({Kind::kHello});
  hello_due_us_ = now_us + SilenceMeter::kLongestStep;
}

int LogLockstep::ModuleNumber(const std::string& name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found != names_.end()) return static_cast<int>(found - names_.begin());
  return -1;
}

int LogLockstep::AddModule(const std::string& name) {
  const int known = ModuleNumber(name);
  if (known >= 0 || num_modules_ < 0) return known;
  if (names_.size() >= static_cast<size_t>(num_modules_)) return -1;
  names_.push_back(name);
  modules_.emplace_back();
  return static_cast<int>(names_.size()) - 1;
}

bool LogLockstep::OnClock(int64_t tick, int phase, int num_modules, int sensors_parts,
                          int world_parts, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return false;
  silence_.Heard(now_us);
  sim_heard_ = true;
  if (num_modules_ < 0) {
    num_modules_ = num_modules;
    sensors_parts_ = sensors_parts;
    world_parts_ = world_parts;
  }
  if (phase == morphbus::sim_clock_t::PHASE_START) out->push_back({Kind::kHello});
  if (phase != morphbus::sim_clock_t::PHASE_END) {
    return Taken(clock_.Take(tick, config_.passive), tick, now_us, out);
  }
  const bool first = end_tick_ < 0;
  if (first) end_tick_ = tick;
  Settle(now_us, first, out);
  // Every END is answered: the acknowledgement may have been lost.
  if (!first && phase_ == Phase::kEnded) out->push_back({Kind::kEndAck, complete_tick_});
  return first;
}

bool LogLockstep::OnPart(Line line, int64_t sequence, int64_t tick, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return false;
  if (num_modules_ < 0) return Unknown(tick, now_us, out);
  Row& row = line == Line::kSensors ? sensors_ : world_;
  return Taken(row.Take(sequence, config_.passive), tick, now_us, out);
}

bool LogLockstep::OnModule(Line line, int module, int64_t sequence, int64_t tick,
                           int64_t status_count, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return false;
  if (module < 0 || static_cast<size_t>(module) >= modules_.size()) {
    return Unknown(tick, now_us, out);
  }
  Module& m = modules_[static_cast<size_t>(module)];
  Row& row =
      line == Line::kTransform ? m.transform : (line == Line::kActuator ? m.actuator : m.status);
  const bool fresh = row.Take(sequence, config_.passive);
  if (fresh && line == Line::kActuator && !config_.passive) m.status_counts[tick] = status_count;
  return Taken(fresh, tick, now_us, out);
}

/// A message that cannot be placed before CLOCK and SENSORS have told about the modules: it is
/// asked for again later.
bool LogLockstep::Unknown(int64_t tick, int64_t now_us, Actions* out) {
  silence_.Heard(now_us);
  if (tick > highest_tick_) {
    highest_tick_ = tick;
    Settle(now_us, false, out);
  }
  return false;
}

bool LogLockstep::Taken(bool fresh, int64_t tick, int64_t now_us, Actions* out) {
  silence_.Heard(now_us);
  if (!fresh) return false;
  const bool later = tick > highest_tick_;
  if (later) highest_tick_ = tick;
  const int64_t before = complete_tick_;
  UpdateComplete();
  const bool progress = complete_tick_ > before;
  if (progress || later) Settle(now_us, progress, out);
  return true;
}

bool LogLockstep::TickComplete(int64_t tick) const {
  if (num_modules_ < 0 || clock_.next <= tick) return false;
  if (sensors_.next < (tick + 1) * sensors_parts_) return false;
  if (world_.next < (tick + 1) * world_parts_) return false;
  if (modules_.size() < static_cast<size_t>(num_modules_)) return false;
  return std::all_of(modules_.begin(), modules_.end(), [tick](const Module& m) {
    if (m.transform.next <= tick || m.actuator.next <= tick) return false;
    const auto count = m.status_counts.find(tick);
    return count != m.status_counts.end() && m.status.next >= count->second;
  });
}

void LogLockstep::UpdateComplete() {
  if (config_.passive) {
    complete_tick_ = std::max(complete_tick_, clock_.next - 1);
    return;
  }
  while (TickComplete(complete_tick_ + 1)) {
    ++complete_tick_;
    for (Module& m : modules_) m.status_counts.erase(complete_tick_ - 1);
  }
}

/// Acknowledges what is due, and starts or stops asking.
void LogLockstep::Settle(int64_t now_us, bool progress, Actions* out) {
  if ((complete() || (config_.passive && end_seen())) && phase_ == Phase::kRun) {
    phase_ = Phase::kEnded;
    ask_.Disarm();
    out->push_back({Kind::kEndAck, complete_tick_});
    return;
  }
  if (config_.passive || phase_ != Phase::kRun) return;
  if (complete_tick_ - acked_tick_ >= config_.ack_every) {
    acked_tick_ = complete_tick_;
    out->push_back({Kind::kAck, complete_tick_});
  }
  if (ask_.armed() && !progress) return;
  Actions missing;
  ListMissing(&missing);
  if (missing.empty()) {
    ask_.Disarm();
  } else {
    ask_.Arm(now_us, config_.timing);
  }
}

void LogLockstep::AskRow(const Row& row, int64_t end, Line line, int module, Actions* out) const {
  int gaps = 0;
  int64_t from = row.next;
  for (const int64_t there : row.beyond) {
    if (from >= end || gaps >= kMostGapsARow) break;
    if (there > from) {
      ++gaps;
      out->push_back({Kind::kAskGap, 0, line, module, from, std::min(there, end) - 1});
    }
    from = there + 1;
  }
  if (from < end && gaps < kMostGapsARow) {
    out->push_back({Kind::kAskGap, 0, line, module, from, end - 1});
  }
}

void LogLockstep::ListMissing(Actions* out) const {
  // A module's answer to a tick exists once the next tick, or the end, has been seen.
  const int64_t sim_end = std::max(highest_tick_ + 1, end_tick_);
  const int64_t module_end = std::max(highest_tick_, end_tick_);
  if (num_modules_ < 0) {
    if (sim_end > 0) out->push_back({Kind::kAskGap, 0, Line::kClock, -1, 0, 0});
    return;
  }
  AskRow(clock_, sim_end, Line::kClock, -1, out);
  AskRow(sensors_, sim_end * sensors_parts_, Line::kSensors, -1, out);
  AskRow(world_, sim_end * world_parts_, Line::kWorld, -1, out);
  for (size_t i = 0; i < modules_.size(); ++i) {
    const Module& m = modules_[i];
    const int number = static_cast<int>(i);
    AskRow(m.transform, module_end, Line::kTransform, number, out);
    AskRow(m.actuator, module_end, Line::kActuator, number, out);
    if (!m.status_counts.empty()) {
      AskRow(m.status, m.status_counts.rbegin()->second, Line::kStatus, number, out);
    }
  }
}

void LogLockstep::OnPoll(int64_t tick, int64_t now_us, Actions* out) {
  if (phase_ != Phase::kRun || config_.passive) return;
  silence_.Heard(now_us);
  highest_tick_ = std::max(highest_tick_, tick);
  acked_tick_ = std::max(acked_tick_, complete_tick_);
  out->push_back({Kind::kAck, complete_tick_});
  if (!ask_.armed()) Settle(now_us, true, out);
}

void LogLockstep::OnBye(Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  if (end_tick_ < 0) return;
  phase_ = Phase::kDone;
  out->push_back({Kind::kFinish});
}

void LogLockstep::OnTime(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  const int64_t silence = silence_.Poll(now_us);
  if (end_tick_ >= 0 && silence >= config_.timing.linger_us && phase_ == Phase::kEnded) {
    return OnBye(out);
  }
  if (silence >= config_.timing.lost_us) {
    phase_ = Phase::kDone;
    out->push_back({Kind::kLostSim});
    return;
  }
  if (!sim_heard_ && now_us >= hello_due_us_) {
    hello_due_us_ = now_us + SilenceMeter::kLongestStep;
    out->push_back({Kind::kHello});
  }
  if (ask_.Fire(now_us, config_.timing)) {
    const size_t before = out->size();
    ListMissing(out);
    if (out->size() == before) ask_.Disarm();
  }
}

int64_t LogLockstep::next_deadline_us() const {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return kNever;
  return std::min(ask_.due_us(), silence_.next_poll_us());
}

std::string LogLockstep::Fingerprint() const {
  std::string print;
  print += static_cast<char>(phase_);
  const auto add = [&print](int64_t number) { print += std::to_string(number) + ','; };
  for (const int64_t n : {highest_tick_, end_tick_, complete_tick_, acked_tick_}) add(n);
  add(num_modules_);
  const auto add_row = [&](const Row& row) {
    print += '|';
    add(row.next);
    for (const int64_t there : row.beyond) add(there);
  };
  for (const Row* row : {&clock_, &sensors_, &world_}) add_row(*row);
  for (size_t i = 0; i < modules_.size(); ++i) {
    print += names_[i];
    for (const Row* row : {&modules_[i].transform, &modules_[i].actuator, &modules_[i].status}) {
      add_row(*row);
    }
    for (const auto& [tick, count] : modules_[i].status_counts) {
      add(tick);
      add(count);
    }
  }
  print += ask_.armed() ? 'a' : '-';
  print += sim_heard_ ? 'h' : '-';
  return print;
}

}  // namespace morphbus::bridge
