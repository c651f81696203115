#pragma once
// How far a robot's trunk was tilted after something was done to it, from the messages of a log as
// they are read.

#include <Eigen/Geometry>
#include <cstdint>
#include <morphbus/world_t.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "logger/log/tracked_body.h"

namespace morphbus::logger {

/// Follows one body through WORLD. Its tilt is that of WalkFigures: against its orientation in the
/// first message that has it. Orientations are kept only from KeepOn() on, so that a log in which
/// nothing is asked for costs nothing.
class TiltTrack {
 public:
  /// The body to follow; without one nothing is wanted.
  void Follow(const TrackedBody& body) { body_ = body; }
  /// From now on all orientations are kept.
  void KeepOn() { keeping_ = true; }
  /// Whether Take() would learn anything from a WORLD of this sim time (µs).
  [[nodiscard]] bool Wants(int64_t time_us) const;
  /// A WORLD, or a part of it.
  void Take(const morphbus::world_t& world);
  /// The largest tilt (rad) at sim times `begin_us` (µs) up to and without `end_us`; none if the
  /// body was not seen then.
  [[nodiscard]] std::optional<double> Largest(int64_t begin_us, int64_t end_us) const;

 private:
  /// Sim time (µs) and orientation of the body in W.
  using Sample = std::pair<int64_t, Eigen::Quaterniond>;

  std::optional<TrackedBody> body_;
  bool keeping_ = false;
  std::optional<Sample> first_;
  std::vector<Sample> kept_;
};

}  // namespace morphbus::logger
