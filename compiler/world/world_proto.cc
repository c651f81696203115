#include "compiler/world/world_proto.h"

#include <fmt/format.h>

#include "compiler/world/sdf_world.h"

namespace morphbus::world {
namespace {

/// Corners are floats, as they are in mesh files.
Result<TriangleMesh> MeshIn(const proto::WorldMesh& message) {
  TriangleMesh mesh;
  // Three coordinates make a corner, three indices a triangle.
  if (message.points_size() % 3 != 0 || message.corners_size() % 3 != 0) return Fail("is cut");
  for (int i = 0; i < message.points_size(); i += 3) {
    mesh.points.emplace_back(message.points(i), message.points(i + 1), message.points(i + 2));
  }
  for (int i = 0; i < message.corners_size(); i += 3) {
    std::array<int, 3>& triangle = mesh.triangles.emplace_back();
    // An index beyond INT_MAX becomes negative here, which Check refuses like any that names no
    // corner.
    for (int k = 0; k < 3; ++k) triangle[k] = static_cast<int>(message.corners(i + k));
  }
  return mesh;
}

/// Two bytes a sample, the higher one first, as in PNG.
Heights HeightsIn(const proto::WorldHeights& message) {
  Heights heights;
  heights.columns = static_cast<int>(message.columns());
  heights.rows = static_cast<int>(message.rows());
  const std::string& bytes = message.samples();
  // Neither the number of samples nor columns and rows are looked at here: Check compares them.
  for (size_t i = 0; i + 1 < bytes.size(); i += 2) {
    heights.samples.push_back(static_cast<uint16_t>(static_cast<uint8_t>(bytes[i]) << 8 |
                                                    static_cast<uint8_t>(bytes[i + 1])));
  }
  return heights;
}

}  // namespace

void KeepSurfaces(const Surfaces& surfaces, proto::RunDescription* description) {
  // The maps are sorted by uri, so that a world always gives the same bytes.
  for (const auto& [uri, mesh] : surfaces.meshes) {
    proto::WorldMesh* message = description->add_world_meshes();
    message->set_uri(uri);
    for (const Eigen::Vector3d& p : mesh.points) {
      for (const double x : p) message->add_points(static_cast<float>(x));
    }
    for (const std::array<int, 3>& triangle : mesh.triangles) {
      for (const int corner : triangle) message->add_corners(static_cast<uint32_t>(corner));
    }
  }
  for (const auto& [uri, heights] : surfaces.heights) {
    proto::WorldHeights* message = description->add_world_heights();
    message->set_uri(uri);
    message->set_columns(static_cast<uint32_t>(heights.columns));
    message->set_rows(static_cast<uint32_t>(heights.rows));
    std::string* bytes = message->mutable_samples();
    for (const uint16_t sample : heights.samples) {
      bytes->push_back(static_cast<char>(sample >> 8));
      bytes->push_back(static_cast<char>(sample & 0xff));
    }
  }
}

Result<std::vector<Obstacle>> ReadWorld(const proto::RunDescription& description) {
  // Surfaces without a text to name them are of no world.
  if (description.world().empty()) return std::vector<Obstacle>{};
  // All of it goes through the reader that took the world's file, with the surfaces at hand and
  // without a loader, so that the obstacles are the same to the bit.
  Surfaces surfaces;
  for (const proto::WorldMesh& message : description.world_meshes()) {
    Result<TriangleMesh> mesh = MeshIn(message);
    if (!mesh) return Fail(message.uri() + " " + mesh.error().message);
    surfaces.meshes[message.uri()] = *std::move(mesh);
  }
  for (const proto::WorldHeights& message : description.world_heights()) {
    surfaces.heights[message.uri()] = HeightsIn(message);
  }
  return ReadSdfText(description.world(), std::move(surfaces));
}

}  // namespace morphbus::world
