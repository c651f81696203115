#pragma once
// Timing of the lockstep's state machines. No clock in here: time is handed in, in microseconds
// from an arbitrary start.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace morphbus::bridge {

/// How long the participants of a run wait for what; microseconds of wall time.
struct LockstepTiming {
  /// What is missing is asked for after so long, until it is known how long answers take here and
  /// now (ResponseTime).
  int64_t ask_after_us = 2000;
  /// The same for what must have been there: it was lost, and only the bus can be slow.
  int64_t ask_lost_after_us = 200;
  /// The first pause follows the response time between these bounds.
  int64_t ask_at_least_us = 300;
  int64_t ask_slowest_us = 250'000;
  /// A pause that grows does so up to here.
  int64_t ask_at_most_us = 64'000;
  /// After END: a process that does not acknowledge for so long is named.
  int64_t end_silence_us = 5'000'000;
  /// While the sim waits for processes to join: if no further HELLO comes for so long, those that
  /// are missing are named.
  int64_t join_silence_us = 30'000'000;
  /// Meanwhile, those that are missing are reported so often.
  int64_t report_missing_us = 5'000'000;
  /// While running: a process that does not answer for so long is named.
  int64_t run_silence_us = 5'000'000;
  /// Modules and the logger give the run up after so long without a word from the sim.
  int64_t lost_us = 10'000'000;
  /// While the sim holds still (pause, a slow pace, processes that have not joined), it repeats
  /// CLOCK and says that it lives so often; well below lost_us.
  int64_t heartbeat_us = 500'000;
  /// A process that has acknowledged END leaves after so much silence even if LEAVE never comes.
  int64_t linger_us = 1'000'000;
};

/// How long answers take: a mean and the deviation from it, as TCP's retransmission timer has them
/// (RFC 6298, Sec. 2). On a busy machine, or with many modules, nobody is asked for what is on its
/// way; on a fast one nobody waits long for what was lost.
class ResponseTime {
 public:
  /// An answer took so long, microseconds.
  void Measured(int64_t us) {
    const int64_t error = mean_us_ < 0 ? 0 : us - mean_us_;
    deviation_us_ = mean_us_ < 0 ? us / 8 : deviation_us_ + (std::abs(error) - deviation_us_) / 4;
    mean_us_ = mean_us_ < 0 ? us : mean_us_ + error / 8;
  }
  /// How long to wait before an answer counts as lost; `first_us` before anything is known.
  [[nodiscard]] int64_t patience_us(int64_t first_us, const LockstepTiming& timing) const {
    const int64_t usual_us = mean_us_ < 0 ? first_us : mean_us_ + 2 * deviation_us_;
    return std::clamp(usual_us, timing.ask_at_least_us, timing.ask_slowest_us);
  }

 private:
  /// Microseconds; the mean is below 0 before the first answer.
  int64_t mean_us_ = -1;
  int64_t deviation_us_ = 0;
};

/// How often answers come twice that nobody asked for, because the bus doubles messages or somebody
/// says them again: so many of the others mean nothing, either.
class Doubling {
 public:
  void CameOnce() { share_ -= share_ / kMemory; }
  void CameTwice() { share_ += 1 / kMemory; }
  /// Of so many answers that came twice, asked for among `asked`, those that did so for another
  /// reason.
  [[nodiscard]] int Beyond(int twice, int asked) const {
    return std::max(0, twice - static_cast<int>(std::lround(share_ * asked)));
  }

 private:
  /// Answers over which the share is taken.
  static constexpr double kMemory = 64;
  double share_ = 0;
};

/// How many times as long as answers usually take is waited for them. An answer that comes twice
/// was asked for too soon: if most do, the next ones get twice the time; else each one that comes
/// once, so that it or the question had been lost, takes half of it back. So where messages are
/// lost nobody waits long, and where none is lost nobody asks.
class Caution {
 public:
  /// So many answers to a tick were asked for, and so many of them came twice for that.
  void Learn(int asked, int twice) {
    if (2 * twice > asked) {
      factor_ = std::min(kMost, 2 * factor_);
    } else {
      // Half of it for each that came once; exact, and so without libm's pow.
      factor_ = std::max(kLeast, std::ldexp(factor_, twice - asked));
    }
  }
  [[nodiscard]] double factor() const { return factor_; }

 private:
  static constexpr double kLeast = 0.5, kMost = 32;
  /// At first nothing is known of losses, and most runs have none.
  double factor_ = 24;
};

/// When to ask again: after a pause that is chosen by who arms the timer; from the seventeenth
/// request on to which nothing came, after twice as long each time, up to ask_at_most_us if it was
/// not longer from the beginning.
class RetryTimer {
 public:
  /// Whether anything is waited for at all.
  [[nodiscard]] bool armed() const { return due_us_ != std::numeric_limits<int64_t>::max(); }
  /// When Fire must be called at the latest; the largest number there is if the timer is not armed.
  [[nodiscard]] int64_t due_us() const { return due_us_; }
  /// Starts anew, with this pause.
  void Arm(int64_t now_us, int64_t pause_us) {
    first_us_ = interval_us_ = pause_us;
    in_vain_ = 0;
    due_us_ = now_us + interval_us_;
  }
  /// Some of what is missing has come: the next pauses are short again.
  void Progress() { Progress(first_us_); }
  /// The same, and from the next request on they are this long.
  void Progress(int64_t pause_us) {
    first_us_ = interval_us_ = pause_us;
    in_vain_ = 0;
  }
  /// Nothing is missing any more.
  void Disarm() { due_us_ = std::numeric_limits<int64_t>::max(); }
  /// Returns true if the timer is due, and sets it for the next time.
  bool Fire(int64_t now_us, const LockstepTiming& timing) {
    if (now_us < due_us_) return false;
    // A few requests or answers in a row may well be lost.
    constexpr int kSoonAgain = 16;
    if (++in_vain_ > kSoonAgain) {
      interval_us_ = std::max(first_us_, std::min(2 * interval_us_, timing.ask_at_most_us));
    }
    due_us_ = now_us + interval_us_;
    return true;
  }

 private:
  /// Wall time of the next request.
  int64_t due_us_ = std::numeric_limits<int64_t>::max();
  /// The pause before it, which doubles with every request, and the first one.
  int64_t interval_us_ = 0;
  int64_t first_us_ = 0;
  int in_vain_ = 0;  ///< Requests since something came.
};

/// How long nothing was heard, as far as we were awake to hear: a process that is stopped (SIGSTOP)
/// and goes on hours later has not been waiting for hours, so a step of time counts as kLongestStep
/// at most.
class SilenceMeter {
 public:
  static constexpr int64_t kLongestStep = 500'000;  ///< µs; poll at least so often.
  /// Something came: the silence begins anew.
  void Heard(int64_t now_us) {
    silence_us_ = 0;
    last_us_ = now_us;
  }
  /// The length of the silence up to now, microseconds.
  int64_t Poll(int64_t now_us) {
    silence_us_ += std::clamp<int64_t>(now_us - last_us_, 0, kLongestStep);
    last_us_ = std::max(last_us_, now_us);
    return silence_us_;
  }
  /// When Poll must be called at the latest, so that no waking time goes uncounted.
  [[nodiscard]] int64_t next_poll_us() const { return last_us_ + kLongestStep; }

 private:
  /// The silence as measured up to the last poll, and when that was.
  int64_t silence_us_ = 0;
  int64_t last_us_ = 0;
};

/// When a module or the logger says HELLO without being asked: again and again until the first
/// CLOCK comes. Perhaps the sim began to listen later than we spoke, or it speaks of another model
/// and must be told so that it can refuse us by name.
class HelloTimer {
 public:
  /// HELLO went out, for whatever reason; the next one is due soon, and then less and less soon.
  void Said(int64_t now_us) {
    due_us_ = now_us + pause_us_;
    pause_us_ = std::min(2 * pause_us_, SilenceMeter::kLongestStep);
  }
  /// When Fire must be called at the latest; the largest number there is once CLOCK was heard.
  [[nodiscard]] int64_t due_us() const {
    return sim_heard_ ? std::numeric_limits<int64_t>::max() : due_us_;
  }
  /// CLOCK has come: from now on HELLO is said only when CLOCK asks for it.
  void SimHeard() { sim_heard_ = true; }
  /// Whether CLOCK has ever come.
  [[nodiscard]] bool sim_heard() const { return sim_heard_; }
  /// Returns true if HELLO is due, and sets the timer for the next time.
  bool Fire(int64_t now_us) {
    if (sim_heard_ || now_us < due_us_) return false;
    Said(now_us);
    return true;
  }

 private:
  /// Whether CLOCK has come, when HELLO is due until it does, and the pause after that; µs.
  bool sim_heard_ = false;
  int64_t due_us_ = 0;
  int64_t pause_us_ = 50'000;
};

}  // namespace morphbus::bridge
