#include "bridge/outward/scene.h"

#include <utility>

#include "compiler/model/convex_hull.h"
#include "compiler/world/obstacle.h"

namespace morphbus::bridge {
namespace {

/// Of obstacles, which shall not be taken for modules.
constexpr double kObstacleGrey = 0.55;

/// Triangles whose corners are given in the entity's frame.
void FillTriangles(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<std::array<int, 3>>& triangles,
                   foxglove::TriangleListPrimitive* out) {
  // The primitive lies in that frame as it is: an identity, said in full, since viewers read
  // what is missing as 0.
  out->mutable_pose()->mutable_position();
  out->mutable_pose()->mutable_orientation()->set_w(1.0);
  for (const Eigen::Vector3d& p : points) {
    foxglove::Point3& point = *out->add_points();
    point.set_x(p.x());
    point.set_y(p.y());
    point.set_z(p.z());
  }
  for (const std::array<int, 3>& triangle : triangles) {
    for (const int corner : triangle) out->add_indices(static_cast<uint32_t>(corner));
  }
}

/// A convex part, such as of a link. A flat one has its two sides, back to back.
void FillHull(const model::ConvexHull& hull, foxglove::TriangleListPrimitive* out) {
  FillTriangles(hull.vertices, hull.triangles, out);
}

/// Turns the points of a part into the triangles of their convex hull.
void TakeHull(model::VisualPart* part) {
  model::ConvexHull hull = model::ComputeHull(part->points);
  part->points = std::move(hull.vertices);
  part->triangles = std::move(hull.triangles);
}

foxglove::Color Opaque(const Color& rgb) {
  foxglove::Color color;
  color.set_r(rgb[0]);
  color.set_g(rgb[1]);
  color.set_b(rgb[2]);
  color.set_a(1.0);
  return color;
}

void AddMetadata(const std::string& key, const std::string& value, foxglove::SceneEntity* entity) {
  foxglove::KeyValuePair& pair = *entity->add_metadata();
  pair.set_key(key);
  pair.set_value(value);
}

/// An entity that stays until the scene is told anew.
foxglove::SceneEntity& AddEntity(const std::string& id, const std::string& frame,
                                 foxglove::SceneUpdate* scene) {
  foxglove::SceneEntity& entity = *scene->add_entities();
  entity.mutable_timestamp();
  entity.mutable_lifetime();
  entity.set_id(id);
  entity.set_frame_id(frame);
  // It moves with its frame.
  entity.set_frame_locked(true);
  return entity;
}

/// An obstacle, its corners in the run's world frame. Balls and cylinders are their hulls, and of a
/// plane the rectangle that is drawn is there.
void AddObstacle(const std::string& source, const world::Obstacle& obstacle,
                 foxglove::SceneUpdate* scene) {
  std::vector<Eigen::Vector3d> corners_W;
  for (const Eigen::Vector3d& p_O : world::CornersOf(obstacle)) {
    corners_W.push_back(obstacle.X_WO * p_O);
  }
  foxglove::SceneEntity& entity =
      AddEntity(source + "/obstacles/" + obstacle.name, source + "/world", scene);
  AddMetadata("obstacle", obstacle.name, &entity);
  foxglove::TriangleListPrimitive& triangles = *entity.add_triangles();
  if (obstacle.mesh) {
    // One side: viewers draw both, and with four triangles at a side they would see edges all over.
    FillTriangles(corners_W, obstacle.mesh->triangles, &triangles);
  } else {
    FillHull(model::ComputeHull(corners_W), &triangles);
  }
  foxglove::Color& color = *triangles.mutable_color();
  color.set_r(kObstacleGrey);
  color.set_g(kObstacleGrey);
  color.set_b(kObstacleGrey);
  color.set_a(1.0);
}

}  // namespace

std::string LinkFrame(const std::string& prefix, const RunModel& run, int module, int link) {
  return prefix + "/" + run.robot->modules[module].name + "/" + run.TypeOf(module).links[link].name;
}

foxglove::Color ModuleColor(int module) { return Opaque(PaletteColor(module)); }

foxglove::SceneUpdate SceneOf(const std::string& source, const RunModel& run) {
  foxglove::SceneUpdate scene;
  for (size_t m = 0; m < run.robot->modules.size(); ++m) {
    const int module = static_cast<int>(m);
    const model::ModuleType& type = run.TypeOf(module);
    for (size_t l = 0; l < type.links.size(); ++l) {
      // Without triangles there is nothing to see: no hull, or one that is a point or a line.
      std::vector<model::VisualPart> parts;
      for (model::VisualPart& part : type.links[l].Looks()) {
        if (part.triangles.empty()) TakeHull(&part);
        if (!part.triangles.empty()) parts.push_back(std::move(part));
      }
      if (parts.empty()) continue;
      const std::string frame = LinkFrame(source, run, module, static_cast<int>(l));
      foxglove::SceneEntity& entity = AddEntity(frame, frame, &scene);
      AddMetadata("module", run.robot->modules[m].name, &entity);
      AddMetadata("type", type.name, &entity);
      AddMetadata("link", type.links[l].name, &entity);
      std::string own_colors;
      for (size_t i = 0; i < parts.size(); ++i) {
        foxglove::TriangleListPrimitive& triangles = *entity.add_triangles();
        FillTriangles(parts[i].points, parts[i].triangles, &triangles);
        *triangles.mutable_color() = parts[i].color ? Opaque(*parts[i].color) : ModuleColor(module);
        if (parts[i].color) own_colors += (own_colors.empty() ? "" : " ") + std::to_string(i);
      }
      // Who shows modules in colours of roles leaves these lists of triangles as they are.
      if (!own_colors.empty()) AddMetadata("own_colors", own_colors, &entity);
    }
  }
  for (const world::Obstacle& obstacle : run.obstacles) AddObstacle(source, obstacle, &scene);
  return scene;
}

}  // namespace morphbus::bridge
