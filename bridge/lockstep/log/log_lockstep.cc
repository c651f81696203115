#include "bridge/lockstep/log/log_lockstep.h"

#include <algorithm>
#include <limits>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/lockstep/participant.h"

namespace morphbus::bridge {
namespace {

/// Numbers beyond a gap that are remembered for one channel at most; far more than a window of
/// ticks can hold.
constexpr size_t kMostBeyond = 4096;
/// Gaps asked for in one round and channel at most; the rest follows in later rounds.
constexpr int kMostGapsAChannel = 32;
/// A listener in real time gives a gap up after so many later messages.
constexpr size_t kPatience = 64;

}  // namespace

LogLockstep::LogLockstep(const Config& config) : config_(config) {}

bool LogLockstep::ReceivedSet::Take(int64_t sequence, bool realtime) {
  // Below `next` everything is there already, or was given up and is late.
  if (sequence < next) return given_up.Fill(sequence);
  if (sequence > next) {
    // A number beyond a gap is remembered until the gap is filled.
    const auto at = std::lower_bound(beyond.begin(), beyond.end(), sequence);
    if ((at != beyond.end() && *at == sequence) || beyond.size() >= kMostBeyond) return false;
    beyond.insert(at, sequence);
    // In real time nobody will send it again.
    if (realtime && beyond.size() > kPatience) {
      given_up.Add(next, beyond.front());
      next = beyond.front();
    }
  } else {
    ++next;
  }
  // What follows on without a gap moves over from `beyond`.
  size_t used = 0;
  while (used < beyond.size() && beyond[used] == next) ++used, ++next;
  beyond.erase(beyond.begin(), beyond.begin() + static_cast<std::ptrdiff_t>(used));
  return true;
}

void LogLockstep::Begin(int64_t now_us, Actions* out) {
  phase_ = Phase::kRun;
  silence_.Heard(now_us);
  out->push_back({LogAction::Kind::kHello});
  hello_.Said(now_us);
}

int LogLockstep::ModuleNumber(std::string_view name) const {
  const auto found = numbers_.find(name);
  return found == numbers_.end() ? -1 : found->second;
}

int LogLockstep::AddModule(const std::string& name) {
  const int known = ModuleNumber(name);
  if (known >= 0 || num_modules_ < 0) return known;
  // CLOCK has told how many there are: one more is nobody of this run.
  if (names_.size() >= static_cast<size_t>(num_modules_)) return -1;
  numbers_.emplace(name, static_cast<int>(names_.size()));
  names_.push_back(name);
  modules_.emplace_back();
  return static_cast<int>(names_.size()) - 1;
}

bool LogLockstep::InWindow(int64_t tick) const {
  return config_.realtime ||
         (tick >= complete_tick_ - config_.window && tick <= complete_tick_ + config_.window);
}

LogLockstep::Taken LogLockstep::OnClock(int64_t sequence, int64_t tick, int phase, int num_modules,
                                        int sensors_parts, int world_parts, int64_t now_us,
                                        Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return Taken::kKnown;
  if (!InWindow(tick)) return Taken::kOutside;
  hello_.SimHeard();
  const bool end = phase == morphbus::sim_clock_t::PHASE_END;
  if (!end && sequence != tick) return Taken::kMisnumbered;
  // The first CLOCK tells what a whole tick consists of, and all others say the same.
  if (num_modules_ < 0) {
    num_modules_ = num_modules;
    sensors_parts_ = sensors_parts;
    world_parts_ = world_parts;
  }
  if (end) return OnEnd(tick, now_us, out);
  const bool fresh = clock_.Take(sequence, config_.realtime);
  // The sim has begun to listen, perhaps after we spoke.
  if (fresh && phase == morphbus::sim_clock_t::PHASE_START && complete_tick_ <= 0) {
    out->push_back({LogAction::Kind::kHello});
  }
  return Note(fresh, tick, now_us, out);
}

LogLockstep::Taken LogLockstep::OnEnd(int64_t tick, int64_t now_us, Actions* out) {
  // From here on nothing new can come; END carries the tick after the last one, or one that was not
  // answered.
  if (end_tick_ >= 0) return Taken::kKnown;
  end_tick_ = tick;
  silence_.Heard(now_us);
  standstill_.Heard(now_us);
  AcknowledgeAndAsk(now_us, out);
  return Taken::kFresh;
}

LogLockstep::Taken LogLockstep::OnPart(Topic topic, int64_t sequence, int64_t tick, int64_t now_us,
                                       Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return Taken::kKnown;
  if (!InWindow(tick)) return Taken::kOutside;
  if (num_modules_ < 0) return Unknown(tick, now_us, out);
  // These channels have a fixed number of messages a tick.
  const int parts = topic == Topic::kSensors ? sensors_parts_ : world_parts_;
  if (parts < 1 || sequence / parts != tick) return Taken::kMisnumbered;
  ReceivedSet& received = topic == Topic::kSensors ? sensors_ : world_;
  return Note(received.Take(sequence, config_.realtime), tick, now_us, out);
}

LogLockstep::Taken LogLockstep::OnModule(Topic topic, int module, int64_t sequence, int64_t tick,
                                         int64_t status_count, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return Taken::kKnown;
  if (!InWindow(tick)) return Taken::kOutside;
  if (module < 0 || static_cast<size_t>(module) >= modules_.size()) {
    return Unknown(tick, now_us, out);
  }
  // Whoever has left is silent. In real time it may say a little more before it does.
  if (!config_.realtime && !lost_.empty() && tick >= EndOf(static_cast<size_t>(module))) {
    return Taken::kMisnumbered;
  }
  Module& m = modules_[module];
  ReceivedSet& received = topic == Topic::kTransform
                              ? m.transform
                              : (topic == Topic::kActuator ? m.actuator : m.status);
  // A module says one of each a tick, but for STATUS, of which a window holds no more than so many.
  const bool numbered = topic != Topic::kStatus;
  // In real time it may leave out some ticks, and then its numbers stay behind.
  if (numbered && (config_.realtime ? sequence > tick : sequence != tick))
    return Taken::kMisnumbered;
  if (sequence >= received.next + static_cast<int64_t>(kMostBeyond)) return Taken::kMisnumbered;
  if (status_count > m.status.next + static_cast<int64_t>(kMostBeyond)) return Taken::kMisnumbered;
  // STATUS is not sent every tick: ACTUATOR tells how many there are by now.
  const bool fresh = received.Take(sequence, config_.realtime);
  if (fresh && topic == Topic::kActuator && !config_.realtime) {
    const std::pair<int64_t, int64_t> told(tick, status_count);
    m.status_counts.insert(std::ranges::lower_bound(m.status_counts, told), told);
  }
  return Note(fresh, tick, now_us, out);
}

/// A message that cannot be placed before CLOCK and SENSORS have told about the modules: it is
/// asked for again later.
LogLockstep::Taken LogLockstep::Unknown(int64_t tick, int64_t now_us, Actions* out) {
  if (tick > highest_tick_) {
    silence_.Heard(now_us);
    highest_tick_ = tick;
    AcknowledgeAndAsk(now_us, out);
  }
  return Taken::kKnown;
}

LogLockstep::Taken LogLockstep::Note(bool fresh, int64_t tick, int64_t now_us, Actions* out) {
  // What came before is no sign of life: anybody may say that again.
  if (!fresh) return Taken::kKnown;
  silence_.Heard(now_us);
  standstill_.Heard(now_us);
  // A later tick, or one that became whole, may make an acknowledgement or a request due.
  const bool later = tick > highest_tick_;
  if (later) highest_tick_ = tick;
  const int64_t before = complete_tick_;
  UpdateComplete();
  const bool progress = complete_tick_ > before;
  if (progress || later) AcknowledgeAndAsk(now_us, out);
  // Something of a tick that is over: whoever was asked answers, so that asking goes on as before.
  if (tick < highest_tick_ && ask_.armed()) ask_.Progress();
  return Taken::kFresh;
}

void LogLockstep::Lose(const std::string& name, int64_t tick, int64_t now_us, Actions* out) {
  lost_.emplace(name, tick);
  // Without this module a tick may be whole that was not.
  UpdateComplete();
  AcknowledgeAndAsk(now_us, out);
}

int64_t LogLockstep::EndOf(size_t module) const {
  const auto found = lost_.find(names_[module]);
  return found == lost_.end() ? std::numeric_limits<int64_t>::max() : found->second;
}

bool LogLockstep::HasAllOf(size_t module, int64_t tick) const {
  if (!lost_.empty() && tick >= EndOf(module)) return true;
  // A module sends one TRANSFORM and one ACTUATOR a tick, and STATUS as ACTUATOR counts.
  const Module& m = modules_[module];
  if (m.transform.next <= tick || m.actuator.next <= tick) return false;
  return std::ranges::any_of(m.status_counts, [&](const auto& told) {
    return told.first == tick && m.status.next >= told.second;
  });
}

bool LogLockstep::TickComplete(int64_t tick) {
  // The sim's channels have a fixed number of messages a tick, so their count tells.
  if (num_modules_ < 0 || clock_.next <= tick) return false;
  if (sensors_.next < (tick + 1) * sensors_parts_) return false;
  if (world_.next < (tick + 1) * world_parts_) return false;
  if (modules_.size() < static_cast<size_t>(num_modules_)) return false;
  // What a module has said stays said, so nobody is looked at twice.
  while (first_unchecked_ < modules_.size() && HasAllOf(first_unchecked_, tick)) ++first_unchecked_;
  return first_unchecked_ == modules_.size();
}

void LogLockstep::UpdateComplete() {
  // Nobody fills gaps in real time, so CLOCK alone tells how far the run is.
  if (config_.realtime) {
    complete_tick_ = std::max(complete_tick_, clock_.next - 1);
    return;
  }
  while (TickComplete(complete_tick_ + 1)) {
    ++complete_tick_;
    first_unchecked_ = 0;
    // The count of the last whole tick stays: it says how many STATUS there must be by now.
    for (Module& m : modules_) {
      std::erase_if(m.status_counts,
                    [this](const auto& told) { return told.first == complete_tick_ - 1; });
    }
  }
}

void LogLockstep::AcknowledgeEnd(Actions* out) {
  // From here on nothing is asked for any more; the sim tells how the run ended.
  if (phase_ != Phase::kRun || !end_seen()) return;
  phase_ = Phase::kEnded;
  ask_.Disarm();
  out->push_back({LogAction::Kind::kEndAck, complete_tick_});
}

/// Acknowledges what is due, and starts or stops asking.
void LogLockstep::AcknowledgeAndAsk(int64_t now_us, Actions* out) {
  if (complete() || (config_.realtime && end_seen())) AcknowledgeEnd(out);
  if (config_.realtime || phase_ != Phase::kRun) return;
  // An acknowledgement now and then is enough: it must only come before the window closes.
  if (complete_tick_ - acked_tick_ >= config_.ack_every) {
    acked_tick_ = complete_tick_;
    out->push_back({LogAction::Kind::kAck, complete_tick_});
  }
  Actions missing;
  ListMissing(&missing);
  if (missing.empty()) return ask_.Disarm();
  // A request that is due stays due, whatever else comes.
  if (!ask_.armed()) ask_.Arm(now_us, config_.timing.ask_after_us);
}

void LogLockstep::AskForGaps(const ReceivedSet& received, int64_t end, Topic topic, int module,
                             Actions* out) const {
  if (received.next >= end) return;
  // One request for each gap, the one at the end included.
  std::vector<int64_t> there = received.beyond;
  there.push_back(end);
  int gaps = 0;
  int64_t from = received.next;
  for (const int64_t next : there) {
    if (from >= end || gaps >= kMostGapsAChannel) return;
    if (next > from) {
      ++gaps;
      out->push_back({LogAction::Kind::kAskGap, 0, topic, module, from, std::min(next, end) - 1});
    }
    from = next + 1;
  }
}

void LogLockstep::ListMissing(Actions* out) const {
  // All of a tick exists once the next tick, or the end, has been seen: who publishes is in the
  // middle of it before.
  const int64_t end = std::max(highest_tick_, end_tick_);
  if (num_modules_ < 0) {
    if (end > 0) out->push_back({LogAction::Kind::kAskGap, 0, Topic::kClock, -1, 0, 0});
    return;
  }
  AskForGaps(clock_, end, Topic::kClock, -1, out);
  AskForGaps(sensors_, end * sensors_parts_, Topic::kSensors, -1, out);
  AskForGaps(world_, end * world_parts_, Topic::kWorld, -1, out);
  for (size_t i = 0; i < modules_.size(); ++i) {
    const Module& m = modules_[i];
    const int number = static_cast<int>(i);
    const int64_t module_end = std::min(end, EndOf(i));
    AskForGaps(m.transform, module_end, Topic::kTransform, number, out);
    AskForGaps(m.actuator, module_end, Topic::kActuator, number, out);
    if (!m.status_counts.empty()) {
      AskForGaps(m.status, m.status_counts.back().second, Topic::kStatus, number, out);
    }
  }
}

void LogLockstep::OnPoll(int64_t tick, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone || config_.realtime) return;
  silence_.Heard(now_us);
  // It waits for us at this tick, so that all of it must exist by now.
  highest_tick_ = std::max(highest_tick_, tick + 1);
  acked_tick_ = std::max(acked_tick_, complete_tick_);
  out->push_back({LogAction::Kind::kAck, complete_tick_});
  if (!ask_.armed()) AcknowledgeAndAsk(now_us, out);
}

void LogLockstep::OnVerdict(int64_t now_us, Actions* out) {
  // The sim tells it once END was acknowledged.
  if (phase_ != Phase::kEnded) return;
  silence_.Heard(now_us);
  verdict_heard_ = true;
  // The sim tells it until it has heard the acknowledgement, which may have been lost.
  out->push_back({LogAction::Kind::kVerdictAck, complete_tick_});
}

void LogLockstep::OnProgress(int64_t tick, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone || !InWindow(tick)) return;
  silence_.Heard(now_us);
  // The sim waits for processes to join, or for END to be acknowledged: what was said may be lost.
  if (tick == 0 && complete_tick_ <= 0) out->push_back({LogAction::Kind::kHello});
  if (phase_ == Phase::kEnded) out->push_back({LogAction::Kind::kEndAck, complete_tick_});
}

void LogLockstep::OnLeaveAll(Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  phase_ = Phase::kDone;
  out->push_back({LogAction::Kind::kFinish});
}

void LogLockstep::OnTime(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  const int64_t silence = silence_.Poll(now_us);
  if (verdict_heard_ && silence >= config_.timing.linger_us) {
    return OnLeaveAll(out);
  }
  if (silence >= config_.timing.lost_us) {
    phase_ = Phase::kDone;
    out->push_back({LogAction::Kind::kLostSim});
    return;
  }
  // In time before the sim takes us for silent.
  if (standstill_.Poll(now_us) >= config_.timing.end_silence_us / 2) AcknowledgeEnd(out);
  if (hello_.Fire(now_us)) out->push_back({LogAction::Kind::kHello});
  // What is still missing is asked for again, less and less often.
  if (ask_.Fire(now_us, config_.timing)) {
    const size_t before = out->size();
    ListMissing(out);
    if (out->size() == before) ask_.Disarm();
  }
}

int64_t LogLockstep::next_deadline_us() const {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return kNever;
  return std::min({ask_.due_us(), silence_.next_poll_us(), hello_.due_us()});
}

}  // namespace morphbus::bridge
