#pragma once
// What stands in a Webots world beside the robot, and from where it is seen.

#include <string>
#include <vector>

#include "compiler/emit/vrml_writer.h"
#include "compiler/model/robot_model.h"
#include "compiler/world/obstacle.h"

namespace morphbus::emit {

/// Pose of the camera from which all `points` (world: y up, m) are in view, from the north-east and
/// above, in a picture of up to 16:9. As in Webots since R2022a the camera looks along its x, and
/// its z is up.
model::Pose ViewOf(const std::vector<Eigen::Vector3d>& points);

/// The material of a link with a friction of its own.
std::string WebotsMaterialOf(const model::ModuleType& type, const model::Link& link);

/// Lines of WorldInfo that say how obstacles, and links of the robot, with a friction of their own
/// grip; none if there are no such ones.
std::vector<std::string> WebotsContacts(const model::Model& model, const model::Robot& robot,
                                        const std::vector<world::Obstacle>& obstacles);

/// An obstacle as a Solid, its shape defined under the name `hull`. A plane is a slab of its sides;
/// cylinders and balls are their hulls, for no program lays those otherwise; a mesh is its
/// triangles.
void AppendWebotsObstacle(const world::Obstacle& obstacle, const std::string& hull,
                          VrmlWriter* vrml);

}  // namespace morphbus::emit
