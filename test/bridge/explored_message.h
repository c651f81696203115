#pragma once
// What is explored (test/bridge/explored_world.h), and the messages of it: what the machines look
// at.

#include <compare>
#include <cstdint>

#include "bridge/lockstep/log/log_lockstep.h"
#include "bridge/lockstep/participant.h"
#include "bridge/lockstep/sim/sim_lockstep.h"

namespace morphbus::bridge {

inline constexpr int kMostModules = 2;

/// How large the explored world is, and what may happen in it.
struct Settings {
  int modules = 2;  ///< 1 or 2; two are mated.
  int64_t ticks = 3;
  bool logger = false;
  bool kills = true;    ///< Modules are killed and resumed.
  bool deaths = false;  ///< One module stops for good, at any moment.
  int64_t window = 2;
  /// The tick from which on the run goes on without the last module; -1: it never does.
  int64_t lose_tick = -1;

  /// The module that may be lost: the last one.
  [[nodiscard]] int LostNumber() const { return modules - 1; }
  /// Ticks that a module has to compute.
  [[nodiscard]] int64_t TicksOf(int i) const {
    return i == LostNumber() && lose_tick >= 0 ? lose_tick : ticks;
  }
  /// Both modules take part in the tick.
  [[nodiscard]] bool BothIn(int64_t tick) const {
    return modules == 2 && tick < TicksOf(LostNumber());
  }
};

/// A message as far as the machines look at it.
struct Message {
  enum class Kind : uint8_t {
    kHello,
    kClock,
    kSensors,
    kActuator,
    kTransform,
    kStatus,
    kAskActuator,
    kAskTransform,
    kAskGap,
    kAck,
    kPoll,
    kEndAck,
    kVerdict,
    kVerdictAck,
    kLeaveAll,
    kLeave,
    kProgress,
  };
  Kind kind = Kind::kHello;
  int process = 0;  ///< Sender of what a process sends; addressee of kAsk*, kLeaveAll, kLeave.
  /// Tick; kStatus: its number; kAskGap: first number; kVerdict: 1 if the run ended well.
  int64_t number = 0;
  int64_t last = 0;             ///< kClock: phase. kAskGap: last number.
  Topic topic = Topic::kClock;  ///< kAskGap.
  auto operator<=>(const Message&) const = default;
};
using Kind = Message::Kind;

/// STATUS messages module 0 has published after tick k: one with tick 0, two with tick 1.
inline int64_t StatusCount(int module, int64_t tick) {
  if (module != 0) return 0;
  return tick == 0 ? 1 : 3;
}
inline int64_t StatusTick(int64_t number) { return number == 0 ? 0 : 1; }

inline LockstepTiming Patient() {
  LockstepTiming timing;
  timing.end_silence_us = timing.join_silence_us = timing.run_silence_us = kNever / 4;
  timing.lost_us = timing.linger_us = kNever / 4;
  return timing;
}

inline SimLockstep::Config SimConfig(const Settings& settings) {
  SimLockstep::Config config;
  config.num_modules = settings.modules;
  config.logger = settings.logger;
  config.num_ticks = settings.ticks;
  config.window = settings.window;
  config.timing = Patient();
  return config;
}

inline LogLockstep::Config LogConfig() {
  LogLockstep::Config config;
  config.ack_every = 1;
  config.timing = Patient();
  return config;
}

}  // namespace morphbus::bridge
