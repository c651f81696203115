#pragma once
// The logger's side of the lockstep as a pure state machine: events and time in, actions out.
// The rules that it keeps stand in lcmtypes/README.md under "Lockstep"; test/bridge explores it
// together with the other two machines through every order of messages and losses.

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/retry_timer.h"
#include "bridge/lockstep/sequence_tracker.h"
#include "bridge/wire/channels.h"
#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// What the participant shall do, in this order.
/// A field that the kind does not mention keeps its default.
struct LogAction {
  enum class Kind : uint8_t {
    /// Publish HELLO: a logger takes part.
    kHello,
    /// Tell the sim that everything up to and with `tick` is there.
    kAck,
    /// Ask for messages first..last of `topic`, which are missing.
    kAskGap,
    /// Acknowledge END; `tick` is the last one of which nothing is missing.
    kEndAck,
    /// Confirm that the logger has heard how the run ended.
    kVerdictAck,
    /// The run is over.
    kFinish,
    /// Nothing was heard from the run for too long. The machine is finished.
    kLostSim,
  };
  Kind kind = Kind::kFinish;
  int64_t tick = 0;
  Topic topic = Topic::kClock;  ///< kAskGap: the channel of `module` that has the gap.
  /// kAskGap: number of the module, in order of first mention in SENSORS; -1 for the sim's
  /// channels.
  int module = -1;
  /// kAskGap: sequence numbers, both inclusive.
  int64_t first = 0, last = 0;
};

/// Keeps count of what a run must have published, and decides what to ask for and what to
/// acknowledge; knows neither bytes nor a bus nor a clock.
class LogLockstep {
 public:
  using Actions = std::vector<LogAction>;
  /// What the machine is told of the run.
  struct Config {
    /// Real time: the machine listens and counts, and asks for nothing.
    bool realtime = false;
    /// Ticks between two acknowledgements that nobody asked for; well below kKeptTicks, by which
    /// the sim may be ahead of what was acknowledged.
    int64_t ack_every = 8;
    /// The sim is at most so many ticks ahead of what was acknowledged (SimLockstep's window).
    int64_t window = kKeptTicks;
    LockstepTiming timing;
  };

  /// The machine is idle until Begin, and ignores every event before it.
  explicit LogLockstep(const Config& config);

  /// Says HELLO; from now on everything is awaited.
  void Begin(int64_t now_us, Actions* out);
  /// CLOCK says that from `tick` on the run goes on without this module. Call after OnClock of that
  /// tick, if that was kFresh.
  void Lose(const std::string& name, int64_t tick, int64_t now_us, Actions* out);
  /// What became of a message.
  enum class Taken : uint8_t {
    kFresh,
    kKnown,        ///< It was there already, or cannot be placed yet.
    kOutside,      ///< It is of a tick that cannot be by now, or that is over for long.
    kMisnumbered,  ///< Its number does not belong to its tick.
  };
  /// CLOCK, with its number on the channel.
  Taken OnClock(int64_t sequence, int64_t tick, int phase, int num_modules, int sensors_parts,
                int world_parts, int64_t now_us, Actions* out);
  /// SENSORS or WORLD.
  Taken OnPart(Topic topic, int64_t sequence, int64_t tick, int64_t now_us, Actions* out);
  /// TRANSFORM, ACTUATOR or STATUS; `status_count` is ACTUATOR's.
  Taken OnModule(Topic topic, int module, int64_t sequence, int64_t tick, int64_t status_count,
                 int64_t now_us, Actions* out);
  /// The sim, at `tick`, asks for an acknowledgement now.
  void OnPoll(int64_t tick, int64_t now_us, Actions* out);
  /// The sim has told how the run ended.
  void OnVerdict(int64_t now_us, Actions* out);
  /// The sim, which is at `tick`, says that it lives: what it waits for is said again.
  void OnProgress(int64_t tick, int64_t now_us, Actions* out);
  /// The sim says that the run is over for everybody.
  void OnLeaveAll(Actions* out);
  /// Does what is due: requests, HELLO, giving up without the sim.
  void OnTime(int64_t now_us, Actions* out);
  /// Acknowledges END if it was seen, whether or not something is missing. OnTime calls it after
  /// too long a standstill: whoever could send what is missing has died.
  void AcknowledgeEnd(Actions* out);
  /// Number of a module that SENSORS mentioned; given at first mention. -1 if CLOCK has not told
  /// the number of modules yet, or it is exhausted.
  int AddModule(const std::string& name);
  /// Number of a known module; -1 if SENSORS has not mentioned it.
  [[nodiscard]] int ModuleNumber(std::string_view name) const;
  /// SENSORS has mentioned as many modules as CLOCK says there are.
  [[nodiscard]] bool knows_all_names() const {
    return num_modules_ >= 0 && names_.size() == static_cast<size_t>(num_modules_);
  }
  /// Messages that SENSORS or WORLD have a tick, whichever has more; 1 before CLOCK has told.
  [[nodiscard]] int most_parts() const { return std::max({1, sensors_parts_, world_parts_}); }
  /// Names by number.
  [[nodiscard]] const std::vector<std::string>& module_names() const { return names_; }

  /// The run is over for the logger, whatever else comes.
  void GiveUp() { phase_ = Phase::kDone; }
  /// When OnTime must be called at the latest; kNever if only an event can change anything.
  [[nodiscard]] int64_t next_deadline_us() const;
  /// Last tick of which nothing is missing; -1 before tick 0 is whole.
  [[nodiscard]] int64_t complete_tick() const { return complete_tick_; }
  /// The tick after the last one; -1 before END.
  [[nodiscard]] int64_t end_tick() const { return end_tick_; }
  /// CLOCK with PHASE_END has come.
  [[nodiscard]] bool end_seen() const { return end_tick_ >= 0; }
  /// END was seen, and nothing before it is missing.
  [[nodiscard]] bool complete() const { return end_seen() && complete_tick_ >= end_tick_ - 1; }
  /// The sim has told how the run ended.
  [[nodiscard]] bool verdict_heard() const { return verdict_heard_; }
  /// The run is over for the logger, well or not; further events change nothing.
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }

 private:
  /// Of tests, which explore every order of events and must know which states they have been in.
  friend struct MachineState;

  enum class Phase : uint8_t { kIdle, kRun, kEnded, kDone };
  /// Which sequence numbers of a channel have been received.
  struct ReceivedSet {
    int64_t next = 0;             ///< All below are there or were given up.
    MissingNumbers given_up;      ///< Real time only.
    std::vector<int64_t> beyond;  ///< Above, sorted.
    /// Notes that a number has come. Returns false if it was there. `realtime`: gaps are given up
    /// after a while.
    bool Take(int64_t sequence, bool realtime);
  };
  /// What has come from one module; there is one for each name that SENSORS mentioned.
  struct Module {
    ReceivedSet transform, actuator, status;
    /// (tick, count) told by ACTUATOR, in order of tick, until that is complete: few at a time.
    std::vector<std::pair<int64_t, int64_t>> status_counts;
  };

  /// Whether a message of the tick can have been published by now, and is not over for longer than
  /// anybody keeps it. In lockstep the sim is at most a window ahead of what was acknowledged; in
  /// real time a message may come any time late.
  [[nodiscard]] bool InWindow(int64_t tick) const;
  /// Notes a message that cannot be placed yet, so that it is asked for again later.
  Taken Unknown(int64_t tick, int64_t now_us, Actions* out);
  /// CLOCK with PHASE_END.
  Taken OnEnd(int64_t tick, int64_t now_us, Actions* out);
  /// What follows from a message that was `fresh` or not.
  Taken Note(bool fresh, int64_t tick, int64_t now_us, Actions* out);
  /// Moves complete_tick_ up to the last tick of which nothing is missing.
  void UpdateComplete();
  /// The tick from which on a module (by number) is lost; one that never comes if it is not.
  [[nodiscard]] int64_t EndOf(size_t module) const;
  /// Nothing of the tick is missing, given that it is the one behind complete_tick_.
  [[nodiscard]] bool TickComplete(int64_t tick);
  /// Nothing of what this module says at the tick is missing.
  [[nodiscard]] bool HasAllOf(size_t module, int64_t tick) const;
  /// A request for every gap below what must exist by now.
  void ListMissing(Actions* out) const;
  /// Requests for the numbers below `end` that one channel lacks.
  void AskForGaps(const ReceivedSet& received, int64_t end, Topic topic, int module,
                  Actions* out) const;
  /// Acknowledges what is due, and arms or disarms the request timer.
  void AcknowledgeAndAsk(int64_t now_us, Actions* out);

  Config config_;
  Phase phase_ = Phase::kIdle;
  // What CLOCK tells of the run; -1 before the first one.
  int num_modules_ = -1, sensors_parts_ = 0, world_parts_ = 0;
  // What has come on the sim's channels and, by number of the module, on the modules'.
  ReceivedSet clock_, sensors_, world_;
  std::vector<Module> modules_;
  std::vector<std::string> names_;
  TextTable<int> numbers_;
  /// Modules that the run goes on without, and from which tick on.
  std::map<std::string, int64_t> lost_;
  int64_t highest_tick_ = -1;  ///< All before it exists.
  // The tick after the last one, and the last one of which nothing is missing; -1 before they are
  // known.
  int64_t end_tick_ = -1;
  int64_t complete_tick_ = -1;
  /// Of the modules below this number nothing is missing at the tick behind complete_tick_, so that
  /// a tick of many modules is not searched through at every message.
  size_t first_unchecked_ = 0;
  // The last tick that an acknowledgement spoke of.
  int64_t acked_tick_ = -1;
  bool verdict_heard_ = false;
  RetryTimer ask_;
  /// How long nothing was heard from the run at all.
  SilenceMeter silence_;
  /// How long no message came that was missing.
  SilenceMeter standstill_;
  HelloTimer hello_;
};

}  // namespace morphbus::bridge
