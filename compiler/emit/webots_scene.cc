#include "compiler/emit/webots_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace morphbus::emit {

using Eigen::Vector3d;

namespace {

/// Webots' default angle of view (rad), across the wider side of the picture.
constexpr double kFieldOfView = 0.785398;

/// How thick the slab of a plane is (m).
constexpr double kSlab = 0.02;

/// The material of an obstacle with a friction of its own.
std::string MaterialOf(const world::Obstacle& obstacle) { return obstacle.name + ".surface"; }

}  // namespace

model::Pose ViewOf(const std::vector<Vector3d>& points) {
  constexpr double kLeastRadius = 0.05;  // m, so that a single small module does not fill the view.
  constexpr double kMargin = 1.2;
  // The ball around all points, from the middle of their box, must fit the view.
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  if (box.isEmpty()) box.extend(Vector3d::Zero());
  const Vector3d middle = box.center();
  double radius = kLeastRadius;
  for (const Vector3d& p : points) radius = std::max(radius, (p - middle).norm());
  // Across the narrower side the view is narrower, and a ball's outline is seen before its middle.
  const double half_angle = std::atan(std::tan(0.5 * kFieldOfView) * 9.0 / 16.0);
  const double distance = kMargin * radius / std::sin(half_angle);
  // From the north-east and above, with the horizon level.
  const Vector3d forward = -Vector3d(0.8, 0.6, 0.7).normalized();
  const Vector3d left = Vector3d::UnitY().cross(forward).normalized();
  model::Pose X = model::Pose::Identity();
  // A viewpoint looks along its x, with z upwards, in worlds of NUE, too.
  X.linear() << forward, left, forward.cross(left);
  X.translation() = middle - distance * forward;
  return X;
}

std::string WebotsMaterialOf(const model::ModuleType& type, const model::Link& link) {
  return type.name + "." + link.name + ".surface";
}

std::vector<std::string> WebotsContacts(const model::Model& model, const model::Robot& robot,
                                        const std::vector<world::Obstacle>& obstacles) {
  // Obstacles first, then the links of each module type that the robot has.
  std::vector<std::pair<std::string, double>> materials;
  for (const world::Obstacle& obstacle : obstacles) {
    if (obstacle.friction) materials.emplace_back(MaterialOf(obstacle), *obstacle.friction);
  }
  const size_t first_link = materials.size();
  std::set<int> types;
  for (const model::ModuleInstance& module : robot.modules) types.insert(module.type);
  for (const int t : types) {
    for (const model::Link& link : model.module_types[t].links) {
      if (!link.friction) continue;
      materials.emplace_back(WebotsMaterialOf(model.module_types[t], link), *link.friction);
    }
  }
  std::string contacts;
  const auto add = [&](const std::string& a, const std::string& b, double friction) {
    contacts += fmt::format(
        "{}ContactProperties {{ material1 \"{}\" material2 \"{}\" coulombFriction [ {} ] }}",
        contacts.empty() ? "" : ", ", a, b, Number(friction));
  };
  // Each against what has no friction of its own, and a link against each that has: as in a run,
  // the one friction counts alone, and of two the geometric mean.
  for (const auto& [name, friction] : materials) add("default", name, friction);
  for (size_t b = first_link; b < materials.size(); ++b) {
    for (size_t a = 0; a <= b; ++a) {
      add(materials[a].first, materials[b].first,
          std::sqrt(materials[a].second * materials[b].second));
    }
  }
  if (contacts.empty()) return {};
  return {"contactProperties [ " + contacts + " ]"};
}

void AppendWebotsObstacle(const world::Obstacle& obstacle, const std::string& hull,
                          VrmlWriter* vrml) {
  world::Obstacle solid = obstacle;
  if (solid.shape == world::Shape::kPlane) {
    // Its upper side is the plane.
    solid.shape = world::Shape::kBox;
    solid.size.z() = kSlab;
    solid.X_WO = solid.X_WO * Eigen::Translation3d(0, 0, -0.5 * kSlab);
  }
  vrml->Open("Solid {");
  vrml->Place(solid.X_WO);
  vrml->Line(fmt::format("name \"{}\"", obstacle.name));
  vrml->Open("children [");
  const Vector3d color(0.55, 0.5, 0.45);
  if (solid.mesh) {
    vrml->Triangles(hull, *solid.mesh, color);
  } else {
    vrml->Hull(hull, model::ComputeHull(world::CornersOf(solid)), color);
  }
  vrml->Close("]");
  vrml->Line("boundingObject USE " + hull);
  // A material of its own lets ContactProperties name its friction with all others.
  if (obstacle.friction) vrml->Line(fmt::format("contactMaterial \"{}\"", MaterialOf(obstacle)));
  vrml->Close("}");
}

}  // namespace morphbus::emit
