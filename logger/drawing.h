#pragma once
// Pictures of robots: convex hulls, shaded, as SVG or PNG. No display is needed (cairo).
//
// World W is NUE: +X north, +Y up, +Z east, ground at y = 0. Views are orthographic.

#include <array>
#include <string>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "compiler/source/result.h"

namespace morphbus::logger {

/// Where the viewer stands.
enum class View {
  kSide,          ///< In the east, looking west: north to the right, up above.
  kTop,           ///< Above, looking down: north to the right, west above.
  kFront,         ///< In the north, looking south: east to the left, up above.
  kThreeQuarter,  ///< North-east, above.
};

/// Red, green, blue, 0…1.
using Color = std::array<double, 3>;

/// One convex body of a picture.
struct SceneHull {
  std::vector<Eigen::Vector3d> points_L;  ///< In the link's frame (m); flat sets are thickened.
  model::Pose X_WL = model::Pose::Identity();
  Color color = {0.6, 0.6, 0.65};
};

/// A name written at a place.
struct SceneName {
  std::string text;
  Eigen::Vector3d p_W;
};

/// A row of the legend.
struct LegendEntry {
  std::string text;
  Color color;
};

struct Scene {
  std::vector<SceneHull> hulls;
  std::vector<SceneName> names;
  bool ground = true;  ///< Draw the ground line (side views) or a grid (other views).
};

struct Panel {
  Scene scene;
  View view = View::kSide;
  std::string title;
};

/// A picture: panels in rows of `columns`, all at the same scale.
struct Drawing {
  std::string title;
  std::vector<Panel> panels;
  int columns = 1;
  std::vector<LegendEntry> legend;
  double panel_width_px = 760;
};

/// The color that stands for entry `index` of a legend; eight well separable ones, then again.
Color PaletteColor(int index);

/// Hulls and names of a robot. X_WL[module][link] as from ForwardKinematics; `group[module]` picks
/// the module's color and is the caller's choice (its index, or that of its role).
Scene SceneOf(const model::Model& model, const model::Robot& robot,
              const std::vector<std::vector<model::Pose>>& X_WL, const std::vector<int>& group);

/// The bytes of a picture file, of the kind that the suffix of `name` says (.svg or .png). Fails on
/// another suffix or a drawing without panels.
Result<std::string> RenderPicture(const Drawing& drawing, const std::string& name);

}  // namespace morphbus::logger
