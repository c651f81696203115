#pragma once
// Links that do not all weigh the same: what one module's link weighs, of those that are alike by
// their module type.

#include <cstdint>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// By how many times a link of a robot weighs what its module type says, [module][link].
using MassFactors = std::vector<std::vector<double>>;

/// The factors of a robot: 1 plus a draw of Link::mass_spread, which is cut off at three standard
/// deviations. They follow from `seed` and the indices of module and link alone. Empty, which
/// stands for 1 everywhere, if no link of the robot has a spread.
MassFactors DrawMassFactors(const Model& model, const Robot& robot, uint64_t seed);

/// The factor of one link of the robot by DrawMassFactors.
inline double FactorOf(const MassFactors& factors, int module, int link) {
  return factors.empty() ? 1.0 : factors[module][link];
}

}  // namespace morphbus::model
