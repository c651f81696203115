#pragma once
// The simulator's side of the lockstep as a pure state machine: events and time in, actions out.

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/outbox.h"
#include "bridge/retry_timer.h"

namespace morphbus::bridge {

/// What the party shall do, in this order.
struct SimAction {
  enum class Kind : uint8_t {
    kPublishTick,  ///< CLOCK, SENSORS, WORLD of `tick`, for the first time.
    kRepeatTick,   ///< CLOCK and SENSORS of `tick` again.
    kAdvance,      ///< Apply the commands of `tick` and step the robot.
    kAskModule,    ///< ACTUATOR of `tick` is missing from `process`.
    kPollLogger,   ///< Ask the logger up to where it has all.
    kPublishEnd,   ///< CLOCK with PHASE_END at `tick`.
    kRepeatEnd,
    kBye,     ///< Tell everyone that the run is over.
    kFinish,  ///< Nothing more will come; see outcome.
  };
  Kind kind = Kind::kFinish;
  int64_t tick = 0;
  int process = -1;
};

class SimLockstep {
 public:
  struct Config {
    int num_modules = 0;
    bool logger = false;
    int64_t num_ticks = -1;  ///< -1: until stopped.
    int32_t tick_us = 20000;
    bool realtime = false;
    double speed = 0;  ///< Times real time; 0: as fast as possible.
    int64_t window = kKeptTicks;
    LockstepTiming timing;
  };
  using Actions = std::vector<SimAction>;

  explicit SimLockstep(const Config& config);

  // Events. `process`: 0..num_modules-1, the logger is num_modules. Unknown or old news is
  // harmless.
  void Begin(int64_t now_us, Actions* out);
  void OnHello(int process, int64_t now_us, Actions* out);
  void OnActuator(int module, int64_t tick, int64_t now_us, Actions* out);
  void OnLogAck(int64_t tick, int64_t now_us, Actions* out);
  void OnEndAck(int process, int64_t now_us, Actions* out);
  void OnTime(int64_t now_us, Actions* out);
  /// The party has published a tick or the end: the time its physics took is nobody's delay.
  void OnPublished(int64_t now_us);
  /// Ends after the current tick; `at_once` (refusal): without waiting for anybody's answer.
  void Stop(bool at_once, int64_t now_us, Actions* out);
  void Pause();
  void Resume(int64_t now_us, Actions* out);
  void Step(int64_t now_us, Actions* out);
  void SetSpeed(double speed, int64_t now_us, Actions* out);

  [[nodiscard]] int64_t next_deadline_us() const;
  [[nodiscard]] int64_t tick() const { return tick_; }
  [[nodiscard]] bool started() const { return phase_ != Phase::kIdle && phase_ != Phase::kStart; }
  [[nodiscard]] bool ending() const { return phase_ >= Phase::kEnding; }
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }
  [[nodiscard]] bool paused() const { return paused_; }
  /// Done, and everybody answered in time.
  [[nodiscard]] bool ok() const { return done() && silent_.empty(); }
  /// Who kept silent too long; empty while all is well.
  [[nodiscard]] const std::vector<int>& silent() const { return silent_; }
  [[nodiscard]] bool greeted(int process) const { return hello_[static_cast<size_t>(process)]; }
  [[nodiscard]] int64_t acknowledged_tick() const { return acknowledged_; }
  [[nodiscard]] int64_t missed_deadlines() const { return missed_deadlines_; }

  /// Everything but times, as bytes: equal states are equal strings (for exploring).
  [[nodiscard]] std::string Fingerprint() const;

 private:
  enum class Phase : uint8_t { kIdle, kStart, kRun, kEnding, kDone };

  [[nodiscard]] bool AllGreeted() const;
  [[nodiscard]] bool AllAnswered() const;
  [[nodiscard]] bool WindowOpen() const;
  [[nodiscard]] int64_t PacedStartUs(int64_t tick) const;
  void TryAdvance(int64_t now_us, Actions* out);
  void TryRealtime(int64_t now_us, Actions* out);
  void AdvanceOneTick(int64_t now_us, Actions* out);
  void EnterEnding(int64_t now_us, Actions* out);
  void FinishIfAcknowledged(Actions* out);
  void Hold();
  void Beat(int64_t now_us, Actions* out);
  void OnAskTimer(int64_t now_us, Actions* out);
  void NoteSilent(int process);
  void CheckSilence(int64_t now_us, Actions* out);
  void Rebase(int64_t now_us);

  Config config_;
  Phase phase_ = Phase::kIdle;
  int64_t tick_ = 0;
  std::vector<bool> hello_, answered_, end_acked_;
  int64_t acknowledged_ = -1;
  bool stop_ = false, paused_ = false;
  bool holding_ = false;  ///< All is there, but it is not time for the next tick.
  int64_t steps_ = 0;     ///< Ticks to run though paused.
  RetryTimer ask_;
  SilenceMeter silence_;
  int64_t beat_due_us_ = 0;
  int64_t pace_base_us_ = 0, pace_base_tick_ = 0;
  int64_t missed_deadlines_ = 0;
  std::vector<int> silent_;
};

}  // namespace morphbus::bridge
