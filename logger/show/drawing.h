#pragma once
// Pictures of robots: convex hulls, shaded, as SVG or PNG. No display is needed (cairo). A caller
// makes a Scene of a robot in a pose, puts scenes into the panels of a Drawing, and has it
// rendered.
//
// World W is NUE: +X north, +Y up, +Z east, ground at y = 0. Views are orthographic.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/base/role_colors.h"
#include "compiler/model/forward_kinematics.h"

namespace morphbus::logger {

/// Where the viewer stands, and what the picture then shows to the right and above.
enum class View {
  kSide,   ///< In the east, looking west: north to the right, up above.
  kTop,    ///< Above, looking down: north to the right, west above.
  kFront,  ///< In the north, looking south: east to the left, up above.
  /// North-east of the robot and above it, looking down at it: height and both directions are seen.
  kThreeQuarter,
  // The same from the three other corners above, and from the corner that is opposite to it, below.
  kFromNorthWest,
  kFromSouthWest,
  kFromSouthEast,
  kFromBelow,  ///< South-west of the robot and below it.
};

/// One body of a picture: a link of a module, or a part of one.
struct SceneHull {
  /// Points whose convex hull is the body, in the frame of its link L (m). Flat sets are drawn as
  /// plates of 3 mm, so that they can be seen edge on.
  std::vector<Eigen::Vector3d> points_L;
  /// Pose of the link in the world (m).
  model::Pose X_WL = model::Pose::Identity();
  Color color = {0.6, 0.6, 0.65};
  /// Number of the module whose body it is, as names refer to it.
  int owner = 0;
  /// Where there are any, the body is no hull but these triangles between the points, seen from
  /// both sides. What no plane parts from a terrain (owner below 0) is painted over it.
  std::vector<std::array<int, 3>> triangles = {};
};

/// The name of a module, as it is to be written on it.
struct SceneName {
  std::string text;
  /// Where the name is to stand, if that part of the module is seen (m, in W).
  Eigen::Vector3d p_W;
  /// SceneHull::owner of the module's bodies.
  int owner = 0;
};

/// A row of the legend: a square of the color, and what it means.
struct LegendEntry {
  std::string text;
  Color color;
};

/// A dot with a short text, drawn over everything: where something is that a reader shall find.
struct SceneMark {
  /// How much it stands out: a dot; a ring, of what something hides; the text alone, also small.
  enum class Kind { kDot, kRing, kText, kSmallText };
  std::string text;
  /// Where it is (m, in W).
  Eigen::Vector3d p_W;
  Color color = {0.81, 0.13, 0.18};
  Kind kind = Kind::kDot;
};

/// A dashed line over everything, below marks: from where something is to where it goes.
struct SceneLine {
  /// Its ends (m, in W).
  Eigen::Vector3d p_W, q_W;
  Color color = {0.81, 0.13, 0.18};
};

/// Everything that one panel shows.
struct Scene {
  std::vector<SceneHull> hulls;
  std::vector<SceneName> names;
  /// Whether to draw the ground: a line and a shaded strip below it in side views, else a grid of
  /// 100 mm.
  bool ground = true;
  std::vector<SceneMark> marks = {};
  std::vector<SceneLine> lines = {};
};

/// One view of one scene, with a line of text above it.
struct Panel {
  Scene scene;
  View view = View::kSide;
  std::string title;
  /// What of the picture plane is shown, (u, v) in metres; none for what the scene needs.
  std::optional<Eigen::AlignedBox2d> extent = {};
  /// Whether arrows say where north, up and east are.
  bool compass = true;
};

/// A picture: panels in rows of `columns`, all at the same scale, with a title above and a legend
/// below.
struct Drawing {
  std::string title;
  std::vector<Panel> panels;
  /// Panels beside each other in a row, at least 1.
  int columns = 1;
  std::vector<LegendEntry> legend;
  /// Width of each panel, in units of an SVG; a PNG has two pixels to each. Heights follow from
  /// the scale.
  double panel_width_px = 760;
  /// Light lines and texts on a dark ground, for pages that are read so. Bodies keep their colors.
  bool dark = false;
};

/// Hulls and names of a robot. X_WL[module][link] are the links' poses in the world (m), shaped as
/// from ForwardKinematics; `colors[module]` is the caller's choice (PaletteColor of its index, or
/// that of its role).
Scene SceneOf(const model::Model& model, const model::Robot& robot,
              const std::vector<std::vector<model::Pose>>& X_WL, const std::vector<Color>& colors);

/// What of the picture plane a panel needs to show its scene, (u, v) in metres, with a margin.
Eigen::AlignedBox2d ExtentOf(const Panel& panel);

/// A picture as pixels, row by row from the top, each four bytes: red, green, blue, 255.
struct Raster {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgba;
};
/// Draws with `ratio` pixels to each unit of the drawing, antialiased. Fails as RenderPicture does.
Result<Raster> RenderRaster(const Drawing& drawing, double ratio);

/// Fails if the suffix of `name` is that of no picture (.svg or .png).
Result<void> CheckPictureName(const std::string& name);
/// The bytes of a picture file, of the kind that the suffix of `name` says (.svg or .png); nothing
/// is written. Fails on another suffix, a drawing without panels, or one that cairo cannot draw, as
/// when it is too large.
Result<std::string> RenderPicture(const Drawing& drawing, const std::string& name);

}  // namespace morphbus::logger
