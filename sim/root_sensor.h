#pragma once
// A sensor of the root's pose, as a robot may have one (paper, Sec. III-B): what the physics says,
// with noise if that is asked for.

#include <Eigen/Core>
#include <cstdint>
#include <random>

#include "compiler/model/robot_model.h"

namespace morphbus::sim {

/// White Gaussian noise, anew at every reading: standard deviations.
struct PoseNoise {
  double position_m = 0;    ///< Of each coordinate.
  double rotation_rad = 0;  ///< Of the turn about each axis of the link's frame.
  uint64_t seed = 1;        ///< The same seed gives the same noise.
};

/// Tells the pose of a link in the robot frame R, which stays in the world where it was when the
/// robot was put on the ground (world frame W, parallel to R). Readings depend on the seed and on
/// how many came before.
class RootSensor {
 public:
  /// `robot` is one of `model`'s, at its start values.
  RootSensor(const model::Model& model, const model::Robot& robot, const PoseNoise& noise);

  /// The reading X_RL for a link that is at X_WL. Draws six numbers of the noise, if there is any.
  model::Pose Measure(const model::Pose& X_WL);

 private:
  /// Three independent numbers of this standard deviation.
  Eigen::Vector3d Gaussian(double deviation);

  Eigen::Vector3d p_WoRo_W_;  ///< Origin of the robot frame (m).
  PoseNoise noise_;
  /// The same numbers on every machine, by the C++ standard.
  std::mt19937_64 random_;
};

}  // namespace morphbus::sim
