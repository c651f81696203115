#pragma once
// What the motors of a robot turned over, and how dearly it paid for its way.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "logger/figures/robot_motion.h"

namespace morphbus::logger {

/// The cost of transport: energy over weight times distance, a number without a unit by which
/// walkers, swimmers and vehicles of all sizes are compared (V. A. Tucker, "The energetic cost of
/// moving about", American Scientist 63, 1975; of walking robots S. Collins et al., "Efficient
/// bipedal robots based on passive-dynamic walkers", Science 307, 2005, whose *mechanical* cost
/// this is: what drives and electronics lose is not in it). The distance is how far the centre of
/// mass came over the ground, from beginning to end.
struct Transport {
  /// None for a robot that came nowhere, whose cost would be chance over next to nothing: less than
  /// kLeastDistanceM.
  std::optional<double> cost;
  double distance_m = 0.0;
};
inline constexpr double kLeastDistanceM = 0.01;

Transport MeasureTransport(const RobotMotion& motion, double energy_j, int64_t begin_us,
                           int64_t end_us);

/// The energy that the motors turned over, counted from the run's start. In a tick a motor whose
/// joint goes from q0 to q1 (rad or m) against or with its mean effort turns over |effort (q1 -
/// q0)|, J: what it puts in when it drives, and as much as it takes out when it brakes, since
/// servos win nothing back.
class EnergyMeter {
 public:
  explicit EnergyMeter(const RobotMotion& motion);
  /// Between two sim times (µs); ticks that lie in it in part count in part.
  [[nodiscard]] double Between(int64_t begin_us, int64_t end_us) const;
  /// Of the whole run.
  [[nodiscard]] double Total() const { return until_.empty() ? 0.0 : until_.back(); }

 private:
  [[nodiscard]] double Until(int64_t time_us) const;

  int64_t first_us_;
  int32_t tick_us_;
  std::vector<double> until_;  ///< By tick: all that was turned over before it.
};

}  // namespace morphbus::logger
