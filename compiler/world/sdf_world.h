#pragma once
// Worlds in SDFormat (sdformat.org): the static boxes, cylinders, spheres, planes, meshes and
// height maps of a <world>.

#include <optional>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/world/obstacle.h"

namespace morphbus::world {

/// What a world's file says.
struct SdfWorld {
  std::vector<Obstacle> obstacles;  ///< In the order in which they stand there.
  /// Friction of a plane that faces up at height 0, which is the ground and no obstacle.
  std::optional<double> ground_friction;
  /// What the files hold that its meshes and height maps name.
  Surfaces surfaces;
};

/// The <world> in file `file` of `sources`; nothing after an error. SDFormat's z up becomes W's y,
/// its x stays, its y is -z of W. `load` is asked once for each file that a mesh or height map
/// names; without it those are errors. What would change the world and cannot be had is an error:
/// models that are not static, joints, includes, parts of meshes, and poses relative to frames
/// other than the parent. What is only seen, lights and plugins are left out. Linear in the text
/// and the triangles.
std::optional<SdfWorld> ReadSdfWorld(const source::SourceSet& sources, int file,
                                     const SurfaceLoader& load, source::Diagnostics* diagnostics);

/// The obstacles of a text that was read before, with what its files held, as a run's description
/// has them; the error is what is wrong first, with its line.
Result<std::vector<Obstacle>> ReadSdfText(const std::string& text, Surfaces surfaces = {});

}  // namespace morphbus::world
