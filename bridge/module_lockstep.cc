#include "bridge/module_lockstep.h"

#include <algorithm>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/party.h"

namespace morphbus::bridge {

namespace {

using Kind = ModuleAction::Kind;

/// Ticks after which a module that is silent is no longer kept in mind.
constexpr int64_t kRemembered = 16;

}  // namespace

ModuleLockstep::ModuleLockstep(const Config& config) : config_(config) {}

void ModuleLockstep::Begin(int64_t tick, int64_t now_us, Actions* out) {
  phase_ = Phase::kRun;
  tick_ = tick;
  silence_.Heard(now_us);
  if (tick > 0) return;
  out->push_back({Kind::kHello, 0, 0});
  hello_due_us_ = now_us + SilenceMeter::kLongestStep;
}

void ModuleLockstep::OnClock(int64_t tick, int phase, int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  silence_.Heard(now_us);
  sim_heard_ = true;
  if (phase == morphbus::sim_clock_t::PHASE_END) {
    phase_ = Phase::kEnded;
    ask_.Disarm();
    out->push_back({Kind::kEndAck, tick_, 0});
    return;
  }
  if (phase_ != Phase::kRun) return;
  if (phase == morphbus::sim_clock_t::PHASE_START) {
    out->push_back({Kind::kHello, 0, 0});
  } else if (tick > tick_ && !config_.realtime) {
    // The sim is at `tick` only if somebody answered for us all ticks before it.
    phase_ = Phase::kDone;
    out->push_back({Kind::kIntruder, tick, 0});
  }
}

bool ModuleLockstep::OnSensors(int64_t tick, int part, int num_parts, bool mine,
                               const std::vector<uint16_t>& mates, int64_t now_us, Actions* out) {
  if (phase_ != Phase::kRun || part < 0 || part >= num_parts) return false;
  silence_.Heard(now_us);
  if (config_.realtime && tick > tick_) {
    tick_ = tick;
    parts_.clear();
    have_reading_ = false;
  }
  // In lockstep nothing of a later tick can exist before we answered this one.
  if (tick != tick_) return false;
  if (parts_.empty() || num_parts != num_parts_) {
    num_parts_ = num_parts;
    parts_.assign(static_cast<size_t>(num_parts), false);
  }
  if (parts_[static_cast<size_t>(part)]) return false;
  parts_[static_cast<size_t>(part)] = true;
  const bool counts = mine && !have_reading_;
  if (counts) {
    have_reading_ = true;
    mates_ = mates;
  }
  TryCompute(now_us, out);
  return true;
}

bool ModuleLockstep::OnTransform(uint16_t mate, int64_t tick, int64_t now_us, Actions* out) {
  if (phase_ != Phase::kRun || tick < 0) return false;
  if (!config_.realtime && tick != tick_ && tick != tick_ - 1) return false;
  int64_t& slot = FindOrAdd(mate)->ticks[tick & 1];
  if (slot >= tick) return false;
  slot = tick;
  TryCompute(now_us, out);
  return true;
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

bool ModuleLockstep::Complete() const {
  return have_reading_ && !parts_.empty() &&
         std::all_of(parts_.begin(), parts_.end(), [](bool there) { return there; });
}

void ModuleLockstep::TryCompute(int64_t now_us, Actions* out) {
  if (!Complete()) return;
  const bool mates_heard =
      tick_ == 0 || config_.realtime ||
      std::all_of(mates_.begin(), mates_.end(), [&](uint16_t id) { return Has(id, tick_ - 1); });
  if (!mates_heard) {
    if (!ask_.armed()) ask_.Arm(now_us, config_.timing);
    return;
  }
  out->push_back({Kind::kCompute, tick_, 0});
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

void ModuleLockstep::OnBye(Actions* out) {
  if (phase_ != Phase::kEnded) return;
  phase_ = Phase::kDone;
  out->push_back({Kind::kFinish, tick_, 0});
}

void ModuleLockstep::OnTime(int64_t now_us, Actions* out) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return;
  const int64_t silence = silence_.Poll(now_us);
  if (phase_ == Phase::kEnded) {
    if (silence >= config_.timing.linger_us) OnBye(out);
    return;
  }
  if (silence >= config_.timing.lost_us) {
    phase_ = Phase::kDone;
    out->push_back({Kind::kLostSim, tick_, 0});
    return;
  }
  // Perhaps the sim began to listen later than we spoke, or speaks of another model: then we are to
  // be refused by name.
  if (!sim_heard_ && tick_ == 0 && now_us >= hello_due_us_) {
    hello_due_us_ = now_us + SilenceMeter::kLongestStep;
    out->push_back({Kind::kHello, 0, 0});
  }
  if (!ask_.Fire(now_us, config_.timing)) return;
  for (const uint16_t mate : mates_) {
    if (!Has(mate, tick_ - 1)) out->push_back({Kind::kAskMate, tick_ - 1, mate});
  }
}

int64_t ModuleLockstep::next_deadline_us() const {
  if (phase_ == Phase::kIdle || phase_ == Phase::kDone) return kNever;
  return std::min(ask_.due_us(), silence_.next_poll_us());
}

std::string ModuleLockstep::Fingerprint() const {
  std::string print;
  print += static_cast<char>(phase_);
  print += std::to_string(tick_);
  print += have_reading_ ? 'r' : '-';
  print += ask_.armed() ? 'a' : '-';
  print += sim_heard_ ? 'h' : '-';
  for (const bool there : parts_) print += there ? '1' : '0';
  for (const uint16_t id : mates_) print += ':' + std::to_string(id);
  for (const Mate& mate : heard_) {
    print += ';' + std::to_string(mate.id);
    // Ticks too old to be of use make no difference.
    for (const int64_t tick : mate.ticks) {
      print += ',' + std::to_string(tick < tick_ - 1 ? -1 : tick);
    }
  }
  return print;
}

}  // namespace morphbus::bridge
