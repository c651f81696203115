#pragma once
// Where a robot has been while it runs, tick by tick, and the figures that follow from that.

#include <Eigen/Geometry>
#include <vector>

#include "compiler/model/mass_spread.h"
#include "compiler/model/robot_model.h"
#include "logger/figures/run_figures.h"
#include "logger/log/tracked_body.h"
#include "sim/controlled_robot.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// Follows a robot's centre of mass and its trunk in the world (m: north, up, east).
class RobotTrack {
 public:
  /// `model` outlives the track; `robot` is of it. `noise_seed` as in the run's description.
  RobotTrack(const model::Model& model, const model::Robot& robot, uint64_t noise_seed);

  /// Where the robot is now, at `time_us` of sim time: once a tick.
  void Take(const sim::ControlledRobot& robot, int64_t time_us);

  /// Since the first tick: `seconds`; `distance` that the centre of mass is away on level ground,
  /// `north`, `up`, `east` (m); `spot`, the largest distance so far; `turned`, by how much the
  /// trunk has turned about up, to the left if positive (rad, whole turns counted).
  [[nodiscard]] Json FiguresSoFar() const;
  /// `drift`: how far the centre of mass was at most from the straight line, seen from above, from
  /// where it began to where it is (m); `speed`: distance by seconds (m/s).
  [[nodiscard]] Json FiguresOfAll() const;
  /// The mean speed (m/s) from sim time `begin_s` to `end_s`, from place to place on level ground.
  [[nodiscard]] double SpeedBetween(double begin_s, double end_s) const;
  /// The mean height of the trunk in that time (m).
  [[nodiscard]] double HeightBetween(double begin_s, double end_s) const;

  /// What all links weigh together (kg), and the link that stands for the trunk.
  [[nodiscard]] double mass_kg() const { return mass_kg_; }
  [[nodiscard]] const logger::TrackedBody& trunk() const { return trunk_; }

 private:
  /// The sample at a sim time, or the nearest one.
  [[nodiscard]] const logger::RobotSample& At(double seconds) const;

  /// A link with its mass.
  struct Weight {
    int module = 0;
    int link = 0;
    double kg = 0;
    Eigen::Vector3d p_LoLcm_L;
  };
  std::vector<Weight> weights_;
  double mass_kg_ = 0;
  logger::TrackedBody trunk_;
  std::vector<logger::RobotSample> track_;
  double turned_rad_ = 0;
  double spot_m_ = 0;
};

}  // namespace morphbus::tools
