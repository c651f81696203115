#pragma once
// Where the camera of a Webots world stands.

#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// Webots' default angle of view (rad), across the wider side of the picture.
constexpr double kFieldOfView = 0.785398;

/// Pose of the camera from which all `points` (world: y up, m) are in view, from the north-east and
/// above, in a picture of up to 16:9. As in Webots since R2022a the camera looks along its x, and
/// its z is up.
model::Pose ViewOf(const std::vector<Eigen::Vector3d>& points);

}  // namespace morphbus::emit
