#include "logger/figures/energy.h"

#include <algorithm>
#include <cmath>

#include "compiler/model/link_mass.h"
#include "logger/figures/run_figures.h"

namespace morphbus::logger {

Transport MeasureTransport(const RobotMotion& motion, double energy_j, int64_t begin_us,
                           int64_t end_us) {
  Transport transport;
  if (motion.track.empty()) return transport;
  // The straight way from beginning to end, not the path: swaying brings a robot nowhere.
  const Eigen::Vector3d way =
      SampleAt(motion.track, end_us).p_WCm - SampleAt(motion.track, begin_us).p_WCm;
  // Up is y: what is climbed is in the energy.
  transport.distance_m = std::hypot(way.x(), way.z());
  const double weight_n = motion.mass_kg * model::kGravity;
  if (transport.distance_m >= kLeastDistanceM && weight_n > 0.0) {
    transport.cost = energy_j / (weight_n * transport.distance_m);
  }
  return transport;
}

EnergyMeter::EnergyMeter(const RobotMotion& motion)
    : first_us_(motion.first_us), tick_us_(motion.tick_us) {
  for (const JointSeries& joint : motion.joints) {
    until_.resize(std::max(until_.size(), joint.position.size()), 0.0);
    // until_ holds what each tick turned over first, and sums up to it after the last joint.
    for (size_t k = 1; k < joint.position.size(); ++k) {
      // The effort of a tick is told at its end, as is where the joint came.
      const double work = joint.effort[k] * (joint.position[k] - joint.position[k - 1]);
      // Of a joint that nothing was heard of there is nothing to count.
      if (std::isfinite(work)) until_[k] += std::abs(work);
    }
  }
  for (size_t k = 1; k < until_.size(); ++k) until_[k] += until_[k - 1];
}

double EnergyMeter::Between(int64_t begin_us, int64_t end_us) const {
  return Until(end_us) - Until(begin_us);
}

double EnergyMeter::Until(int64_t time_us) const {
  if (until_.empty() || time_us <= first_us_) return 0.0;
  // Within a tick the energy is taken to grow evenly, since efforts are means over it.
  const auto ticks = static_cast<double>(time_us - first_us_) / tick_us_;
  const auto k = static_cast<size_t>(ticks);
  if (k + 1 >= until_.size()) return until_.back();
  return until_[k] + (ticks - static_cast<double>(k)) * (until_[k + 1] - until_[k]);
}

}  // namespace morphbus::logger
