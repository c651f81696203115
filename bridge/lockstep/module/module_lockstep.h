#pragma once
// A module's side of the lockstep as a pure state machine: events and time in, actions out.
// The rules that it keeps stand in lcmtypes/README.md under "Lockstep"; test/bridge explores it
// together with the other two machines through every order of messages and losses.

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/lockstep/retry_timer.h"

namespace morphbus::bridge {

/// What the participant shall do, in this order.
/// `tick` is the tick that the action speaks of; `mate` is set for kAskMate only.
struct ModuleAction {
  enum class Kind : uint8_t {
    /// Publish HELLO: this module takes part.
    kHello,
    /// Compute and publish `tick`: comes once for every tick, in order.
    kCompute,
    /// Ask module `mate` for its TRANSFORM of `tick`, which is missing.
    kAskMate,
    /// Acknowledge END.
    kEndAck,
    /// The run is over.
    kFinish,
    /// Nothing was heard for too long but SENSORS of later ticks, `tick` at last: another process
    /// seems to play this module. The machine is finished.
    kDuplicateProcess,
    /// Nothing was heard from the sim for too long. The machine is finished.
    kLostSim,
  };
  Kind kind = Kind::kFinish;
  int64_t tick = 0;
  uint16_t mate = 0;
};

/// Decides when a module computes a tick and what it asks for; knows neither bytes nor a bus nor a
/// clock.
class ModuleLockstep {
 public:
  /// The first tick of a module that must still be told it.
  static constexpr int64_t kUnknownTick = -1;
  /// What the machine is told of the run.
  struct Config {
    /// The module acts on the newest sensors there are, and asks for nothing.
    bool realtime = false;
    LockstepTiming timing;
  };
  using Actions = std::vector<ModuleAction>;

  /// The machine is idle until Begin, and ignores every event before it.
  explicit ModuleLockstep(const Config& config);

  /// `tick`: the first one to compute; above 0 for a resumed module, which does not say HELLO;
  /// kUnknownTick for one that takes another's place and says HELLO until OnAdmit.
  void Begin(int64_t tick, int64_t now_us, Actions* out);
  /// The sim says which tick a module computes first that takes another's place.
  void OnAdmit(int64_t tick, int64_t now_us);
  /// The sim says that the run goes on without this module: as END, for this module alone, which is
  /// done once the sim has gone on, so that it has heard the acknowledgement.
  void OnLeave(int64_t now_us, Actions* out);
  /// CLOCK, phase as in sim_clock_t.
  void OnClock(int64_t tick, int phase, int64_t now_us, Actions* out);
  /// What becomes of a message. What follows from it is in `out` already, so that the content of
  /// one that is kFresh must be in place before that is carried out.
  enum class Taken : uint8_t {
    kFresh,       ///< It is of use: of the tick to compute, or TRANSFORM of the one before.
    kKnown,       ///< It was there already, or is too old to be of use.
    kImpossible,  ///< It is of a tick or number that cannot be.
    kForOthers,   ///< The run goes on without this module.
  };
  /// Part of SENSORS. `mine`: it holds this module's reading, and these distinct modules are mated.
  Taken OnSensors(int64_t tick, int part, int num_parts, bool mine,
                  const std::vector<uint16_t>& mates, int64_t now_us, Actions* out);
  /// TRANSFORM of a module that is or was mated, with its number on the channel.
  Taken OnTransform(uint16_t mate, int64_t sequence, int64_t tick, int64_t now_us, Actions* out);
  /// What a module has said is not kept any more: it does not count as there.
  void Forget(uint16_t mate);
  /// A process, which is at `tick`, asked for a message: before END that shows that the run goes
  /// on.
  void OnAsked(int64_t tick, int64_t now_us);
  /// The sim, which is at `tick`, says that it lives: what it waits for is said again.
  void OnProgress(int64_t tick, int64_t now_us, Actions* out);
  /// The sim says that the run is over for everybody.
  void OnLeaveAll(Actions* out);
  /// Does what is due: requests, HELLO, giving up without the sim.
  void OnTime(int64_t now_us, Actions* out);

  /// When OnTime must be called at the latest; kNever if only an event can change anything.
  [[nodiscard]] int64_t next_deadline_us() const;
  [[nodiscard]] int64_t tick() const { return tick_; }  ///< The next one to compute.
  /// The module waits for OnAdmit.
  [[nodiscard]] bool joining() const { return phase_ == Phase::kJoining; }
  /// The run is over for this module, well or not; further events change nothing.
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }
  /// The run goes on without this module, as far as it knows: what comes now is for others.
  [[nodiscard]] bool left() const { return phase_ == Phase::kLeft || phase_ == Phase::kDone; }
  /// All parts of SENSORS of some tick have come; from then on only our own one is needed.
  [[nodiscard]] bool knows_all() const { return knows_all_; }
  /// SENSORS is there, and a neighbour's TRANSFORM is not: it was lost, or comes late.
  [[nodiscard]] bool waits_for_mates() const { return phase_ == Phase::kRun && ask_.armed(); }
  /// TRANSFORM of that tick has come from that module.
  [[nodiscard]] bool Has(uint16_t mate, int64_t tick) const;
  /// The newest tick of which it has; -1: none.
  [[nodiscard]] int64_t NewestOf(uint16_t mate) const;

 private:
  /// Of tests, which explore every order of events and must know which states they have been in.
  friend struct MachineState;

  /// kJoining: HELLO is said until the sim tells the first tick. kLeft: the run goes on without us.
  enum class Phase : uint8_t { kIdle, kJoining, kRun, kLeft, kDone };
  /// A neighbour, and the ticks of its messages that are there.
  struct Mate {
    uint16_t id = 0;
    /// The newest even and the newest odd tick of which its TRANSFORM has come; -1: none.
    int64_t ticks[2] = {-1, -1};
  };

  /// The entry of a neighbour, begun if need be.
  Mate* FindOrAdd(uint16_t id);
  /// Whether SENSORS or TRANSFORM of the tick can have been published by now, and is not over for
  /// longer than anybody keeps it. In lockstep a module knows the last tick there is: SENSORS of
  /// the one that it has not answered, TRANSFORM of that one, too, since a neighbour may be
  /// quicker. In real time it may be any number of ticks behind.
  [[nodiscard]] bool InWindow(int64_t tick) const;
  /// Our own reading of the tick is there, and all other parts of SENSORS if none was ever whole.
  [[nodiscard]] bool Complete() const;
  /// Nothing more is to be done, and all is well.
  void Finish(Actions* out);
  /// Finishes, and returns true, if we have left and the sim, which is at this tick, could not be
  /// there had it not heard so.
  bool FinishOncePast(int64_t tick, Actions* out);
  /// Computes the tick if sensors and the neighbours' messages are there, else asks.
  void TryCompute(int64_t now_us, Actions* out);

  Config config_;
  Phase phase_ = Phase::kIdle;
  // The tick that is computed next, and what has come for it.
  int64_t tick_ = 0;
  int num_parts_ = 0;
  /// Which parts of SENSORS(tick_) are there; empty before the first one.
  std::vector<bool> parts_;
  bool have_reading_ = false;
  /// All parts of some tick were there: they name all modules, so our own is enough from now on.
  bool knows_all_ = false;
  /// The last tick later than ours that SENSORS came of since any that can be the run's; -1: none.
  int64_t ahead_tick_ = -1;
  /// The tick of END; -1 before.
  int64_t end_tick_ = -1;
  int64_t clock_tick_ = -1;      ///< The latest tick that CLOCK came of.
  std::vector<uint16_t> mates_;  ///< Mated in SENSORS(tick_).
  /// All modules that TRANSFORM came from in the last 16 ticks, by id.
  std::vector<Mate> heard_;
  RetryTimer ask_;
  SilenceMeter silence_;
  HelloTimer hello_;
};

}  // namespace morphbus::bridge
