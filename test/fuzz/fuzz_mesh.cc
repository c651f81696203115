// Any bytes as an STL file: read or refused, never a crash.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "compiler/m3l/read_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  // The bytes as each of the formats that a mesh may have.
  for (const char* name : {"fuzz.stl", "fuzz.obj", "fuzz.gltf", "fuzz.glb"}) {
    const auto mesh = morphbus::m3l::ParseAnyMesh(name, bytes);
    if (!mesh) continue;
    for (const std::array<int, 3>& triangle : mesh->triangles) {
      for (const int corner : triangle) {
        if (corner < 0 || corner >= static_cast<int>(mesh->points.size())) std::abort();
      }
    }
  }
  const auto hull = morphbus::m3l::MeshHull("fuzz.stl", bytes);
  if (!hull) return 0;
  for (const Eigen::Vector3d& p : *hull) {
    if (!p.allFinite()) std::abort();
  }
  return 0;
}
