#pragma once
// Do the bodies of two congruent assemblies weigh alike and look alike?

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/congruence.h"

namespace morphbus::congruence {

/// What a body weighs and what it looks like, seen from its reference point along the robot frame's
/// axes.
struct BodyShape {
  double mass_kg = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();   ///< Mass times centre of mass (kg m).
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< About the reference point (kg m²).
  std::vector<std::vector<Eigen::Vector3d>> hulls;
};

class MassComparer {
 public:
  MassComparer(const Assembly& a, const Assembly& b);

  /// Compares each body with its image: mass, centre of mass and inertia (links as solids of even
  /// density, flat ones thickened to 0.05 of the module's extent), to 1e-6 of their sizes; and the
  /// hulls of the links as a set, to 1e-6 of the extent.
  [[nodiscard]] MassComparison Compare(const Mapping& mapping) const;

 private:
  const Assembly& a_;
  const Assembly& b_;
  std::vector<BodyShape> of_a_;  ///< By body.
  std::vector<BodyShape> of_b_;
};

}  // namespace morphbus::congruence
