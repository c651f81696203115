#include "bridge/lockstep/sim/answer_patience.h"

#include <algorithm>

namespace morphbus::bridge {
namespace {

/// From a few of many answers nothing can be said about the others.
constexpr int kManyAnswers = 4;

}  // namespace

AnswerPatience::AnswerPatience(int num_modules, const LockstepTiming& timing)
    : num_modules_(num_modules),
      timing_(timing),
      asked_for_(static_cast<size_t>(num_modules), -1),
      doubled_(asked_for_) {}

int64_t AnswerPatience::UsualUs() const {
  // The first guess: processors are shared by more modules than there are of them.
  const int64_t first_us = timing_.ask_after_us * (8 + num_modules_) / 8;
  return response_.patience_us(first_us, timing_);
}

int64_t AnswerPatience::Of(int missing, bool running) const {
  // A few answers are sooner there than all; the least that they take is waking up one process.
  constexpr double kLeastShare = 0.25;
  // The first tick's answers come from processes that have just started, whatever is lost.
  constexpr double kStartFactor = 4;
  const double factor = running ? caution_.factor() : kStartFactor;
  const double share = std::max(kLeastShare, static_cast<double>(missing) / num_modules_);
  // However cautious, the wait is not much longer than answers take.
  constexpr double kLongestExtraUs = 50'000;
  const double usual_us = share * static_cast<double>(UsualUs());
  const auto pause_us =
      static_cast<int64_t>(std::min(factor * usual_us, usual_us + kLongestExtraUs));
  return std::clamp(pause_us, timing_.ask_at_least_us, timing_.ask_slowest_us);
}

void AnswerPatience::Answered(int module, int64_t tick, int64_t now_us) {
  answered_us_ = now_us;
  if (asked_for_[module] != tick) doubling_.CameOnce();
}

void AnswerPatience::AnsweredAgain(int module, int64_t tick, bool out, int64_t now_us) {
  // What comes later is mostly for the logger, which asks for answers to ticks that are over.
  const bool soon = out || now_us - published_us_ < timing_.ask_at_least_us;
  if (module < 0 || module >= num_modules_ || !soon) return;
  if (asked_for_[module] == tick) {
    asked_for_[module] = -1;
    doubled_[module] = tick;
    ++num_twice_;
  } else if (doubled_[module] < tick) {
    doubled_[module] = tick;
    doubling_.CameTwice();
  }
}

bool AnswerPatience::LearnAtFirstAnswer(int64_t tick) {
  if (num_asked_ == 0 || asked_tick_ >= tick) return false;
  LearnFromRequests();
  return true;
}

void AnswerPatience::Measure(int64_t tick, int num_answers) {
  if (asked_tick_ == tick || num_answers * kManyAnswers < num_modules_) return;
  response_.Measured(answered_us_ - published_us_);
}

void AnswerPatience::LearnFromRequests() {
  // By now all answers that were asked for have come, and the second ones, if there are any.
  if (num_asked_ > 0) caution_.Learn(num_asked_, doubling_.Beyond(num_twice_, num_asked_));
  num_asked_ = num_twice_ = 0;
}

void AnswerPatience::TickOver(int64_t tick) {
  if (tick > asked_tick_) LearnFromRequests();
}

void AnswerPatience::BeginAsking(int64_t tick, int num_answers, bool running) {
  // Losses leave some answers of many; where none is there yet, all of them are slower than usual.
  all_slow_ = num_answers == 0 && num_modules_ >= kManyAnswers;
  if (asked_tick_ == tick) return;
  LearnFromRequests();
  if (running && all_slow_) response_.Measured(2 * UsualUs());
  if (running && num_answers > 0) Measure(tick, num_answers);
  asked_tick_ = tick;
}

void AnswerPatience::Ask(int module, int64_t tick) {
  // What comes of it says something of losses, unless all are slow.
  if (all_slow_ || asked_for_[module] == tick) return;
  ++num_asked_;
  asked_for_[module] = tick;
}

}  // namespace morphbus::bridge
