#pragma once
// Obstacles (compiler/world/obstacle.h) in the worlds of other programs, whose frames and names are
// not ours.

#include <functional>
#include <string>
#include <vector>

#include "compiler/world/obstacle.h"

namespace morphbus::emit {

/// The same obstacles in a world whose z is up (x north, y west) and whose floor lies at `floor`
/// (m), with names that are not `taken`, that no two share,
/// and that consist of ASCII letters, digits, dots and underscores.
std::vector<world::Obstacle> InZUp(const std::vector<world::Obstacle>& obstacles, double floor,
                                   const std::function<bool(const std::string&)>& taken);

/// The obstacles with such names alone, in our own world.
std::vector<world::Obstacle> FreelyNamed(std::vector<world::Obstacle> obstacles,
                                         const std::function<bool(const std::string&)>& taken);

}  // namespace morphbus::emit
