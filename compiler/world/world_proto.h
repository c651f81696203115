#pragma once
// A world in a run's description: its text, and what the files held that it names.

#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/run_description.pb.h"
#include "compiler/world/obstacle.h"

namespace morphbus::world {

/// Puts the surfaces beside the world's text, compactly, so that a reader of the description
/// needs no file.
void KeepSurfaces(const Surfaces& surfaces, proto::RunDescription* description);

/// The obstacles of the description's world; none if it has no world. The description may be
/// damaged or hostile; the error says what is wrong first.
Result<std::vector<Obstacle>> ReadWorld(const proto::RunDescription& description);

}  // namespace morphbus::world
