// When a SimLockstep asks for what is missing, and what it learns from how that is answered.
#include <algorithm>

#include "bridge/lockstep/sim_lockstep.h"

namespace morphbus::bridge {
int64_t SimLockstep::UsualUs() const {
  // The first guess: processors are shared by more modules than there are of them.
  const int64_t first_us = config_.timing.ask_after_us * (8 + config_.num_modules) / 8;
  return response_.patience_us(first_us, config_.timing);
}

int64_t SimLockstep::Patience(int missing) const {
  // A few answers are sooner there than all; the least that they take is waking up one process.
  constexpr double kLeastShare = 0.25;
  // The first tick's answers come from processes that have just started, whatever is lost.
  constexpr double kStartFactor = 4;
  const double factor = phase_ == Phase::kRun ? caution_.factor() : kStartFactor;
  const double share = std::max(kLeastShare, static_cast<double>(missing) / config_.num_modules);
  // However cautious, nobody waits much longer than answers take.
  constexpr double kLongestExtraUs = 50'000;
  const double usual_us = share * static_cast<double>(UsualUs());
  const auto pause_us =
      static_cast<int64_t>(std::min(factor * usual_us, usual_us + kLongestExtraUs));
  return std::clamp(pause_us, config_.timing.ask_at_least_us, config_.timing.ask_slowest_us);
}

void SimLockstep::Measure() {
  // From a few of many answers nothing can be said about the others.
  constexpr int kMany = 4;
  if (phase_ != Phase::kRun || asked_tick_ == tick_ || num_answers_ * kMany < config_.num_modules) {
    return;
  }
  response_.Measured(answered_us_ - published_us_);
}

void SimLockstep::LearnFromRequests() {
  // By now all answers that were asked for have come, and the second ones, if there are any.
  if (num_asked_ > 0) caution_.Learn(num_asked_, num_twice_);
  num_asked_ = num_twice_ = 0;
}

void SimLockstep::OnAskTimer(int64_t now_us, Actions* out) {
  // After the last tick only END and the verdict are repeated.
  if (phase_ == Phase::kEnding) return out->push_back({SimAction::Kind::kRepeatEnd, tick_, -1});
  if (phase_ == Phase::kConcluding) {
    return out->push_back({SimAction::Kind::kTellVerdict, tick_, logger_number()});
  }
  if (!AllAnswered()) return AskForAnswers(now_us, out);
  // All answers are there, so if we wait it is for one that leaves, or for the logger.
  if (AnyLeaving() && !stop_) return AskToLeave(out);
  if (!WindowOpen()) out->push_back({SimAction::Kind::kPollLogger, tick_, -1});
}

void SimLockstep::AskForAnswers(int64_t now_us, Actions* out) {
  // Losses leave some answers of many; where none is there yet, all of them are slower than usual.
  constexpr int kMany = 4;
  const bool all_slow = num_answers_ == 0 && config_.num_modules >= kMany;
  if (asked_tick_ != tick_) LearnFromRequests();
  if (asked_tick_ != tick_ && phase_ == Phase::kRun) {
    if (all_slow) {
      response_.Measured(2 * UsualUs());
    } else if (num_answers_ > 0) {
      Measure();
    }
  }
  asked_tick_ = tick_;
  heartbeat_due_us_ = now_us + config_.timing.heartbeat_us;
  // The request comes first: it reaches a module that has answered, and says nothing to one that
  // lacks SENSORS, which come behind it.
  for (size_t i = 0; i < answered_.size(); ++i) {
    if (answered_[i]) continue;
    // What comes of it says something of losses, unless all are slow.
    if (!all_slow && asked_for_[i] != tick_) {
      ++num_asked_;
      asked_for_[i] = tick_;
    }
    out->push_back({SimAction::Kind::kAskModule, tick_, static_cast<int>(i)});
  }
  out->push_back({SimAction::Kind::kRepeatReadings, tick_, -1});
}

}  // namespace morphbus::bridge
