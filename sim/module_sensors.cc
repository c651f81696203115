#include "sim/module_sensors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compiler/base/split_mix.h"
#include "compiler/elementary/gaussian.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

/// The random numbers of one sensor at one tick, so that a reading does not depend on what was read
/// before.
class Noise {
 public:
  Noise(uint64_t seed, int64_t tick, int module, size_t sensor)
      : random_(
            SplitMix64::Mix(SplitMix64::Mix(SplitMix64::Mix(seed) ^ static_cast<uint64_t>(tick)) ^
                            (static_cast<uint64_t>(module) << 8 | sensor))) {}

  /// One draw of a normal distribution with mean 0.
  double Gaussian(double deviation) {
    return elementary::Gaussian(deviation, [this] { return random_.Next(); });
  }

 private:
  SplitMix64 random_;
};

/// Whether something touches the sensor's link on the side to which it looks, near enough.
bool IsTouched(const World& world, const model::Sensor& sensor, LinkRef link, const Pose& X_WL) {
  // Links lie at their module's frame when joints are at 0, so that M's coordinates are those of
  // the link.
  const Vector3d p_WS = X_WL * sensor.p_MoSo_M;
  const Vector3d d_W = X_WL.linear() * sensor.direction;
  const std::vector<World::Touch> touches = world.Touches(link);
  return std::any_of(touches.begin(), touches.end(), [&](const World::Touch& touch) {
    // Within 45 degrees of where it looks.
    const bool there = touch.outward_W.dot(d_W) >= std::numbers::sqrt2 / 2;
    return there && (sensor.range_m <= 0 || (touch.p_WT - p_WS).norm() <= sensor.range_m);
  });
}

/// Straight up in the frame of the link, turned a little by noise.
Vector3d MeasuredUp(const Pose& X_WL, double deviation, Noise* noise) {
  // Gravity pulls along -y of W, however the robot accelerates: this is an ideal inclinometer.
  const Vector3d up = X_WL.linear().transpose() * Vector3d::UnitY();
  if (deviation <= 0) return up;
  // Compilers evaluate arguments in an order of their own, so that each draw is a statement.
  Vector3d turn;
  // Turns about three axes, small and independent, are one turn about their sum.
  for (double& angle : turn) angle = noise->Gaussian(deviation);
  const double angle = turn.norm();
  return angle > 0 ? Vector3d(Eigen::AngleAxisd(angle, turn / angle) * up) : up;
}

}  // namespace

void SenseModule(const World& world, const model::Model& model, const model::Robot& robot,
                 const LinkPoseTable& X_WL, int module, uint64_t seed, int64_t tick,
                 morphbus::module_sensors_t* out) {
  const std::vector<model::Sensor>& sensors = model.TypeOf(robot, module).sensors;
  for (size_t i = 0; i < sensors.size(); ++i) {
    const model::Sensor& sensor = sensors[i];
    const Pose& X = X_WL[module][sensor.link];
    // Each sensor has its own numbers at each tick, whether it takes them or not.
    Noise noise(seed, tick, module, i);
    switch (sensor.type) {
      case model::SensorType::kDistance: {
        // The ray passes over the module's own links, as the sensor looks out of it.
        const double seen = world.RayDistance(X * sensor.p_MoSo_M, X.linear() * sensor.direction,
                                              sensor.range_m, module);
        const double noisy = sensor.noise > 0 ? seen + noise.Gaussian(sensor.noise) : seen;
        // Noise leads no reading out of the range that the sensor can tell.
        out->sensor_value.push_back(static_cast<float>(std::clamp(noisy, 0.0, sensor.range_m)));
        break;
      }
      case model::SensorType::kContact:
        out->sensor_value.push_back(IsTouched(world, sensor, {module, sensor.link}, X) ? 1.0F
                                                                                       : 0.0F);
        break;
      case model::SensorType::kTilt: {
        const Vector3d up = MeasuredUp(X, sensor.noise, &noise);
        for (int k = 0; k < 3; ++k) out->sensor_value.push_back(static_cast<float>(up(k)));
        break;
      }
    }
  }
  out->num_sensor_values = static_cast<int8_t>(out->sensor_value.size());
}

}  // namespace morphbus::sim
