#pragma once
// What the messages of a run say that a log must hold: CLOCK says how many modules there are and in
// how many parts SENSORS and WORLD come, ACTUATOR how many STATUS were published, END how many
// ticks there were. A log from which something was taken, and whose sequence numbers and END were
// made to fit, still lacks what the other messages promise.

#include <cstdint>
#include <map>
#include <morphbus/header_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <set>
#include <string>
#include <string_view>

#include "logger/log/run_facts.h"

namespace morphbus::logger {

/// Collects what the messages of one run promise. The reader of logs gives it every distinct
/// message once, in any order, and calls Judge() after the last.
class PromisedMessages {
 public:
  /// Takes the shape of the run from a CLOCK: modules, parts, length of a tick, number of ticks.
  void TakeClock(const morphbus::sim_clock_t& clock);
  /// Counts, for each module that this part of SENSORS names, that it was sensed.
  void TakeSensors(const morphbus::sensors_t& sensors);
  /// Notes that ACTUATOR of `module` says how many STATUS it has published so far.
  void TakeStatusCount(std::string_view module, int64_t count);
  /// Checks that the sequence number and the sim time of a message on `channel` are those of its
  /// tick. The channel carries `parts` messages a tick, of which this is number `part`; 0 parts
  /// for a channel without a fixed number of messages a tick.
  void TakePlace(const std::string& channel, const morphbus::header_t& header, int64_t parts,
                 int64_t part);

  /// Adds what is promised and not there to `facts`, which has the run's END, last tick and lost
  /// modules: missing messages as losses of their channel, and contradictions as damage at sim time
  /// `time_us` (µs) and file offset 0, since they have no one place. It says nothing of a run that
  /// did not end cleanly: what its last ticks should have held is not known. `realtime`: modules
  /// may leave out ticks, and their numbers need not be the ticks'.
  void Judge(bool realtime, int64_t time_us, LogFacts* facts) const;

 private:
  /// Messages of one channel whose number or time is not that of their tick.
  struct Misplaced {
    /// Messages whose sequence number is not that of their tick.
    int64_t numbers = 0;
    /// Messages whose sim time is not that of their tick.
    int64_t times = 0;
  };

  /// One more than the last control tick that CLOCK named.
  int64_t num_ticks_ = 0;
  /// Length of a control tick, µs of sim time; 0 before the first CLOCK.
  int32_t tick_us_ = 0;
  /// Modules in the run; -1 before the first CLOCK.
  int num_modules_ = -1;
  /// Messages on SENSORS and on WORLD a tick.
  int64_t sensors_parts_ = 0;
  int64_t world_parts_ = 0;
  /// True once CLOCK changed what must be constant.
  bool clock_varies_ = false;
  /// How many times SENSORS named a module, by module: once a tick.
  std::map<std::string, int64_t> readings_;
  /// How many STATUS a module said it had published, by module.
  std::map<std::string, int64_t> status_counts_;
  /// The channels on which messages stand at the wrong place.
  std::map<std::string, Misplaced> misplaced_;
};

}  // namespace morphbus::logger
