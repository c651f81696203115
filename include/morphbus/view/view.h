#pragma once
// Pictures of robots, moving pictures and pages of runs.
//
// Library morphbus-view. Its functions may be called from any number of threads at once, and need
// no display. What they return are the bytes of files.

#include <morphbus/export.h>
#include <morphbus/model/model.h>
#include <morphbus/observe/log.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace morphbus {

/// Where the viewer stands: in the east looking west, above looking down, in the north looking
/// south, or north-east of the robot and above it.
enum class View { kSide, kTop, kFront, kThreeQuarter };

/// The kinds of pictures.
enum class PictureFormat { kSvg, kPng };

/// A robot standing on the ground, a panel a view, each module in a colour of its own.
/// @param joint_values  in the order of Robot::joints (rad or m); empty: as the robot starts.
/// Throws Failure for another number of values, or no view.
MORPHBUS_EXPORT std::string DrawRobot(const Robot& robot, std::span<const double> joint_values,
                                      const std::vector<View>& views,
                                      PictureFormat format = PictureFormat::kSvg);

/// A logged robot at a sim time (s), modules coloured by role. Throws Failure where the log holds
/// no robot or no simulated poses, or ends before.
MORPHBUS_EXPORT std::string DrawMoment(const Log& log, double at_s, const std::vector<View>& views,
                                       PictureFormat format = PictureFormat::kSvg);

/// A stretch of sim time (s); without an end it goes to the end of the log.
struct Stretch {
  double from_s = 0;
  std::optional<double> to_s = {};
};

/// A logged robot at `count` (1 to 100) moments of a stretch, beside each other; a row a view.
MORPHBUS_EXPORT std::string DrawStrip(const Log& log, int count, const Stretch& stretch,
                                      const std::vector<View>& views,
                                      PictureFormat format = PictureFormat::kSvg);

/// A logged robot in motion, as animated WebP with `fps` (1 to 50) pictures a second of sim time.
MORPHBUS_EXPORT std::string DrawVideo(const Log& log, int fps, const Stretch& stretch,
                                      const std::vector<View>& views);

/// The page of `morphbus report`: one run, as one HTML file without scripts.
MORPHBUS_EXPORT std::string ReportHtml(const Log& log);
/// The page of `morphbus compare --report`: two runs, compared tick by tick.
MORPHBUS_EXPORT std::string ReportHtml(const Log& a, const Log& b);

}  // namespace morphbus
