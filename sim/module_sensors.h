#pragma once
// The sensors that M3L declares, in the simulated world: rays, contacts and gravity.

#include <cstdint>
#include <morphbus/module_sensors_t.hpp>
#include <vector>

#include "compiler/model/robot_model.h"
#include "sim/world.h"

namespace morphbus::sim {

/// Adds to what `out` has already what the sensors of module `module` measure now, in the order of
/// their declaration: a distance in metres, a contact as 0 or 1, a tilt as the unit vector that
/// points straight up in the frame of its link. Noise follows from `seed`, `tick`, module and
/// sensor alone.
void SenseModule(const World& world, const model::Model& model, const model::Robot& robot,
                 const LinkPoseTable& X_WL, int module, uint64_t seed, int64_t tick,
                 morphbus::module_sensors_t* out);

}  // namespace morphbus::sim
