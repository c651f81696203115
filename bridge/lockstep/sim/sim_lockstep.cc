#include "bridge/lockstep/sim/sim_lockstep.h"

#include <algorithm>
#include <utility>

#include "bridge/lockstep/participant.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {

SimLockstep::SimLockstep(const Config& config)
    : config_(config),
      attendance_(config.num_modules, config.logger),
      patience_(config.num_modules, config.timing),
      // Real time always has a pace.
      pace_(config.tick_us, config.realtime && config.speed <= 0 ? 1 : config.speed) {
  MORPHBUS_CHECK(config.num_modules > 0);
}

void SimLockstep::AskToLeave(Actions* out) const {
  for (int i = 0; i < config_.num_modules; ++i) {
    if (attendance_.leaving(i)) out->push_back({SimAction::Kind::kAskToLeave, tick_, i});
  }
}

void SimLockstep::TellToLeave(int64_t now_us, Actions* out) {
  if (!attendance_.AnyLeaving() || leave_.armed()) return;
  AskToLeave(out);
  leave_.Arm(now_us, config_.timing.ask_after_us);
}

// What the logger has not acknowledged must still be kept by everybody, hence the window. Whoever
// leaves keeps nothing, and nobody starts its process again: what it has said must be there.
bool SimLockstep::WindowOpen() const {
  const int64_t window = attendance_.AnyLeaving() ? 1 : config_.window;
  return !config_.logger || config_.realtime || tick_ + 1 - acknowledged_ <= window;
}

void SimLockstep::Begin(int64_t now_us, Actions* /*out*/) {
  // They say HELLO until they hear CLOCK. It comes when all are there, or when that takes long.
  phase_ = Phase::kStart;
  silence_.Heard(now_us);
  pace_.CountFrom(tick_, now_us);
  heartbeat_due_us_ = now_us + config_.timing.heartbeat_us;
}

void SimLockstep::PublishClock(int64_t now_us, Actions* out) {
  out->push_back(
      {clock_out_ == tick_ ? SimAction::Kind::kRepeatClock : SimAction::Kind::kPublishClock, tick_,
       -1});
  clock_out_ = tick_;
  heartbeat_due_us_ = now_us + config_.timing.heartbeat_us;
}

void SimLockstep::PublishTick(int64_t now_us, Actions* out) {
  PublishClock(now_us, out);
  out->push_back({SimAction::Kind::kPublishReadings, tick_, -1});
  readings_out_ = tick_;
  patience_.Published(now_us);
  ask_.Arm(now_us, Patience(config_.num_modules));
}

void SimLockstep::OnHello(int process, int64_t now_us, Actions* out) {
  // After an early end, whoever joins now must still hear of it.
  const bool joins = phase_ == Phase::kStart || phase_ == Phase::kEnding;
  if (!joins || !attendance_.Greet(process)) return;
  silence_.Heard(now_us);
  if (phase_ == Phase::kEnding) return;
  if (attendance_.AllGreeted()) PublishTick(now_us, out);
  TryAdvance(now_us, out);
}

void SimLockstep::OnActuator(int module, int64_t tick, int64_t now_us, Actions* out) {
  if (phase_ != Phase::kStart && phase_ != Phase::kRun) return;
  // A repetition, which is common after loss, says nothing but that we may have asked too soon.
  const bool first = tick == tick_ && attendance_.Answer(module);
  if (!first) return patience_.AnsweredAgain(module, tick, tick == tick_, now_us);
  silence_.Heard(now_us);
  patience_.Answered(module, tick, now_us);
  const int answers = attendance_.num_answers(), missing = attendance_.num_missing();
  if (answers == 1 && patience_.LearnAtFirstAnswer(tick_)) {
    ask_.Arm(patience_.published_us(), Patience(config_.num_modules));
  }
  if (missing == 0 && phase_ == Phase::kRun) patience_.Measure(tick_, answers);
  // What is missing now decides how long the next request waits.
  if (missing > 0) ask_.Progress(Patience(missing));
  TryAdvance(now_us, out);
}

void SimLockstep::OnLogAck(int64_t tick, int64_t now_us, Actions* out) {
  // An acknowledgement of the future, or an old one, says nothing.
  if (tick <= acknowledged_ || tick > tick_) return;
  acknowledged_ = tick;
  silence_.Heard(now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::OnEndAck(int process, int64_t now_us, Actions* out) {
  // A module that was told to leave says by this that it has.
  if (attendance_.Leave(process)) {
    silence_.Heard(now_us);
    if (!attendance_.AnyLeaving()) leave_.Disarm();
    if (phase_ == Phase::kEnding) return ConcludeIfAcknowledged(now_us, out);
    return TryAdvance(now_us, out);
  }
  // Only an acknowledgement of an END that is out can mean anything.
  if (phase_ != Phase::kEnding || !attendance_.Acknowledge(process)) return;
  silence_.Heard(now_us);
  ConcludeIfAcknowledged(now_us, out);
}

void SimLockstep::OnVerdictAck(int64_t now_us, Actions* out) {
  // The verdict is the last thing that anybody has to confirm.
  if (phase_ != Phase::kConcluding) return;
  silence_.Heard(now_us);
  Finish(out);
}

void SimLockstep::TryAdvance(int64_t now_us, Actions* out) {
  if (phase_ != Phase::kStart && phase_ != Phase::kRun) return;
  // Nothing moves before all have joined, then before all have answered, then before the logger has
  // caught up, then before it is time.
  if (phase_ == Phase::kStart && !attendance_.AllGreeted()) return;
  if (config_.realtime) return TryRealtime(now_us, out);
  if (!attendance_.AllAnswered()) return;
  if (paused_ && steps_ == 0 && !stop_) return Hold();
  // Whoever is to be gone in the next tick leaves after its answer to this one, once the logger has
  // that. A run that ends now loses nobody.
  if (attendance_.AnyLeaving() && !stop_) {
    if (!WindowOpen()) return AwaitLogger(now_us);
    holding_ = false;
    ask_.Disarm();
    return TellToLeave(now_us, out);
  }
  if (barrier_ && !stop_) {
    if (!std::exchange(at_barrier_, true)) out->push_back({SimAction::Kind::kAtBarrier, tick_, -1});
    return Hold();
  }
  if (!WindowOpen()) return AwaitLogger(now_us);
  // A single step and a stop do not wait for the pace.
  if (now_us < pace_.StartUs(tick_ + 1) && steps_ == 0 && !stop_) return Hold();
  AdvanceOneTick(now_us, out);
}

int64_t SimLockstep::TickOverUs() const {
  const int64_t due = pace_.StartUs(tick_ + 1);
  return stop_ ? std::min(due, patience_.published_us() + config_.tick_us) : due;
}

void SimLockstep::TryRealtime(int64_t now_us, Actions* out) {
  constexpr int64_t kHopelesslyLate = 5;  // Ticks; beyond, the pace starts anew.
  if (phase_ == Phase::kStart) {
    // Tick 0 begins for everybody once the last one has joined.
    phase_ = Phase::kRun;
    pace_.CountFrom(tick_, now_us);
  }
  if (paused_ && steps_ == 0 && !stop_) return Hold();
  ask_.Disarm();
  holding_ = false;
  if (now_us < TickOverUs() && !(stop_ && attendance_.AllAnswered())) return;
  // The wall does not wait: who has not answered by now missed a deadline.
  missed_deadlines_ += attendance_.num_missing();
  TellToLeave(now_us, out);
  // A sim that fell far behind the wall, or was stopped, does not rush to catch up.
  if (now_us >= pace_.StartUs(tick_ + 1 + kHopelesslyLate)) {
    missed_deadlines_ += kHopelesslyLate;
    pace_.CountFrom(tick_, now_us - config_.tick_us);
  }
  // Nobody is asked for anything in real time but to acknowledge END.
  AdvanceOneTick(now_us, out);
  ask_.Disarm();
  if (phase_ == Phase::kEnding) ask_.Arm(now_us, config_.timing.ask_after_us);
}

void SimLockstep::AdvanceOneTick(int64_t now_us, Actions* out) {
  patience_.TickOver(tick_);
  // The commands of this tick move the robot; the next tick begins unanswered.
  out->push_back({SimAction::Kind::kAdvance, tick_, -1});
  ++tick_;
  if (paused_ && steps_ > 0) --steps_;
  // For those that are lost nobody waits.
  attendance_.BeginTick();
  holding_ = false;
  phase_ = Phase::kRun;
  // After the last tick comes END instead of sensors; else the next tick goes out and is awaited.
  if (stop_ || tick_ == config_.num_ticks) return EnterEnding(now_us, out);
  PublishTick(now_us, out);
}

/// Too far ahead of the logger: the ask timer polls it until it has caught up.
void SimLockstep::AwaitLogger(int64_t now_us) {
  holding_ = false;
  if (!ask_.armed()) ask_.Arm(now_us, config_.timing.ask_after_us);
}

/// Nothing is missing and nobody is asked.
void SimLockstep::Hold() {
  ask_.Disarm();
  holding_ = true;
}

/// Now and then the sim says that it lives though the tick stays the same, so that nobody gives it
/// up; who missed something of the tick gets it once more.
void SimLockstep::Heartbeat(int64_t now_us, Actions* out) {
  if (now_us < heartbeat_due_us_ || phase_ >= Phase::kEnding) return;
  PublishClock(now_us, out);
  if (readings_out_ == tick_) out->push_back({SimAction::Kind::kRepeatReadings, tick_, -1});
  out->push_back({SimAction::Kind::kSayProgress, tick_, -1});
}

void SimLockstep::EnterEnding(int64_t now_us, Actions* out) {
  // Acknowledging takes about as long as answering a tick. Who has acknowledged leaves when it
  // hears nothing for a while, so END is said again often enough that no loss makes anybody miss it
  // so long.
  constexpr int64_t kEndsAWhile = 16;
  const int64_t pause_us =
      std::min(Patience(config_.num_modules), config_.timing.linger_us / kEndsAWhile);
  phase_ = Phase::kEnding;
  holding_ = false;
  leave_.Disarm();
  // A run that ends before it has begun still has one whole tick.
  if (readings_out_ < 0) PublishTick(now_us, out);
  // Everybody is told and must acknowledge; END is repeated by the ask timer until then.
  out->push_back({SimAction::Kind::kPublishEnd, tick_, -1});
  ask_.Arm(now_us, pause_us);
  silence_.Heard(now_us);
  ConcludeIfAcknowledged(now_us, out);
}

void SimLockstep::ConcludeIfAcknowledged(int64_t now_us, Actions* out) {
  // Who has not joined cannot acknowledge, but may be about to join: CheckSilence ends the wait.
  for (int i = 0; i < attendance_.size(); ++i) {
    if (!attendance_.acknowledged(i) && (attendance_.greeted(i) || !IsSilent(i))) return;
  }
  Conclude(now_us, out);
}

void SimLockstep::Conclude(int64_t now_us, Actions* out) {
  // Who acknowledged END though it was silent before had waited for another one, which did not.
  std::vector<int> unheard;
  for (int i = 0; i < attendance_.size(); ++i) {
    const bool joined = attendance_.greeted(i);
    const bool never_joined = !joined && IsSilent(i);
    if (never_joined || (joined && !attendance_.acknowledged(i))) unheard.push_back(i);
  }
  if (!unheard.empty()) silent_ = unheard;
  // The log's END must say how the run ended, so the logger is told and has to confirm it.
  if (!config_.logger || !attendance_.acknowledged(logger_number())) return Finish(out);
  phase_ = Phase::kConcluding;
  out->push_back({SimAction::Kind::kTellVerdict, tick_, logger_number()});
  ask_.Arm(now_us, config_.timing.ask_after_us);
  silence_.Heard(now_us);
}

void SimLockstep::Finish(Actions* out) {
  // Leaving is not acknowledged: who misses LEAVE leaves after a second of silence.
  out->push_back({SimAction::Kind::kLeaveAll, tick_, -1});
  out->push_back({SimAction::Kind::kFinish, tick_, -1});
  phase_ = Phase::kDone;
  ask_.Disarm();
}

bool SimLockstep::IsSilent(int process) const {
  return std::find(silent_.begin(), silent_.end(), process) != silent_.end();
}

bool SimLockstep::OnlySilentMissing() const {
  for (int i = 0; i < attendance_.size(); ++i) {
    if (attendance_.greeted(i) && !attendance_.acknowledged(i) && !IsSilent(i)) return false;
  }
  return true;
}

void SimLockstep::CheckSilence(int64_t now_us, Actions* out) {
  const int64_t silence = silence_.Poll(now_us);
  const LockstepTiming& timing = config_.timing;
  // While the sim itself holds still, or runs by the clock, nobody owes it anything.
  if (holding_ || (config_.realtime && phase_ == Phase::kRun)) return silence_.Heard(now_us);
  // How long a silence may last depends on what the sim waits for.
  int64_t limit = timing.run_silence_us;
  if (phase_ == Phase::kStart && !attendance_.AllGreeted()) limit = timing.join_silence_us;
  if (phase_ >= Phase::kEnding) limit = timing.end_silence_us;
  // Those that were silent before END have had their time already.
  if (phase_ == Phase::kEnding && OnlySilentMissing()) limit = timing.linger_us;
  if (silence >= limit) GiveUpOnSilent(now_us, out);
}

void SimLockstep::GiveUpOnSilent(int64_t now_us, Actions* out) {
  // After END nobody else is waited for: the run ends with what is known.
  if (phase_ == Phase::kEnding) return Conclude(now_us, out);
  if (phase_ == Phase::kConcluding) {
    silent_.push_back(logger_number());
    return Finish(out);
  }
  if (phase_ != Phase::kStart && phase_ != Phase::kRun) return;
  // Whoever the next step waits for: first for all to join, then for answers, then for the logger.
  for (int i = 0; i < attendance_.size(); ++i) {
    const bool logger = i == logger_number();
    bool awaited = logger;
    if (!attendance_.AllGreeted()) {
      awaited = !attendance_.greeted(i);
    } else if (!attendance_.AllAnswered()) {
      awaited = !logger && !attendance_.answered(i);
    } else if (attendance_.AnyLeaving() && WindowOpen()) {
      awaited = !logger && attendance_.leaving(i);
    }
    if (awaited) silent_.push_back(i);
  }
  EnterEnding(now_us, out);
}

void SimLockstep::OnTime(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  // Silence first: it may end the run.
  CheckSilence(now_us, out);
  if (phase_ == Phase::kDone) return;
  if (ask_.Fire(now_us, config_.timing)) OnAskTimer(out);
  if (leave_.Fire(now_us, config_.timing)) AskToLeave(out);
  TryAdvance(now_us, out);
  Heartbeat(now_us, out);
}

void SimLockstep::OnAskTimer(Actions* out) {
  // After the last tick only END and the verdict are repeated.
  if (phase_ == Phase::kEnding) {
    out->push_back({SimAction::Kind::kRepeatEnd, tick_, -1});
    return out->push_back({SimAction::Kind::kSayProgress, tick_, -1});
  }
  if (phase_ == Phase::kConcluding) {
    return out->push_back({SimAction::Kind::kTellVerdict, tick_, logger_number()});
  }
  if (!attendance_.AllAnswered()) return AskForAnswers(out);
  // All answers are there, so if we wait it is for the logger.
  if (!WindowOpen()) out->push_back({SimAction::Kind::kPollLogger, tick_, -1});
}

void SimLockstep::AskForAnswers(Actions* out) {
  patience_.BeginAsking(tick_, attendance_.num_answers(), phase_ == Phase::kRun);
  // The request comes first: it reaches a module that has answered, and says nothing to one that
  // lacks SENSORS, which come behind it.
  for (int i = 0; i < config_.num_modules; ++i) {
    if (attendance_.answered(i)) continue;
    patience_.Ask(i, tick_);
    out->push_back({SimAction::Kind::kAskModule, tick_, i});
  }
  out->push_back({SimAction::Kind::kRepeatReadings, tick_, -1});
}

void SimLockstep::OnPublished(int64_t now_us) {
  silence_.Heard(now_us);
  patience_.Published(now_us);
  // The time to answer begins now, not when the physics began.
  if (ask_.armed() && phase_ <= Phase::kRun) ask_.Arm(now_us, Patience(config_.num_modules));
}

void SimLockstep::Stop(bool at_once, int64_t now_us, Actions* out) {
  if (phase_ >= Phase::kEnding) return;
  // A stop lets the current tick finish, so that the log ends with a whole one.
  stop_ = true;
  if (at_once || phase_ == Phase::kStart) return EnterEnding(now_us, out);
  TryAdvance(now_us, out);
}

void SimLockstep::Pause() { paused_ = true; }

void SimLockstep::Resume(int64_t now_us, Actions* out) {
  if (!paused_) return;
  paused_ = false;
  // Steps that were asked for but not run yet are forgotten, and the pause is not caught up.
  steps_ = 0;
  pace_.CountFrom(tick_, now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::Step(int64_t ticks, int64_t now_us, Actions* out) {
  if (!paused_) return;
  // In real time the pause is not caught up: the next tick is due now, but for one that has only
  // begun, and others follow at the pace, which leaves modules their time to answer.
  if (config_.realtime && steps_ == 0) {
    pace_.CountFrom(tick_, patience_.published_us());
    pace_.CountFrom(tick_ + 1, std::max(now_us, pace_.StartUs(tick_ + 1)));
  }
  steps_ += ticks;
  TryAdvance(now_us, out);
}

void SimLockstep::SetSpeed(double speed, int64_t now_us, Actions* out) {
  // Real time always has a pace; the new one counts from the present tick.
  pace_.SetSpeed(config_.realtime && speed <= 0 ? 1 : speed);
  pace_.CountFrom(tick_, now_us);
  TryAdvance(now_us, out);
}

void SimLockstep::Lose(int module, int64_t now_us, Actions* out) {
  if (phase_ >= Phase::kEnding || attendance_.lost(module)) return;
  // Behind the last tick there is none in which the module could be gone.
  if (tick_ + 1 == config_.num_ticks) return;
  attendance_.AskToLeave(module);
  // The wall does not wait for a farewell.
  if (config_.realtime) attendance_.GoOnWithout(module);
  TryAdvance(now_us, out);
}

void SimLockstep::PassBarrier(int64_t now_us, Actions* out) {
  barrier_ = at_barrier_ = false;
  TryAdvance(now_us, out);
}

int64_t SimLockstep::next_deadline_us() const {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return kNever;
  // The earliest of what can become due by itself.
  int64_t next = std::min({ask_.due_us(), leave_.due_us(), silence_.next_poll_us()});
  if (phase_ < Phase::kEnding) next = std::min(next, heartbeat_due_us_);
  const bool waits_for_pace = holding_ || (config_.realtime && phase_ == Phase::kRun);
  const bool moves = !paused_ || steps_ > 0 || (config_.realtime && stop_);
  if (waits_for_pace && moves && pace_.limited()) {
    next = std::min(next, config_.realtime ? TickOverUs() : pace_.StartUs(tick_ + 1));
  }
  return next;
}

}  // namespace morphbus::bridge
