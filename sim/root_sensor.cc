#include "sim/root_sensor.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "compiler/model/forward_kinematics.h"
#include "sim/rigid_body_model.h"

namespace morphbus::sim {

RootSensor::RootSensor(const model::Model& model, const model::Robot& robot, const PoseNoise& noise)
    : noise_(noise), random_(noise.seed) {
  // W is R, lifted until nothing is in the ground: any link tells by how much.
  const Pose X_WL = PlaceOnGround(model, robot)[0][0];
  const Pose X_RL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL[0][0];
  p_WoRo_W_ = X_WL.translation() - X_RL.translation();
}

Eigen::Vector3d RootSensor::Gaussian(double deviation) {
  // Box and Muller's method. The standard library's distribution differs from one to the next.
  constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    // Half a unit keeps the first number from 0, whose logarithm is infinite.
    const double u = (static_cast<double>(random_() >> 11) + 0.5) * kUnit;
    const double turn = static_cast<double>(random_() >> 11) * kUnit * 2 * std::numbers::pi;
    v(i) = deviation * std::sqrt(-2 * std::log(u)) * std::cos(turn);
  }
  return v;
}

model::Pose RootSensor::Measure(const model::Pose& X_WL) {
  // W and R are parallel, so that only the origin differs.
  model::Pose X_RL = X_WL;
  X_RL.translation() -= p_WoRo_W_;
  if (noise_.position_m > 0) X_RL.translation() += Gaussian(noise_.position_m);
  if (noise_.rotation_rad > 0) {
    const Eigen::Vector3d turn = Gaussian(noise_.rotation_rad);
    const double angle = turn.norm();
    // The turn is about axes of the link, and so it is multiplied from the right.
    if (angle > 0) X_RL.linear() *= Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  }
  return X_RL;
}

}  // namespace morphbus::sim
