#include "sim/root_sensor.h"

#include <Eigen/Geometry>

#include "compiler/elementary/gaussian.h"
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
  Eigen::Vector3d v;
  for (double& number : v) number = elementary::Gaussian(deviation, random_);
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
