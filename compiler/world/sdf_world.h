#pragma once
// Worlds in SDFormat (sdformat.org): the static boxes, cylinders, spheres and planes of a <world>.

#include <optional>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "compiler/world/obstacle.h"

namespace morphbus::world {

/// The obstacles of the <world> in file `file` of `sources`, in the order in which they stand
/// there; nothing after an error. SDFormat's z up becomes W's y, its x stays, its y is -z of W. A
/// plane that faces up at height 0 is the ground itself and no obstacle; `ground_friction`, if not
/// null, is set to its friction if it has one. What would change the world and cannot be had is an
/// error: models that are not static, joints, includes, meshes and height maps, and poses relative
/// to frames other than the parent. What is only seen, lights and plugins are left out. Linear in
/// the text.
std::optional<std::vector<Obstacle>> ReadSdfWorld(const source::SourceSet& sources, int file,
                                                  std::optional<double>* ground_friction,
                                                  source::Diagnostics* diagnostics);

/// The same of a text that was read before, as a run's description holds it; the error is what is
/// wrong first, with its line.
Result<std::vector<Obstacle>> ReadSdfText(const std::string& text);

}  // namespace morphbus::world
