#pragma once
// Other assemblies congruent to a given one: modules turned round, other connectors, other
// orientations of connections.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

struct VariantOptions {
  size_t max = 10;
  /// Absent: the first ones of an enumeration, the latest modules changing fastest. Present: drawn
  /// at random, the same for the same seed.
  std::optional<uint64_t> seed;
};

/// Robots of the same modules, named NAME_variant_1 and so on, no two with the same connections and
/// none with those of `robot`; each congruent to it in a way that keeps the robot frame and takes
/// each module to itself (every one is put to Compare). Start values are carried over.
///
/// A module can stand in for itself as its type is congruent to itself: an M-TRAN turned by half a
/// turn about each of its axes. Those ways are combined so that every connection of the robot can
/// be made by some option of the model's connections. May find fewer than there are in very large
/// or very constrained robots: the search is bounded.
std::vector<model::Robot> Variants(const model::Model& model, const model::Robot& robot,
                                   const VariantOptions& options);

}  // namespace morphbus::congruence
