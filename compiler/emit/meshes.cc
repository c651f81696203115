#include "compiler/emit/meshes.h"

#include <bit>
#include <cstdint>
#include <map>

#include "compiler/model/convex_hull.h"

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
std::string Stl(const std::vector<Eigen::Vector3d>& points) {
  // The format knows triangles only, with their normals before their corners; the last two bytes of
  // each are its attributes, which nobody uses.
  const model::ConvexHull hull = model::ComputeHull(points);
  std::string bytes = "Morphbus hull, metres";
  bytes.resize(80, ' ');
  Append(&bytes, static_cast<uint32_t>(hull.triangles.size()));
  for (const std::array<int, 3>& triangle : hull.triangles) {
    const Eigen::Vector3d& a = hull.vertices[triangle[0]];
    const Eigen::Vector3d& b = hull.vertices[triangle[1]];
    const Eigen::Vector3d& c = hull.vertices[triangle[2]];
    Append(&bytes, Eigen::Vector3d((b - a).cross(c - a).normalized()));
    for (const Eigen::Vector3d& corner : {a, b, c}) Append(&bytes, corner);
    bytes.append(2, '\0');
  }
  return bytes;
}

/// Relative to the main file; empty for a link without hull.
std::string MeshPath(const model::Model& model, const TreeLink& link, const std::string& stem) {
  const std::string name = MeshName(model, link);
  return name.empty() ? "" : stem + "_meshes/" + name + ".stl";
}

}  // namespace

std::string MeshName(const model::Model& model, const TreeLink& link) {
  const model::ModuleType& type = model.module_types[link.type];
  const model::Link& source = type.links[link.link];
  return source.hull.empty() ? "" : type.name + "." + source.name;
}

std::string MeshAddress(const model::Model& model, const TreeLink& link, const MeshPlace& place) {
  const std::string path = MeshPath(model, link, place.stem);
  return path.empty() ? "" : place.prefix + path;
}

std::vector<CompanionFile> MeshFiles(const model::Model& model, const RobotTree& tree,
                                     const MeshPlace& place) {
  // One file a kind of link, however many modules there are.
  std::map<std::string, std::string> files;
  for (const TreeLink& link : tree.links) {
    const std::string path = MeshPath(model, link, place.stem);
    if (path.empty() || files.count(path) != 0) continue;
    const model::ModuleType& type = model.module_types[link.type];
    files[path] = Stl(model::SolidHull(type, link.link));
  }
  std::vector<CompanionFile> meshes;
  for (auto& [path, bytes] : files) meshes.push_back({path, std::move(bytes)});
  return meshes;
}

}  // namespace morphbus::emit
