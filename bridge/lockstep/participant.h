#pragma once
// A participant of a run: sim, module or logger, between a bus and its state machine.

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

class InprocHub;

/// A deadline that never comes.
inline constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

/// Microseconds from an arbitrary start; never sim time, and never in a payload of a hashed
/// channel.
class TimeSource {
 public:
  virtual ~TimeSource() = default;
  /// The present time; never less than it was before.
  [[nodiscard]] virtual int64_t NowUs() const = 0;
};

/// The machine's monotonic clock.
class MonotonicTime : public TimeSource {
 public:
  [[nodiscard]] int64_t NowUs() const override;
};

/// Time that a test or an in-process run moves.
class VirtualTime : public TimeSource {
 public:
  [[nodiscard]] int64_t NowUs() const override { return now_us_; }
  /// To `us`, if that lies ahead: at once.
  virtual void AdvanceTo(int64_t us) { now_us_ = us > now_us_ ? us : now_us_; }

 private:
  int64_t now_us_ = 0;
};

/// For in-process runs at the wall's pace (--speed, --realtime): advancing sleeps, half a second at
/// most.
class SleepingTime : public VirtualTime {
 public:
  [[nodiscard]] int64_t NowUs() const override;
  void AdvanceTo(int64_t us) override;
};

/// Whoever takes part in a run: it is started once, told of time, and asked when it needs to be
/// told again. Messages reach it through its bus.
class Participant {
 public:
  virtual ~Participant() = default;
  /// Subscribes and says hello.
  virtual void Start() = 0;
  /// Does what is due. Call after the bus was handled, at the latest at next_deadline_us().
  virtual void OnTime() = 0;
  /// When OnTime must be called at the latest; kNever if only a message can change anything.
  [[nodiscard]] virtual int64_t next_deadline_us() const = 0;
  /// True once the run is over for this participant, well or not.
  [[nodiscard]] virtual bool done() const = 0;
};

/// Runs participants that share one bus until all are done or `*stop` (may be null; set by a signal
/// handler) is true. Sleeps on the bus between events. `each_second` (may be empty) is called about
/// once a second of wall time and after the end: HEALTH, progress. Participants that are done are
/// still told the time, but waited for no longer.
void RunParticipants(Bus* bus, const TimeSource& time,
                     const std::vector<Participant*>& participants, const volatile bool* stop,
                     const std::function<void()>& each_second);

/// Runs participants on one hub in virtual time until all are done: no sleeping, loss costs no wall
/// time. Returns false if nothing could happen any more though some participant was not done (our
/// bug), or if `*stop` (may be null) became true.
bool RunInproc(InprocHub* hub, VirtualTime* time, const std::vector<Participant*>& participants,
               const volatile bool* stop = nullptr);
/// The same for participants that were started: goes on with a run that `*stop` had ended.
bool ContinueInproc(InprocHub* hub, VirtualTime* time,
                    const std::vector<Participant*>& participants,
                    const volatile bool* stop = nullptr);

}  // namespace morphbus::bridge
