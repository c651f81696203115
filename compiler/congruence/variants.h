#pragma once
// Other assemblies congruent to a given one: modules turned round, other connectors, other
// orientations of connections.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "compiler/congruence/congruence.h"
#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

struct VariantOptions {
  size_t max = 10;
  /// Absent: the first ones of an enumeration: ways of the latest dockings change fastest, then the
  /// latest modules. Present: drawn at random, the same for the same seed.
  std::optional<uint64_t> seed;
};

struct Variant {
  model::Robot robot;
  MassComparison masses;  ///< With the robot it is a variant of.
};

/// Robots of the same modules, named NAME_variant_1 and so on (numbers whose names the model's
/// robots have are passed over), no two with the same connections and none with those of `robot`;
/// each congruent to it in a way that keeps the robot frame and takes each module to itself (every
/// one is put to Compare). Start values are carried over.
///
/// A module can stand in for itself as its type is congruent to itself: an M-TRAN turned by half a
/// turn about each of its axes. Those ways are combined so that every connection of the robot can
/// be made by some option of the model's connections. May find fewer than there are in very large
/// or very constrained robots: the search is bounded.
std::vector<Variant> Variants(const model::Model& model, const model::Robot& robot,
                              const VariantOptions& options);

}  // namespace morphbus::congruence
