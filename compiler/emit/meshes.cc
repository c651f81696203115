#include "compiler/emit/meshes.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <set>
#include <utility>

#include "compiler/model/link_mass.h"

namespace morphbus::emit {
namespace {

// Little-endian, as the format has all its numbers.
void Append(std::string* bytes, uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes->push_back(static_cast<char>(value >> shift));
}

void Append(std::string* bytes, const Eigen::Vector3d& v) {
  for (int k = 0; k < 3; ++k) Append(bytes, std::bit_cast<uint32_t>(static_cast<float>(v[k])));
}

/// Binary STL: a header of 80 bytes, a count, then 50 bytes a triangle, little-endian.
std::string Stl(const std::vector<Eigen::Vector3d>& points,
                const std::vector<std::array<int, 3>>& triangles) {
  // The format knows triangles only, with their normals before their corners; the last two bytes of
  // each are its attributes, which are 0 by custom.
  std::string bytes = "Morphbus hull, metres";
  bytes.resize(80, ' ');
  Append(&bytes, static_cast<uint32_t>(triangles.size()));
  for (const std::array<int, 3>& triangle : triangles) {
    const Eigen::Vector3d& a = points[triangle[0]];
    const Eigen::Vector3d& b = points[triangle[1]];
    const Eigen::Vector3d& c = points[triangle[2]];
    Append(&bytes, Eigen::Vector3d((b - a).cross(c - a).normalized()));
    for (const Eigen::Vector3d& corner : {a, b, c}) Append(&bytes, corner);
    bytes.append(2, '\0');
  }
  return bytes;
}

/// Relative to the main file.
std::string MeshPath(const std::string& name, const std::string& stem) {
  return stem + "_meshes/" + name + ".stl";
}

}  // namespace

std::vector<std::string> MeshNames(const model::Model& model, const TreeLink& link) {
  const model::ModuleType& type = model.module_types[link.type];
  const model::Link& source = type.links[link.link];
  if (source.hull.empty()) return {};
  const std::string name = type.name + "." + source.name;
  // One part is named like its link, several have numbers.
  if (source.part_ends.empty()) return {name};
  std::vector<std::string> names;
  for (size_t i = 1; i <= source.part_ends.size(); ++i) names.push_back(PartName(name, i));
  return names;
}

std::vector<LookMesh> LooksOf(const model::Model& model, int type_index, int link_index) {
  // Other programs take no mesh without a volume.
  constexpr double kPlate_m = 0.5e-3;
  const model::ModuleType& type = model.module_types[type_index];
  const model::Link& source = type.links[link_index];
  std::vector<LookMesh> looks;
  for (const model::VisualPart& part : source.visual) {
    LookMesh& look = looks.emplace_back();
    look.name = fmt::format("{}.{}.look{}", type.name, source.name, looks.size());
    look.color = part.color;
    look.points = part.points;
    look.triangles = part.triangles;
    if (!part.triangles.empty() && model::ComputeHull(part.points).dimension == 3) continue;
    const model::ConvexHull hull = model::ComputeHull(model::ThickenFlat(part.points, kPlate_m));
    look.points = hull.vertices;
    look.triangles = hull.triangles;
  }
  return looks;
}

std::string LookAddress(const LookMesh& look, const MeshPlace& place) {
  return place.prefix + MeshPath(look.name, place.stem);
}

std::map<std::string, LookMesh> LooksOf(const model::Model& model, const RobotTree& tree) {
  std::map<std::string, LookMesh> looks;
  std::set<std::pair<int, int>> done;
  for (const TreeLink& link : tree.links) {
    if (!done.emplace(link.type, link.link).second) continue;
    for (LookMesh& look : LooksOf(model, link.type, link.link))
      looks.try_emplace(look.name, std::move(look));
  }
  return looks;
}

std::string PartName(const std::string& name, size_t number) {
  return name + ".part" + std::to_string(number);
}

std::vector<std::string> MeshAddresses(const model::Model& model, const TreeLink& link,
                                       const MeshPlace& place) {
  std::vector<std::string> addresses = MeshNames(model, link);
  for (std::string& name : addresses) name = place.prefix + MeshPath(name, place.stem);
  return addresses;
}

CompanionFile ObstacleMesh(const world::Obstacle& obstacle, size_t number, const MeshPlace& place) {
  // No module type's name holds a hyphen.
  return {MeshPath("obstacle-" + std::to_string(number), place.stem),
          Stl(obstacle.mesh->points, obstacle.mesh->triangles)};
}

std::map<std::string, model::ConvexHull> MeshesOf(const model::Model& model,
                                                  const RobotTree& tree) {
  std::map<std::string, model::ConvexHull> meshes;
  for (const TreeLink& link : tree.links) {
    const std::vector<std::string> names = MeshNames(model, link);
    // Modules of one type share the meshes of their links.
    if (names.empty() || meshes.count(names.front()) != 0) continue;
    // Flat parts are thickened, since other programs take meshes for solids.
    const auto parts = model::SolidParts(model.module_types[link.type], link.link);
    for (size_t i = 0; i < parts.size(); ++i) meshes[names[i]] = model::ComputeHull(parts[i]);
  }
  return meshes;
}

std::vector<CompanionFile> MeshFiles(const model::Model& model, const RobotTree& tree,
                                     const MeshPlace& place) {
  std::vector<CompanionFile> files;
  for (const auto& [name, hull] : MeshesOf(model, tree)) {
    files.push_back({MeshPath(name, place.stem), Stl(hull.vertices, hull.triangles)});
  }
  for (const auto& [name, look] : LooksOf(model, tree)) {
    files.push_back({MeshPath(name, place.stem), Stl(look.points, look.triangles)});
  }
  return files;
}

}  // namespace morphbus::emit
