#pragma once
// How long the simulator waits for the modules' answers before it asks for them, and what it learns
// from how that turns out.

#include <cstdint>
#include <vector>

#include "bridge/lockstep/retry_timer.h"

namespace morphbus::bridge {

/// Learns how long answers to a tick take here and now, and whether those that are asked for were
/// lost or only late. Where messages are lost the waits are short, and where none is lost no
/// answer is asked for.
class AnswerPatience {
 public:
  AnswerPatience(int num_modules, const LockstepTiming& timing);

  /// A tick has been published, whose answers are awaited from now on.
  void Published(int64_t now_us) { published_us_ = now_us; }
  /// When that was.
  [[nodiscard]] int64_t published_us() const { return published_us_; }
  /// A module has answered the tick that is out, for the first time.
  void Answered(int module, int64_t tick, int64_t now_us);
  /// A module has answered `tick` although that was there already, or is over. `out`: it is the
  /// tick that is out. If it was asked for, that was too soon, unless so many come twice without.
  void AnsweredAgain(int module, int64_t tick, bool out, int64_t now_us);
  /// The first answer to a tick has come, and with it whatever came twice of the tick before. True
  /// if there was something to learn, so that the patience may have changed.
  bool LearnAtFirstAnswer(int64_t tick);
  /// So many answers to `tick` have come, all or as many as come unasked: how long that took is how
  /// long it usually takes, unless too few answers say so or some of them were asked for.
  void Measure(int64_t tick, int num_answers);
  /// The tick is over.
  void TickOver(int64_t tick);
  /// Answers to `tick` are about to be asked for, of which `num_answers` have come. `running`: the
  /// run has begun, so that there is something to learn from that.
  void BeginAsking(int64_t tick, int num_answers, bool running);
  /// A module is asked for its answer, after BeginAsking.
  void Ask(int module, int64_t tick);

  /// How long to wait for so many missing answers before they are asked for, microseconds.
  /// `running` is as in BeginAsking.
  [[nodiscard]] int64_t Of(int missing, bool running) const;

 private:
  /// How long all answers to a tick usually take, microseconds.
  [[nodiscard]] int64_t UsualUs() const;
  /// Learns from the answers that were asked for in a tick before the present one.
  void LearnFromRequests();

  int num_modules_;
  LockstepTiming timing_;
  // How long it takes until no more answers come unasked, and how much longer to wait.
  ResponseTime response_;
  Caution caution_;
  /// When the present tick was published, and when the last answer to it came.
  int64_t published_us_ = 0, answered_us_ = 0;
  int64_t asked_tick_ = -1;  ///< The last tick in which a module was asked.
  /// By module: the tick that it was last asked for, -1 once that is settled.
  std::vector<int64_t> asked_for_;
  /// The share of answers that come twice though they were not asked for, and by module the last
  /// tick whose answer came twice.
  Doubling doubling_;
  std::vector<int64_t> doubled_;
  /// How many modules were asked in that tick, and how many of their answers came twice.
  int num_asked_ = 0, num_twice_ = 0;
  /// Nothing has come of the tick that is asked for: then all of them are slower than usual, which
  /// says nothing of losses.
  bool all_slow_ = false;
};

}  // namespace morphbus::bridge
