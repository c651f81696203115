#pragma once
// The logger's side of the lockstep as a pure state machine: events and time in, actions out.
// The rules that it keeps stand in lcmtypes/README.md under "Lockstep"; test/bridge explores it
// together with the other two machines through every order of messages and losses.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/retry_timer.h"
#include "bridge/lockstep/sequence_tracker.h"
#include "bridge/wire/channels.h"

namespace morphbus::bridge {

/// What the participant shall do, in this order.
/// A field that the kind does not mention keeps its default.
struct LogAction {
  enum class Kind : uint8_t {
    /// Publish HELLO: a logger takes part.
    kHello,
    /// Tell the sim that everything up to and with `tick` is there (ASK, KIND_ACK).
    kAck,
    /// Ask for messages first..last of `topic`, which are missing.
    kAskGap,
    /// Acknowledge END; `tick` is the last one of which nothing is missing (KIND_END_ACK).
    kEndAck,
    /// Confirm that the logger has heard how the run ended (KIND_VERDICT_ACK).
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
    LockstepTiming timing;
  };

  /// The machine is idle until Begin, and ignores every event before it.
  explicit LogLockstep(const Config& config);

  /// Says HELLO; from now on everything is awaited.
  void Begin(int64_t now_us, Actions* out);
  /// CLOCK. Returns false if it was there already, as do all OnX below.
  bool OnClock(int64_t tick, int phase, int num_modules, int sensors_parts, int world_parts,
               int64_t now_us, Actions* out);
  /// SENSORS or WORLD.
  bool OnPart(Topic topic, int64_t sequence, int64_t tick, int64_t now_us, Actions* out);
  /// TRANSFORM, ACTUATOR or STATUS; `status_count` is ACTUATOR's.
  bool OnModule(Topic topic, int module, int64_t sequence, int64_t tick, int64_t status_count,
                int64_t now_us, Actions* out);
  /// The sim, at `tick`, asks for an acknowledgement now.
  void OnPoll(int64_t tick, int64_t now_us, Actions* out);
  /// The sim has told how the run ended.
  void OnVerdict(int64_t now_us, Actions* out);
  /// The run is over for everybody.
  void OnBye(Actions* out);
  /// Does what is due: requests, HELLO, giving up without the sim.
  void OnTime(int64_t now_us, Actions* out);
  /// Acknowledges END if it was seen, whether or not something is missing. OnTime calls it after
  /// too long a standstill: whoever could send what is missing has died.
  void AcknowledgeEnd(Actions* out);
  /// Number of a module that SENSORS mentioned; given at first mention. -1 if CLOCK has not told
  /// the number of modules yet, or it is exhausted.
  int AddModule(const std::string& name);
  /// Number of a known module; -1 if SENSORS has not mentioned it.
  [[nodiscard]] int ModuleNumber(const std::string& name) const;
  /// SENSORS has mentioned as many modules as CLOCK says there are.
  [[nodiscard]] bool knows_all_names() const {
    return num_modules_ >= 0 && names_.size() == static_cast<size_t>(num_modules_);
  }
  /// Names by number.
  [[nodiscard]] const std::vector<std::string>& module_names() const { return names_; }

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

  /// Everything but times, as bytes: equal states are equal strings (for exploring).
  [[nodiscard]] std::string Fingerprint() const;

 private:
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
    std::map<int64_t, int64_t> status_counts;  ///< Told by ACTUATOR, by tick, until complete.
  };

  /// Notes a message that cannot be placed yet, so that it is asked for again later.
  bool Unknown(int64_t tick, int64_t now_us, Actions* out);
  /// What follows from a message that was `fresh` or not.
  bool Taken(bool fresh, int64_t tick, int64_t now_us, Actions* out);
  /// Moves complete_tick_ up to the last tick of which nothing is missing.
  void UpdateComplete();
  /// Nothing of the tick is missing, given that nothing before it is.
  [[nodiscard]] bool TickComplete(int64_t tick) const;
  /// A request for every gap below what must exist by now.
  void ListMissing(Actions* out) const;
  /// Requests for the numbers below `end` that one channel lacks.
  void AskForGaps(const ReceivedSet& received, int64_t end, Topic topic, int module,
                  Actions* out) const;
  /// Acknowledges what is due, and arms or disarms the request timer. `progress`: a further tick
  /// has become whole.
  void AcknowledgeAndAsk(int64_t now_us, bool progress, Actions* out);

  Config config_;
  Phase phase_ = Phase::kIdle;
  // What CLOCK tells of the run; -1 before the first one.
  int num_modules_ = -1, sensors_parts_ = 0, world_parts_ = 0;
  // What has come on the sim's channels and, by number of the module, on the modules'.
  ReceivedSet clock_, sensors_, world_;
  std::vector<Module> modules_;
  std::vector<std::string> names_;
  int64_t highest_tick_ = -1;  ///< SENSORS of it exist.
  // The tick after the last one, and the last one of which nothing is missing; -1 before they are
  // known.
  int64_t end_tick_ = -1;
  int64_t complete_tick_ = -1;
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
