#include "bridge/lockstep/module/module_lockstep.h"

#include <algorithm>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/participant.h"

namespace morphbus::bridge {

namespace {

/// A module that takes another's place says HELLO so often, microseconds.
constexpr int64_t kJoinUs = 50'000;

/// Ticks after which a module that is silent is no longer kept in mind.
constexpr int64_t kRemembered = 16;

}  // namespace

ModuleLockstep::ModuleLockstep(const Config& config) : config_(config) {}

void ModuleLockstep::Begin(int64_t tick, int64_t now_us, Actions* out) {
  // A resumed module has been greeted before; it goes on where it was.
  phase_ = tick == kUnknownTick ? Phase::kJoining : Phase::kRun;
  tick_ = std::max<int64_t>(tick, 0);
  silence_.Heard(now_us);
  if (tick > 0) return;
  out->push_back({ModuleAction::Kind::kHello, 0, 0});
  hello_.Said(now_us);
  if (phase_ == Phase::kJoining) ask_.Arm(now_us, kJoinUs);
}

void ModuleLockstep::OnAdmit(int64_t tick, int64_t now_us) {
  // Whoever has begun knows where it is.
  if (phase_ != Phase::kJoining) return;
  phase_ = Phase::kRun;
  tick_ = tick;
  ask_.Disarm();
  silence_.Heard(now_us);
}

void ModuleLockstep::OnLeave(int64_t now_us, Actions* out) {
  if (phase_ != Phase::kRun && phase_ != Phase::kLeft) return;
  // The sim asks until it has heard the acknowledgement, which may have been lost.
  phase_ = Phase::kLeft;
  ask_.Disarm();
  silence_.Heard(now_us);
  out->push_back({ModuleAction::Kind::kEndAck, tick_, 0});
}

bool ModuleLockstep::InWindow(int64_t tick) const {
  return config_.realtime || (tick >= tick_ - 1 - kKeptTicks && tick <= tick_);
}

bool ModuleLockstep::FinishOncePast(int64_t tick, Actions* out) {
  // The wall does not wait for us to leave.
  if (phase_ != Phase::kLeft || config_.realtime || tick <= tick_) return false;
  Finish(out);
  return true;
}

void ModuleLockstep::OnClock(int64_t tick, int phase, int64_t now_us, Actions* out) {
  const bool end = phase == morphbus::sim_clock_t::PHASE_END;
  if (FinishOncePast(tick, out)) return;
  if (phase_ != Phase::kRun && (phase_ != Phase::kLeft || !end)) return;
  // What is over for long, or of a tick that we shall not compute, is no sign of life.
  if (!InWindow(tick)) return;
  hello_.SimHeard();
  // Nor is what came before: anybody may say that again.
  if (end ? end_tick_ >= 0 : tick <= clock_tick_) return;
  silence_.Heard(now_us);
  clock_tick_ = tick;
  if (end) {
    end_tick_ = tick;
    return out->push_back({ModuleAction::Kind::kEndAck, tick_, 0});
  }
  // The sim has begun to listen, perhaps after we spoke; later we have long said so.
  if (phase == morphbus::sim_clock_t::PHASE_START && tick_ <= 1) {
    out->push_back({ModuleAction::Kind::kHello, 0, 0});
  }
}

void ModuleLockstep::OnAsked(int64_t tick, int64_t now_us) {
  if (InWindow(tick) && end_tick_ < 0) silence_.Heard(now_us);
}

void ModuleLockstep::OnProgress(int64_t tick, int64_t now_us, Actions* out) {
  if (FinishOncePast(tick, out)) return;
  if ((phase_ != Phase::kRun && phase_ != Phase::kLeft) || !InWindow(tick)) return;
  // In real time a module that has left waits for nobody.
  if (phase_ == Phase::kRun || !config_.realtime) {
    silence_.Heard(now_us);
    ahead_tick_ = -1;
  }
  // The sim waits for processes to join, or for END to be acknowledged: what was said may be lost.
  if (tick == 0 && tick_ <= 1) out->push_back({ModuleAction::Kind::kHello, 0, 0});
  if (end_tick_ >= 0) out->push_back({ModuleAction::Kind::kEndAck, tick_, 0});
}

ModuleLockstep::Taken ModuleLockstep::OnSensors(int64_t tick, int part, int num_parts, bool mine,
                                                const std::vector<uint16_t>& mates, int64_t now_us,
                                                Actions* out) {
  if (left()) {
    // Who publishes SENSORS of a tick has all that the one before it waited for.
    FinishOncePast(tick + 1, out);
    return Taken::kForOthers;
  }
  if (!InWindow(tick) || part < 0 || part >= num_parts) {
    // In lockstep nothing of a later tick can exist before we answered this one, unless another
    // process did.
    if (phase_ == Phase::kRun && tick > tick_) ahead_tick_ = tick;
    return Taken::kImpossible;
  }
  if (phase_ != Phase::kRun) return Taken::kKnown;
  // In real time what came for an older tick no longer matters.
  if (config_.realtime && tick > tick_) {
    tick_ = tick;
    parts_.clear();
    have_reading_ = false;
  }
  if (tick != tick_) return Taken::kKnown;
  // The first part tells how many there are.
  if (parts_.empty() || num_parts != num_parts_) {
    num_parts_ = num_parts;
    parts_.assign(static_cast<size_t>(num_parts), false);
  }
  // A part that came before is a repetition.
  if (parts_[part]) return Taken::kKnown;
  parts_[part] = true;
  silence_.Heard(now_us);
  ahead_tick_ = -1;
  // Our own reading says which neighbours the tick waits for.
  const bool counts = mine && !have_reading_;
  if (counts) {
    have_reading_ = true;
    mates_ = mates;
  }
  TryCompute(now_us, out);
  return Taken::kFresh;
}

ModuleLockstep::Taken ModuleLockstep::OnTransform(uint16_t mate, int64_t sequence, int64_t tick,
                                                  int64_t now_us, Actions* out) {
  if (left()) return Taken::kForOthers;
  // In lockstep the number is the tick.
  if (!InWindow(tick) || tick < 0 || (!config_.realtime && sequence != tick)) {
    return Taken::kImpossible;
  }
  // Only this tick's and the last one's messages are of use; a slot holds one of each parity.
  if (phase_ == Phase::kIdle || (!config_.realtime && tick < tick_ - 1)) return Taken::kKnown;
  int64_t& slot = FindOrAdd(mate)->ticks[tick & 1];
  if (slot >= tick) return Taken::kKnown;
  slot = tick;
  if (phase_ == Phase::kRun) TryCompute(now_us, out);
  return Taken::kFresh;
}

void ModuleLockstep::Forget(uint16_t mate) {
  std::erase_if(heard_, [mate](const Mate& entry) { return entry.id == mate; });
}

ModuleLockstep::Mate* ModuleLockstep::FindOrAdd(uint16_t id) {
  const auto at =
      std::lower_bound(heard_.begin(), heard_.end(), id,
                       [](const Mate& mate, uint16_t other) { return mate.id < other; });
  if (at != heard_.end() && at->id == id) return &*at;
  return &*heard_.insert(at, {id, {-1, -1}});
}

bool ModuleLockstep::Has(uint16_t mate, int64_t tick) const {
  return std::any_of(heard_.begin(), heard_.end(),
                     [&](const Mate& m) { return m.id == mate && m.ticks[tick & 1] == tick; });
}

int64_t ModuleLockstep::NewestOf(uint16_t mate) const {
  const auto found = std::ranges::find(heard_, mate, &Mate::id);
  return found == heard_.end() ? -1 : std::max(found->ticks[0], found->ticks[1]);
}

bool ModuleLockstep::Complete() const {
  return have_reading_ && (knows_all_ || std::all_of(parts_.begin(), parts_.end(),
                                                     [](bool there) { return there; }));
}

void ModuleLockstep::TryCompute(int64_t now_us, Actions* out) {
  if (!Complete()) return;
  knows_all_ = true;
  // A tick is computed on what the neighbours said in the tick before; at tick 0 they have said
  // nothing.
  const bool mates_heard =
      tick_ == 0 || config_.realtime ||
      std::all_of(mates_.begin(), mates_.end(), [&](uint16_t id) { return Has(id, tick_ - 1); });
  if (!mates_heard) {
    // They had sent it before the sim went on to this tick.
    if (!ask_.armed()) ask_.Arm(now_us, config_.timing.ask_lost_after_us);
    return;
  }
  // All is there: the tick is computed, and the next one begins with nothing.
  out->push_back({ModuleAction::Kind::kCompute, tick_, 0});
  ++tick_;
  parts_.clear();
  have_reading_ = false;
  mates_.clear();
  // Who was mated long ago, or never, is forgotten.
  std::erase_if(heard_, [this](const Mate& mate) {
    return std::max(mate.ticks[0], mate.ticks[1]) < tick_ - kRemembered;
  });
  ask_.Disarm();
}

void ModuleLockstep::OnLeaveAll(Actions* out) {
  // The sim waits until every module has acknowledged END or LEAVE. A process that has heard
  // neither is one too many: another plays the module.
  const bool told = phase_ == Phase::kLeft || (phase_ == Phase::kRun && end_tick_ >= 0);
  if (told) Finish(out);
}

void ModuleLockstep::Finish(Actions* out) {
  if (phase_ == Phase::kDone) return;
  phase_ = Phase::kDone;
  out->push_back({ModuleAction::Kind::kFinish, tick_, 0});
}

void ModuleLockstep::OnTime(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  // After END a short silence means that LEAVE was lost; before, a long one that the sim is gone.
  // In real time nothing else tells who has left that the sim has heard it.
  const int64_t silence = silence_.Poll(now_us);
  const bool left = phase_ == Phase::kLeft;
  const bool lingers = end_tick_ >= 0 || (left && config_.realtime);
  if (lingers && silence >= config_.timing.linger_us) return Finish(out);
  if (silence >= config_.timing.lost_us) {
    if (left) return Finish(out);
    phase_ = Phase::kDone;
    if (config_.realtime || ahead_tick_ < 0) {
      out->push_back({ModuleAction::Kind::kLostSim, tick_, 0});
    } else {
      out->push_back({ModuleAction::Kind::kDuplicateProcess, ahead_tick_, 0});
    }
    return;
  }
  // Whoever has computed tick 0 has heard the sim, and from then on says HELLO only when CLOCK
  // asks.
  const bool starting = phase_ == Phase::kRun && tick_ == 0;
  if (starting && hello_.Fire(now_us)) out->push_back({ModuleAction::Kind::kHello, 0, 0});
  if (!ask_.Fire(now_us, config_.timing)) return;
  if (phase_ == Phase::kJoining) out->push_back({ModuleAction::Kind::kHello, 0, 0});
  // Each neighbour whose message is missing is asked for it.
  for (const uint16_t mate : mates_) {
    if (!Has(mate, tick_ - 1)) out->push_back({ModuleAction::Kind::kAskMate, tick_ - 1, mate});
  }
}

int64_t ModuleLockstep::next_deadline_us() const {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return kNever;
  const bool starting = phase_ == Phase::kRun && tick_ == 0;
  const int64_t hello_us = starting ? hello_.due_us() : kNever;
  return std::min({ask_.due_us(), silence_.next_poll_us(), hello_us});
}

}  // namespace morphbus::bridge
