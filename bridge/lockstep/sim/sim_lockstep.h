#pragma once
// The simulator's side of the lockstep as a pure state machine: events and time in, actions out.
// The rules that it keeps stand in lcmtypes/README.md under "Lockstep"; test/bridge explores it
// together with the other two machines through every order of messages and losses.

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/retry_timer.h"
#include "bridge/lockstep/sim/answer_patience.h"
#include "bridge/lockstep/sim/attendance.h"
#include "bridge/lockstep/sim/tick_pace.h"

namespace morphbus::bridge {

/// What the participant shall do, in this order.
/// `tick` is the tick that the action speaks of, and `process` the one that it is meant for, -1 if
/// it is for nobody in particular.
struct SimAction {
  enum class Kind : uint8_t {
    /// Publish CLOCK of `tick`, for the first time. That of tick 0 may come before all have joined,
    /// to show that there is a simulator.
    kPublishClock,
    /// Publish SENSORS and WORLD of `tick`, for the first time.
    kPublishReadings,
    /// Publish CLOCK of `tick` again, byte for byte.
    kRepeatClock,
    /// Publish SENSORS of `tick` again, as far as modules that have not answered need it.
    kRepeatReadings,
    /// Apply the commands of `tick` and step the robot by one control tick.
    kAdvance,
    /// Ask module `process` for its ACTUATOR of `tick`, which is missing.
    kAskModule,
    /// Ask the logger up to which tick it has everything.
    kPollLogger,
    /// Say that the sim lives, and which tick it is at: a process that owes it HELLO or the
    /// acknowledgement of END says it again.
    kSayProgress,
    /// Ask module `process` to leave the run.
    kAskToLeave,
    /// All is there for the next tick, which waits for PassBarrier.
    kAtBarrier,
    /// Publish CLOCK with PHASE_END; `tick` is the one after the last.
    kPublishEnd,
    /// Publish that CLOCK again, for whoever has not acknowledged it.
    kRepeatEnd,
    /// Tell the logger how the run ended.
    kTellVerdict,
    /// Tell everyone to leave: the run is over.
    kLeaveAll,
    /// Nothing more will come: the participant works out the outcome of the run.
    kFinish,
  };
  Kind kind = Kind::kFinish;
  int64_t tick = 0;
  int process = -1;
};

/// Decides what the simulator does next; knows neither bytes nor a bus nor a clock. Every event
/// appends what follows from it to `out`, and the participant carries that out in order.
class SimLockstep {
 public:
  /// What the machine is told of the run; the participant fills it in from its own options.
  struct Config {
    int num_modules = 0;
    /// Whether a logger takes part, for which the sim waits.
    bool logger = false;
    /// The run ends after so many ticks; -1 lets it go on until Stop.
    int64_t num_ticks = -1;
    /// Length of a control tick, microseconds of sim time.
    int32_t tick_us = 20000;
    /// The wall clock decides when a tick is over, whoever has answered.
    bool realtime = false;
    /// Pace in times of real time; 0 runs as fast as possible.
    double speed = 0;
    /// The sim is at most so many ticks ahead of what the logger has acknowledged.
    int64_t window = kKeptTicks;
    LockstepTiming timing;
  };
  using Actions = std::vector<SimAction>;

  explicit SimLockstep(const Config& config);

  // Events. `process`: 0..num_modules-1, the logger is num_modules. Unknown or old news changes
  // nothing.
  /// From now on everybody is awaited.
  void Begin(int64_t now_us, Actions* out);
  /// A process has joined. Once all have, tick 0 goes out; answered by all, the run begins.
  void OnHello(int process, int64_t now_us, Actions* out);
  /// A module has answered a tick. An answer that was there before, though it was asked for, shows
  /// that we ask too soon; answers to other ticks than the present one change nothing else.
  void OnActuator(int module, int64_t tick, int64_t now_us, Actions* out);
  /// The logger has everything up to and with this tick.
  void OnLogAck(int64_t tick, int64_t now_us, Actions* out);
  /// A process has acknowledged END.
  void OnEndAck(int process, int64_t now_us, Actions* out);
  /// The logger has heard how the run ended.
  void OnVerdictAck(int64_t now_us, Actions* out);
  /// Does what is due: requests, repetitions, the pace, giving up on the silent.
  void OnTime(int64_t now_us, Actions* out);
  /// The participant has published a tick or the end: the time its physics took is nobody's delay.
  void OnPublished(int64_t now_us);
  /// Names those that something is missing from and ends without them. OnTime calls it after too
  /// long a silence.
  void GiveUpOnSilent(int64_t now_us, Actions* out);
  /// Ends after the current tick; `at_once` (refusal): without waiting for anybody's answer.
  void Stop(bool at_once, int64_t now_us, Actions* out);
  /// Holds the run between two ticks; nobody asks for anything meanwhile.
  void Pause();
  /// Goes on after Pause, at the pace of the present moment.
  void Resume(int64_t now_us, Actions* out);
  /// Runs so many ticks more although paused: the next one at once, and each further one when the
  /// one before it is over; in real time at the pace.
  void Step(int64_t ticks, int64_t now_us, Actions* out);
  /// Changes the pace: times real time, 0 for as fast as possible.
  void SetSpeed(double speed, int64_t now_us, Actions* out);
  /// From the next tick on the run goes on without this module: before that tick, and once the
  /// logger has all that it said, it is asked to leave, and acknowledges as it would END. In real
  /// time nobody waits for that. In the last tick it changes nothing.
  void Lose(int module, int64_t now_us, Actions* out);
  /// Lockstep only: the next tick is not begun before PassBarrier, so that something can be done
  /// between two ticks that takes time. Once all is there for it kAtBarrier says so, once.
  void SetBarrier() { barrier_ = true; }
  void PassBarrier(int64_t now_us, Actions* out);

  /// When OnTime must be called at the latest; kNever if only an event can change anything.
  [[nodiscard]] int64_t next_deadline_us() const;
  /// The tick that is out, or the one after the last once END is.
  [[nodiscard]] int64_t tick() const { return tick_; }
  /// Tick 0 is over: everybody has joined and answered.
  [[nodiscard]] bool started() const { return phase_ != Phase::kIdle && phase_ != Phase::kStart; }
  /// END is out.
  [[nodiscard]] bool ending() const { return phase_ >= Phase::kEnding; }
  /// The run is over and all actions were given out; further events change nothing.
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }
  [[nodiscard]] bool paused() const { return paused_; }
  /// The number of the logger among the processes.
  [[nodiscard]] int logger_number() const { return config_.num_modules; }
  /// Done, and everybody answered in time.
  [[nodiscard]] bool ok() const { return done() && silent_.empty(); }
  /// Who kept silent too long; empty while all is well.
  [[nodiscard]] const std::vector<int>& silent() const { return silent_; }
  /// Who has joined, answered and acknowledged, and whom the run goes on without.
  [[nodiscard]] const Attendance& attendance() const { return attendance_; }
  /// Real time only: answers that had not come when their tick was over, summed over all modules,
  /// and some more each time that the pace had to start anew.
  [[nodiscard]] int64_t missed_deadlines() const { return missed_deadlines_; }

 private:
  /// Of tests, which explore every order of events and must know which states they have been in.
  friend struct MachineState;

  /// kEnding: END is out, and not yet acknowledged by all. kConcluding: the logger must still hear
  /// how the run ended.
  enum class Phase : uint8_t { kIdle, kStart, kRun, kEnding, kConcluding, kDone };

  /// The logger is close enough behind for another tick; where a module is to leave first, it has
  /// all of this one.
  [[nodiscard]] bool WindowOpen() const;
  /// Real time: wall time at which the present tick is over, whoever has answered. A run that is to
  /// stop does not wait for a slow pace.
  [[nodiscard]] int64_t TickOverUs() const;
  /// Publishes the present tick, whose answers are awaited from now on.
  void PublishTick(int64_t now_us, Actions* out);
  /// Requests to all modules that were told to leave and have not acknowledged it, once more.
  void AskToLeave(Actions* out) const;
  /// Tells those to leave, if there are any who have not been told; the timer does it again.
  void TellToLeave(int64_t now_us, Actions* out);
  /// Publishes the present tick's CLOCK, or repeats it.
  void PublishClock(int64_t now_us, Actions* out);
  /// Goes on to the next tick if nothing is missing and it is time.
  void TryAdvance(int64_t now_us, Actions* out);
  /// The same where the wall decides when it is time, whoever has answered.
  void TryRealtime(int64_t now_us, Actions* out);
  /// Steps the robot, then publishes the next tick, or END if this was the last one.
  void AdvanceOneTick(int64_t now_us, Actions* out);
  /// Publishes END and waits for its acknowledgements.
  void EnterEnding(int64_t now_us, Actions* out);
  /// Concludes once everybody has acknowledged END.
  void ConcludeIfAcknowledged(int64_t now_us, Actions* out);
  /// Settles who was silent, and tells the logger how the run ended.
  void Conclude(int64_t now_us, Actions* out);
  /// Lets everybody go and ends the machine's work.
  void Finish(Actions* out);
  /// How long to wait for `missing` answers before they are asked for, microseconds.
  [[nodiscard]] int64_t Patience(int missing) const {
    return patience_.Of(missing, phase_ == Phase::kRun);
  }
  /// Asks for answers to the present tick, and repeats what those modules may have missed.
  void AskForAnswers(Actions* out);
  /// Has the ask timer poll the logger until WindowOpen.
  void AwaitLogger(int64_t now_us);
  /// Stops asking, because it is the sim itself that does not go on.
  void Hold();
  /// Repeats CLOCK and SENSORS, and says that the sim lives, if nothing was published for
  /// LockstepTiming::heartbeat_us.
  void Heartbeat(int64_t now_us, Actions* out);
  /// Asks again for whatever the present phase waits for.
  void OnAskTimer(Actions* out);
  /// Whether the process was named as one that kept silent too long.
  [[nodiscard]] bool IsSilent(int process) const;
  /// END was acknowledged by all but those that were silent before.
  [[nodiscard]] bool OnlySilentMissing() const;
  /// Gives up on whoever has kept silent for longer than the present phase allows.
  void CheckSilence(int64_t now_us, Actions* out);

  Config config_;
  Phase phase_ = Phase::kIdle;
  int64_t tick_ = 0;
  Attendance attendance_;
  /// Armed while a module was told to leave and has not acknowledged it; also in a pause.
  RetryTimer leave_;
  // The next tick waits for PassBarrier, and kAtBarrier was given out.
  bool barrier_ = false, at_barrier_ = false;
  // Last tick of which the logger has everything.
  int64_t acknowledged_ = -1;
  // stop_: end after the present tick.
  bool stop_ = false, paused_ = false;
  bool holding_ = false;  ///< All is there, but it is not time for the next tick.
  int64_t steps_ = 0;     ///< Ticks to run though paused.
  RetryTimer ask_;
  AnswerPatience patience_;
  // The last tick whose CLOCK, and whose SENSORS and WORLD were published.
  int64_t clock_out_ = -1, readings_out_ = -1;
  SilenceMeter silence_;
  int64_t heartbeat_due_us_ = 0;  ///< Wall time at which CLOCK is repeated.
  TickPace pace_;
  int64_t missed_deadlines_ = 0;
  // Numbers of the processes that were given up, in the order in which they were found silent.
  std::vector<int> silent_;
};

}  // namespace morphbus::bridge
