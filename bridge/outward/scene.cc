#include "bridge/outward/scene.h"

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

foxglove::Color ModuleColor(int module) {
  const Color rgb = PaletteColor(module);
  foxglove::Color color;
  color.set_r(rgb[0]);
  color.set_g(rgb[1]);
  color.set_b(rgb[2]);
  color.set_a(1.0);
  return color;
}

foxglove::SceneUpdate SceneOf(const std::string& source, const RunModel& run) {
  foxglove::SceneUpdate scene;
  for (size_t m = 0; m < run.robot->modules.size(); ++m) {
    const int module = static_cast<int>(m);
    const model::ModuleType& type = run.TypeOf(module);
    for (size_t l = 0; l < type.links.size(); ++l) {
      // Without triangles there is nothing to see: no hull, or one that is a point or a line.
      std::vector<model::ConvexHull> parts;
      for (const auto& points : type.links[l].Parts()) parts.push_back(model::ComputeHull(points));
      std::erase_if(parts, [](const model::ConvexHull& part) { return part.triangles.empty(); });
      if (parts.empty()) continue;
      const std::string frame = LinkFrame(source, run, module, static_cast<int>(l));
      foxglove::SceneEntity& entity = AddEntity(frame, frame, &scene);
      AddMetadata("module", run.robot->modules[m].name, &entity);
      AddMetadata("type", type.name, &entity);
      AddMetadata("link", type.links[l].name, &entity);
      for (const model::ConvexHull& part : parts) {
        foxglove::TriangleListPrimitive& triangles = *entity.add_triangles();
        FillHull(part, &triangles);
        *triangles.mutable_color() = ModuleColor(module);
      }
    }
  }
  for (const world::Obstacle& obstacle : run.obstacles) AddObstacle(source, obstacle, &scene);
  return scene;
}

}  // namespace morphbus::bridge
