#include "bridge/sim_lockstep.h"

#include <algorithm>
#include <limits>

#include "bridge/party.h"
#include "compiler/source/check.h"

namespace morphbus::bridge {
namespace {

using Kind = SimAction::Kind;

bool All(const std::vector<bool>& flags) {
  return std::all_of(flags.begin(), flags.end(), [](bool flag) { return flag; });
}

}  // namespace

SimLockstep::SimLockstep(const Config& config) : config_(config) {
  MORPHBUS_CHECK(config.num_modules > 0);
  const auto modules = static_cast<size_t>(config.num_modules);
  hello_.assign(modules + (config.logger ? 1 : 0), false);
  end_acked_ = hello_;
  answered_.assign(modules, false);
  if (config_.realtime && config_.speed <= 0) config_.speed = 1;
}

bool SimLockstep::AllGreeted() const { return All(hello_); }
bool SimLockstep::AllAnswered() const { return All(answered_); }

bool SimLockstep::WindowOpen() const {
  return !config_.logger || config_.realtime || tick_ + 1 - acknowledged_ <= config_.window;
}

int64_t SimLockstep::PacedStartUs(int64_t tick) const {
  if (config_.speed <= 0) return std::numeric_limits<int64_t>::min();
  const double ticks = static_cast<double>(tick - pace_base_tick_);
  return pace_base_us_ + static_cast<int64_t>(ticks * config_.tick_us / config_.speed);
}

void SimLockstep::Rebase(int64_t now_us) {
  pace_base_us_ = now_us;
  pace_base_tick_ = tick_;
}

void SimLockstep::Begin(int64_t now_us, Actions* out) {
  phase_ = Phase::kStart;
  silence_.Heard(now_us);
  Rebase(now_us);
  out->push_back({Kind::kPublishTick, 0, -1});
  beat_due_us_ = now_us + config_.timing.beat_us;
  ask_.Arm(now_us, config_.timing);
}

void SimLockstep::OnHello(int process, int64_t now_us, Actions* out) {
  if (process < 0 || static_cast<size_t>(process) >= hello_.size() || phase_ != Phase::kStart)
    return;
  if (hello_[static_cast<size_t>(process)]) return;
  hello_[static_cast<size_t>(process)] = true;
  silence_.Heard(now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::OnActuator(int module, int64_t tick, int64_t now_us, Actions* out) {
  if (module < 0 || static_cast<size_t>(module) >= answered_.size() || tick != tick_) return;
  if (phase_ != Phase::kStart && phase_ != Phase::kRun) return;
  if (answered_[static_cast<size_t>(module)]) return;
  answered_[static_cast<size_t>(module)] = true;
  silence_.Heard(now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::OnLogAck(int64_t tick, int64_t now_us, Actions* out) {
  if (tick <= acknowledged_ || tick > tick_) return;
  acknowledged_ = tick;
  silence_.Heard(now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::OnEndAck(int process, int64_t now_us, Actions* out) {
  if (process < 0 || static_cast<size_t>(process) >= end_acked_.size()) return;
  if (phase_ != Phase::kEnding || end_acked_[static_cast<size_t>(process)]) return;
  end_acked_[static_cast<size_t>(process)] = true;
  silence_.Heard(now_us);
  FinishIfAcknowledged(out);
}

void SimLockstep::TryAdvance(int64_t now_us, Actions* out) {
  if (phase_ != Phase::kStart && phase_ != Phase::kRun) return;
  if (phase_ == Phase::kStart && !AllGreeted()) return;
  if (config_.realtime) return TryRealtime(now_us, out);
  if (!AllAnswered()) return;
  if (paused_ && steps_ == 0 && !stop_) return Hold();
  if (!WindowOpen()) {
    holding_ = false;
    if (!ask_.armed()) ask_.Arm(now_us, config_.timing);
    return;
  }
  if (now_us < PacedStartUs(tick_ + 1) && steps_ == 0 && !stop_) return Hold();
  AdvanceOneTick(now_us, out);
}

void SimLockstep::TryRealtime(int64_t now_us, Actions* out) {
  constexpr int64_t kHopelesslyLate = 5;  // Ticks; beyond, the pace starts anew.
  if (phase_ == Phase::kStart) {
    // Tick 0 begins for everybody once the last one has joined.
    phase_ = Phase::kRun;
    Rebase(now_us);
  }
  if (paused_ && steps_ == 0 && !stop_) return Hold();
  ask_.Disarm();
  holding_ = false;
  if (now_us < PacedStartUs(tick_ + 1) && steps_ == 0 && !stop_) return;
  missed_deadlines_ += std::count(answered_.begin(), answered_.end(), false);
  if (now_us >= PacedStartUs(tick_ + 1 + kHopelesslyLate)) {
    missed_deadlines_ += kHopelesslyLate;
    Rebase(now_us - config_.tick_us);
  }
  AdvanceOneTick(now_us, out);
  ask_.Disarm();
  if (phase_ == Phase::kEnding) ask_.Arm(now_us, config_.timing);
}

void SimLockstep::AdvanceOneTick(int64_t now_us, Actions* out) {
  out->push_back({Kind::kAdvance, tick_, -1});
  ++tick_;
  if (paused_ && steps_ > 0) --steps_;
  answered_.assign(answered_.size(), false);
  holding_ = false;
  phase_ = Phase::kRun;
  if (stop_ || tick_ == config_.num_ticks) return EnterEnding(now_us, out);
  out->push_back({Kind::kPublishTick, tick_, -1});
  beat_due_us_ = now_us + config_.timing.beat_us;
  ask_.Arm(now_us, config_.timing);
}

/// Nothing is missing and nobody is asked.
void SimLockstep::Hold() {
  ask_.Disarm();
  holding_ = true;
}

/// CLOCK comes now and then though the tick stays the same, so that nobody gives us up.
void SimLockstep::Beat(int64_t now_us, Actions* out) {
  if (now_us < beat_due_us_ || phase_ >= Phase::kEnding) return;
  beat_due_us_ = now_us + config_.timing.beat_us;
  out->push_back({Kind::kRepeatTick, tick_, -1});
}

void SimLockstep::EnterEnding(int64_t now_us, Actions* out) {
  phase_ = Phase::kEnding;
  holding_ = false;
  out->push_back({Kind::kPublishEnd, tick_, -1});
  ask_.Arm(now_us, config_.timing);
  silence_.Heard(now_us);
  FinishIfAcknowledged(out);
}

void SimLockstep::FinishIfAcknowledged(Actions* out) {
  for (size_t i = 0; i < hello_.size(); ++i) {
    // Who never joined cannot acknowledge.
    if (hello_[i] && !end_acked_[i]) return;
  }
  out->push_back({Kind::kBye, tick_, -1});
  out->push_back({Kind::kFinish, tick_, -1});
  phase_ = Phase::kDone;
  ask_.Disarm();
}

void SimLockstep::OnAskTimer(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kEnding) {
    out->push_back({Kind::kRepeatEnd, tick_, -1});
    return;
  }
  if (AllAnswered() && AllGreeted()) {
    if (!WindowOpen()) out->push_back({Kind::kPollLogger, tick_, -1});
    return;
  }
  out->push_back({Kind::kRepeatTick, tick_, -1});
  beat_due_us_ = now_us + config_.timing.beat_us;
  for (size_t i = 0; i < answered_.size(); ++i) {
    if (hello_[i] && !answered_[i]) {
      out->push_back({Kind::kAskModule, tick_, static_cast<int>(i)});
    }
  }
}

void SimLockstep::NoteSilent(int process) {
  if (std::find(silent_.begin(), silent_.end(), process) == silent_.end())
    silent_.push_back(process);
}

void SimLockstep::CheckSilence(int64_t now_us, Actions* out) {
  const int64_t silence = silence_.Poll(now_us);
  const LockstepTiming& timing = config_.timing;
  if (holding_ || (config_.realtime && phase_ == Phase::kRun)) return silence_.Heard(now_us);
  if (phase_ == Phase::kEnding) {
    if (silence < timing.end_silence_us) return;
    for (size_t i = 0; i < hello_.size(); ++i) {
      if (hello_[i] && !end_acked_[i]) NoteSilent(static_cast<int>(i));
    }
    end_acked_.assign(end_acked_.size(), true);
    return FinishIfAcknowledged(out);
  }
  if (silence < (phase_ == Phase::kStart ? timing.join_silence_us : timing.run_silence_us)) return;
  for (size_t i = 0; i < hello_.size(); ++i) {
    const bool module = i < answered_.size();
    const bool slow = module ? !answered_[i] : AllAnswered() && !WindowOpen();
    if (!hello_[i] || slow) NoteSilent(static_cast<int>(i));
  }
  EnterEnding(now_us, out);
}

void SimLockstep::OnTime(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  CheckSilence(now_us, out);
  if (phase_ == Phase::kDone) return;
  if (ask_.Fire(now_us, config_.timing)) OnAskTimer(now_us, out);
  TryAdvance(now_us, out);
  Beat(now_us, out);
}

void SimLockstep::OnPublished(int64_t now_us) {
  silence_.Heard(now_us);
  if (ask_.armed()) ask_.Arm(now_us, config_.timing);
}

void SimLockstep::Stop(bool at_once, int64_t now_us, Actions* out) {
  if (phase_ >= Phase::kEnding) return;
  stop_ = true;
  if (at_once || phase_ == Phase::kStart) return EnterEnding(now_us, out);
  TryAdvance(now_us, out);
}

void SimLockstep::Pause() { paused_ = true; }

void SimLockstep::Resume(int64_t now_us, Actions* out) {
  if (!paused_) return;
  paused_ = false;
  steps_ = 0;
  Rebase(now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::Step(int64_t now_us, Actions* out) {
  if (!paused_) return;
  ++steps_;
  TryAdvance(now_us, out);
}

void SimLockstep::SetSpeed(double speed, int64_t now_us, Actions* out) {
  config_.speed = config_.realtime && speed <= 0 ? 1 : speed;
  Rebase(now_us);
  TryAdvance(now_us, out);
}

int64_t SimLockstep::next_deadline_us() const {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return kNever;
  int64_t next = std::min(ask_.due_us(), silence_.next_poll_us());
  if (phase_ < Phase::kEnding) next = std::min(next, beat_due_us_);
  const bool waits_for_pace = holding_ || (config_.realtime && phase_ == Phase::kRun);
  if (waits_for_pace && !paused_ && config_.speed > 0) {
    next = std::min(next, PacedStartUs(tick_ + 1));
  }
  return next;
}

std::string SimLockstep::Fingerprint() const {
  std::string print;
  print += static_cast<char>(phase_);
  for (const int64_t number : {tick_, acknowledged_, steps_}) print += std::to_string(number) + ',';
  for (const auto* flags : {&hello_, &answered_, &end_acked_}) {
    for (const bool flag : *flags) print += flag ? '1' : '0';
  }
  print += stop_ ? 's' : '-';
  print += paused_ ? 'p' : '-';
  print += holding_ ? 'h' : '-';
  print += ask_.armed() ? 'a' : '-';
  print += std::to_string(silent_.size());
  return print;
}

}  // namespace morphbus::bridge
