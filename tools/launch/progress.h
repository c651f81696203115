#pragma once
// A line of progress on stderr, on terminals only: a script that reads stderr gets no carriage
// returns.

#include <cstdint>
#include <string>

#include "tools/machine/wall_clock.h"

namespace morphbus::tools {

/// How far a run has come: sim time, pace against real time, and a bar if the end is known.
class Progress {
 public:
  /// @param what       what runs, for the beginning of the line: the robot's name.
  /// @param num_ticks  of the whole run; -1 if the end is not known.
  /// @param tick_us    control period of the run, microseconds of sim time.
  Progress(std::string what, int64_t num_ticks, uint32_t tick_us);
  /// Shows that `tick` is done. Draws at most ten times a second, however often it is called, and
  /// nothing where stderr is no terminal.
  void Show(int64_t tick);
  /// Removes the line, so that what is printed next stands alone.
  void Clear();

 private:
  std::string what_;
  int64_t num_ticks_;
  double tick_s_;
  /// Whether stderr is a terminal that can redraw a line.
  bool enabled_;
  /// The earliest time on `timer_` at which the line may be drawn again, in seconds.
  double next_s_ = 0.0;
  /// Runs since construction; the pace is sim time over its time.
  WallTimer timer_;
};

}  // namespace morphbus::tools
