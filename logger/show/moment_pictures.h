#pragma once
// Pictures of a logged robot at some moments, all at one scale.

#include <cstdint>
#include <string>
#include <vector>

#include "logger/show/robot_scenes.h"

namespace morphbus::logger {

/// A moment of a run (sim time, µs), and what is said of it; "" for nothing.
struct Moment {
  int64_t time_us = 0;
  std::string name;
};

/// A <figure> a moment, with the time below it. Each picture has its own middle and all have the
/// same scale, so that lengths can be compared; they are `width_px` wide. `log` has its series, a
/// robot and a world.
std::string MomentPicturesHtml(const RunLog& log, const SimulatedPoses& poses,
                               const RoleColors& colors, const std::vector<Moment>& moments,
                               double width_px);

/// The same of `count` moments that divide the run evenly, from its start to its end; 2 or more.
/// Empty for a log without a robot or without a world.
std::string StripHtml(const RunLog& log, int count, double width_px);

}  // namespace morphbus::logger
