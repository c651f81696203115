#pragma once
// A module's side of the lockstep as a pure state machine: events and time in, actions out.

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/retry_timer.h"

namespace morphbus::bridge {

/// What the party shall do, in this order.
struct ModuleAction {
  enum class Kind : uint8_t {
    kHello,
    kCompute,   ///< Compute and publish `tick`: once for every tick.
    kAskMate,   ///< TRANSFORM of `tick` is missing from module `mate`.
    kEndAck,    ///< Acknowledge END.
    kFinish,    ///< The run is over.
    kIntruder,  ///< The run is past this module's tick: another process plays it. Finished.
    kLostSim,   ///< Nothing heard from the sim for too long. Finished.
  };
  Kind kind = Kind::kFinish;
  int64_t tick = 0;
  uint16_t mate = 0;
};

class ModuleLockstep {
 public:
  struct Config {
    bool realtime = false;
    LockstepTiming timing;
  };
  using Actions = std::vector<ModuleAction>;

  explicit ModuleLockstep(const Config& config);

  /// `tick`: the first one to compute; above 0 for a resumed module, which does not say HELLO.
  void Begin(int64_t tick, int64_t now_us, Actions* out);
  /// CLOCK, phase as in sim_clock_t.
  void OnClock(int64_t tick, int phase, int64_t now_us, Actions* out);
  /// Part of SENSORS. `mine`: it holds this module's reading, and these distinct modules are mated.
  /// Returns true if the part is of the tick to compute and was not there yet: the reading counts.
  bool OnSensors(int64_t tick, int part, int num_parts, bool mine,
                 const std::vector<uint16_t>& mates, int64_t now_us, Actions* out);
  /// TRANSFORM of a module that is or was mated. Returns true if its content is of use (this tick's
  /// or the last one's, not had yet).
  bool OnTransform(uint16_t mate, int64_t tick, int64_t now_us, Actions* out);
  /// Somebody asked for a message: the run is not over yet for all.
  void OnAsked(int64_t now_us) { silence_.Heard(now_us); }
  void OnBye(Actions* out);
  void OnTime(int64_t now_us, Actions* out);

  [[nodiscard]] int64_t next_deadline_us() const;
  [[nodiscard]] int64_t tick() const { return tick_; }  ///< The next one to compute.
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }
  [[nodiscard]] bool ended() const { return phase_ >= Phase::kEnded; }

  /// Everything but times, as bytes: equal states are equal strings (for exploring).
  [[nodiscard]] std::string Fingerprint() const;

 private:
  enum class Phase : uint8_t { kIdle, kRun, kEnded, kDone };
  struct Mate {
    uint16_t id = 0;
    int64_t ticks[2] = {-1, -1};  ///< By parity: what is there.
  };

  Mate* FindOrAdd(uint16_t id);
  [[nodiscard]] bool Has(uint16_t mate, int64_t tick) const;
  [[nodiscard]] bool Complete() const;
  void TryCompute(int64_t now_us, Actions* out);

  Config config_;
  Phase phase_ = Phase::kIdle;
  int64_t tick_ = 0;
  int num_parts_ = 0;
  std::vector<bool> parts_;  ///< Of SENSORS(tick_), which are there.
  bool have_reading_ = false;
  std::vector<uint16_t> mates_;  ///< Mated in SENSORS(tick_).
  std::vector<Mate> heard_;      ///< All that ever were mated, by id.
  RetryTimer ask_;
  SilenceMeter silence_;
  bool sim_heard_ = false;    ///< A CLOCK has come.
  int64_t hello_due_us_ = 0;  ///< Until then: when to say HELLO again.
};

}  // namespace morphbus::bridge
