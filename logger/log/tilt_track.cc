#include "logger/log/tilt_track.h"

#include <algorithm>

namespace morphbus::logger {

bool TiltTrack::Wants(int64_t time_us) const {
  return body_ && (keeping_ || !first_ || time_us < first_->first);
}

void TiltTrack::Take(const morphbus::world_t& world) {
  const int64_t time_us = world.header.sim_time_us;
  if (!Wants(time_us)) return;
  // WORLD names a body by the link that stands for it.
  for (const morphbus::body_pose_t& pose : world.bodies) {
    if (pose.module_id != body_->link.module || pose.link != body_->link.link) continue;
    const double* q = pose.orientation_wxyz;
    const Sample sample = {time_us, Eigen::Quaterniond(q[0], q[1], q[2], q[3])};
    // Messages may stand in the file in any order; the earliest one is where the robot began.
    if (!first_ || time_us < first_->first) first_ = sample;
    if (keeping_) kept_.push_back(sample);
  }
}

std::optional<double> TiltTrack::Largest(int64_t begin_us, int64_t end_us) const {
  std::optional<double> largest;
  for (const auto& [time_us, q] : kept_) {
    if (time_us < begin_us || time_us >= end_us) continue;
    largest = std::max(largest.value_or(0.0), TiltBetween(first_->second, q));
  }
  return largest;
}

}  // namespace morphbus::logger
