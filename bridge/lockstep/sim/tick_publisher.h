#pragma once
// What the simulator publishes at every tick: CLOCK, SENSORS and WORLD.

#include <cstdint>
#include <functional>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <vector>

#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/sim/robot_readings.h"
#include "bridge/lockstep/sim/run_members.h"

namespace morphbus::bridge {

/// Makes the messages of a tick and sends them, and once more to those who may have missed them.
/// Into how many parts SENSORS and WORLD are split is settled once for the whole run, since
/// listeners count parts.
class TickPublisher {
 public:
  /// Announcements that a CLOCK carries at most; further ones wait for the next tick.
  static constexpr size_t kMostAnnounced = 5;

  /// @param outbox   outlives the publisher; it is the simulator's.
  /// @param modules  those of the run, in order of id.
  /// @param tick_us  length of a tick, microseconds of sim time.
  TickPublisher(Outbox* outbox, const std::vector<ExpectedModule>& modules, int32_t tick_us);

  /// Text that the next CLOCK with room carries among its `controls`: an effect that begins at that
  /// tick. That of tick 0 has none.
  void Announce(const std::string& text);
  /// Publishes CLOCK of a tick. It goes first, so that listeners know how many parts of the others
  /// to expect. `readings` are those of the tick.
  void PublishClock(int64_t tick, bool started, const RobotReadings& readings);
  /// Publishes CLOCK with PHASE_END; `tick` is the one after the last.
  void PublishEnd(int64_t tick, const std::string& reason);
  /// Publishes SENSORS, each part with what `add_orders` adds for its modules (by place), and
  /// WORLD.
  void PublishReadings(int64_t tick, const RobotReadings& readings,
                       const std::function<void(const std::vector<size_t>& members,
                                                morphbus::sensors_t* part)>& add_orders);

  /// Publishes CLOCK of a tick again, byte for byte.
  void RepeatClock(int64_t tick);
  /// The same of END, the last message on CLOCK.
  void RepeatEnd();
  /// Publishes those parts of SENSORS again that hold a module which `lacks` it, or all of them
  /// where that may be needed. WORLD is not repeated: only the logger needs it, and asks for what
  /// it lacks.
  void RepeatSensors(int64_t tick, const std::function<bool(size_t module)>& lacks);

 private:
  /// Settles how the messages of this run are split.
  void Split(const RobotReadings& readings);
  /// Fills in what CLOCK says at any tick, with the announcements that have room, and sends it.
  void SendClock(int64_t tick, int8_t phase, const std::string& end_reason);
  [[nodiscard]] int64_t TimeOf(int64_t tick) const { return tick * tick_us_; }

  Outbox* outbox_;
  int32_t tick_us_;
  std::string clock_, sensors_, world_;  ///< Names of the channels.
  std::vector<int> num_connectors_;      ///< By module.
  /// The modules of each part of SENSORS, by place in the run; empty before the first tick.
  std::vector<std::vector<size_t>> sensors_parts_;
  int world_parts_ = 0;
  std::vector<std::string> announcements_;  ///< That no CLOCK has carried yet.
  /// The tick whose SENSORS were repeated last, and how often.
  int64_t repeated_tick_ = -1;
  int times_repeated_ = 0;
  /// The last part of SENSORS that was sent, whose memory is used again and again.
  morphbus::sensors_t message_;
};

}  // namespace morphbus::bridge
