#pragma once
// Where to write names in a picture so that each says of which module it is: on the part of the
// module that is seen, else beside the robot with a line to that part, and not at all where the
// module is hidden.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "logger/show/projection.h"

namespace morphbus::logger {

/// A name as it is drawn. Positions are (u, v) on the picture plane, metres, u to the right and v
/// up.
struct PlacedLabel {
  std::string text;
  /// The middle of the text.
  Eigen::Vector2d centre;
  /// Where the leader line ends on the module; none if the name itself stands on the module, or
  /// found no free place.
  std::optional<Eigen::Vector2d> tip;
};

/// The rectangle of the picture plane in which names may stand, and how finely it is looked at.
struct LabelPlane {
  /// Its lower left and upper right corner (m).
  Eigen::Vector2d low, high;
  /// Edge of a cell (m); all of a cell is one module's, or no module's.
  double cell = 0.001;
  /// Width of a character and height of a line of the type, at the picture's scale (m).
  double character_width = 0.0;
  double character_height = 0.0;
};

/// Places the names of a scene, in its order: those that come later make room. `faces` are its
/// visible faces, farthest first, and `projection` the view in which they were made. A name whose
/// module has no hull at all stands where it is anchored; one whose module is hidden is left out.
std::vector<PlacedLabel> PlaceLabels(const Scene& scene, const std::vector<VisibleFace>& faces,
                                     const Projection& projection, const LabelPlane& plane);

}  // namespace morphbus::logger
