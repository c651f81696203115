#pragma once
// Pictures of a logged run: one moment, several beside each other, or all of it in motion. Modules
// are coloured by their roles.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/base/role_colors.h"
#include "logger/compare/kinematic_tracks.h"
#include "logger/log/run_log.h"
#include "logger/show/drawing.h"

namespace morphbus::logger {

/// A stretch of sim time (s). What lies beyond the log is cut; without an end it is the log's.
struct PictureTimes {
  double from_s = 0.0;
  std::optional<double> to_s;
};

/// Takes a frame of a video, and for how many milliseconds it is shown. A failure ends the video.
using FrameTaker = std::function<Result<void>(const Raster& frame, int milliseconds)>;

/// Draws from one log.
class LogPictures {
 public:
  /// Fails for a log without a robot or without simulated poses. `log` was read with its series,
  /// and outlives this.
  static Result<std::unique_ptr<LogPictures>> Of(const RunLog& log);

  /// The robot as WORLD had it at or last before `at_s` (sim time, s), a panel a view. Fails for a
  /// time more than a second beyond the log's end: people round times.
  [[nodiscard]] Result<Drawing> Moment(double at_s, const std::vector<View>& views) const;
  /// The robot at `count` (at least 1) moments, evenly spread, beside each other; a row a view.
  /// Fails if the log ends before the stretch begins.
  [[nodiscard]] Result<Drawing> Strip(int count, const PictureTimes& times,
                                      const std::vector<View>& views) const;
  /// Draws a video with `fps` (1 to 50) frames a second of sim time, all of one size, and hands
  /// each to `take` as it is drawn. The camera goes with the robot; the ground shows where it goes.
  /// Fails likewise, or as `take` does.
  /// @param width_px  width of each view, pixels; 0: 640.
  /// @param progress  if not empty, hears now and then how much is done, 0 to 1.
  [[nodiscard]] Result<void> Frames(int fps, int width_px, const PictureTimes& times,
                                    const std::vector<View>& views, const FrameTaker& take,
                                    const std::function<void(double)>& progress = {}) const;
  /// The bytes of an animated WebP of these frames.
  [[nodiscard]] Result<std::string> Video(int fps, int width_px, const PictureTimes& times,
                                          const std::vector<View>& views,
                                          const std::function<void(double)>& progress = {}) const;

 private:
  explicit LogPictures(const RunLog& log);
  /// The stretch in µs.
  [[nodiscard]] Result<std::pair<int64_t, int64_t>> Stretch(const PictureTimes& times) const;
  /// The robot at a time, with or without the names of its modules.
  [[nodiscard]] Scene SceneOf(int64_t time_us, bool names) const;

  const RunLog& log_;
  SimulatedPoses poses_;
  RoleColors colors_;
};

}  // namespace morphbus::logger
