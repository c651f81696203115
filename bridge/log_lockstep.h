#pragma once
// The logger's side of the lockstep as a pure state machine: events and time in, actions out.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bridge/outbox.h"
#include "bridge/retry_timer.h"

namespace morphbus::bridge {

/// What the party shall do, in this order.
struct LogAction {
  enum class Kind : uint8_t {
    kHello,
    kAck,     ///< All up to `tick` is there.
    kAskGap,  ///< Messages first..last of the line are missing.
    kEndAck,
    kFinish,
    kLostSim,  ///< Nothing heard from the run for too long. Finished.
  };
  enum class Line : uint8_t { kClock, kSensors, kWorld, kTransform, kActuator, kStatus };
  Kind kind = Kind::kFinish;
  int64_t tick = 0;
  Line line = Line::kClock;
  int module = -1;  ///< Number in order of first mention in SENSORS; -1 for the sim's lines.
  int64_t first = 0, last = 0;
};

class LogLockstep {
 public:
  using Line = LogAction::Line;
  using Actions = std::vector<LogAction>;
  struct Config {
    bool passive = false;  ///< Real time: only listens.
    int64_t ack_every = 8;
    int64_t window = kKeptTicks;
    LockstepTiming timing;
  };

  explicit LogLockstep(const Config& config);

  void Begin(int64_t now_us, Actions* out);
  /// CLOCK. Returns false if it was there already, as do all OnX below.
  bool OnClock(int64_t tick, int phase, int num_modules, int sensors_parts, int world_parts,
               int64_t now_us, Actions* out);
  /// SENSORS or WORLD.
  bool OnPart(Line line, int64_t sequence, int64_t tick, int64_t now_us, Actions* out);
  /// TRANSFORM, ACTUATOR or STATUS; `status_count` is ACTUATOR's.
  bool OnModule(Line line, int module, int64_t sequence, int64_t tick, int64_t status_count,
                int64_t now_us, Actions* out);
  /// The sim, at `tick`, asks for an acknowledgement now.
  void OnPoll(int64_t tick, int64_t now_us, Actions* out);
  void OnBye(Actions* out);
  void OnTime(int64_t now_us, Actions* out);
  /// Number of a module that SENSORS mentioned; given at first mention. -1 if CLOCK has not told
  /// the number of modules yet, or it is exhausted.
  int AddModule(const std::string& name);
  /// Number of a known module; -1 if SENSORS has not mentioned it.
  [[nodiscard]] int ModuleNumber(const std::string& name) const;
  [[nodiscard]] bool knows_all_names() const {
    return num_modules_ >= 0 && names_.size() == static_cast<size_t>(num_modules_);
  }
  [[nodiscard]] const std::vector<std::string>& module_names() const { return names_; }

  [[nodiscard]] int64_t next_deadline_us() const;
  /// Last tick of which nothing is missing; -1 before tick 0 is whole.
  [[nodiscard]] int64_t complete_tick() const { return complete_tick_; }
  [[nodiscard]] bool end_seen() const { return end_tick_ >= 0; }
  [[nodiscard]] bool complete() const { return end_seen() && complete_tick_ >= end_tick_ - 1; }
  [[nodiscard]] bool done() const { return phase_ == Phase::kDone; }

  /// Everything but times, as bytes: equal states are equal strings (for exploring).
  [[nodiscard]] std::string Fingerprint() const;

 private:
  enum class Phase : uint8_t { kIdle, kRun, kEnded, kDone };
  /// Which numbers of a line are there.
  struct Row {
    int64_t next = 0;             ///< All below are there.
    std::vector<int64_t> beyond;  ///< Above, sorted.
    bool Take(int64_t sequence, bool passive);
  };
  struct Module {
    Row transform, actuator, status;
    std::map<int64_t, int64_t> status_counts;  ///< Told by ACTUATOR, by tick, until complete.
  };

  bool Unknown(int64_t tick, int64_t now_us, Actions* out);
  bool Taken(bool fresh, int64_t tick, int64_t now_us, Actions* out);
  void UpdateComplete();
  [[nodiscard]] bool TickComplete(int64_t tick) const;
  void ListMissing(Actions* out) const;
  void AskRow(const Row& row, int64_t end, Line line, int module, Actions* out) const;
  void Settle(int64_t now_us, bool progress, Actions* out);

  Config config_;
  Phase phase_ = Phase::kIdle;
  int num_modules_ = -1, sensors_parts_ = 0, world_parts_ = 0;
  Row clock_, sensors_, world_;
  std::vector<Module> modules_;
  std::vector<std::string> names_;
  int64_t highest_tick_ = -1;  ///< SENSORS of it exist.
  int64_t end_tick_ = -1;
  int64_t complete_tick_ = -1;
  int64_t acked_tick_ = -1;
  RetryTimer ask_;
  SilenceMeter silence_;
  bool sim_heard_ = false;    ///< A CLOCK has come.
  int64_t hello_due_us_ = 0;  ///< Until then: when to say HELLO again.
};

}  // namespace morphbus::bridge
