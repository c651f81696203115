#pragma once
// A line of progress on stderr, on terminals only; and stopwatches.

#include <cstdint>
#include <string>

#include "tools/wall_clock.h"

namespace morphbus::tools {

class Progress {
 public:
  /// @param num_ticks  -1 if the end is not known.
  Progress(std::string what, int64_t num_ticks, uint32_t tick_us);
  /// Draws at most ten times a second.
  void Show(int64_t tick);
  void Clear();

 private:
  std::string what_;
  int64_t num_ticks_;
  double tick_s_;
  bool enabled_;
  bool drawn_ = false;
  double next_s_ = 0.0;
  WallTimer timer_;
};

}  // namespace morphbus::tools
