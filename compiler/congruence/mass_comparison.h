#pragma once
// Do the bodies of two congruent assemblies weigh alike and look alike? This is no part of
// congruence, which is about motion alone, but decides whether the two move alike under gravity.

#include "compiler/congruence/congruence.h"
#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// What a body weighs and what it looks like, seen from its reference point along the robot frame's
/// axes.
struct BodyShape {
  /// The mass of all its links together.
  double mass_kg = 0.0;
  /// Mass times centre of mass (kg m).
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  /// The rotational inertia about the reference point (kg m²).
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  /// The corners of the convex hull of each link that has one (m).
  std::vector<std::vector<Eigen::Vector3d>> hulls;
};

/// Compares the bodies of two assemblies under one mapping or another. Their shapes are worked out
/// once.
class MassComparer {
 public:
  /// `a` and `b` must outlive it.
  MassComparer(const ScrewGraph& a, const ScrewGraph& b);

  /// Compares each body with its image: mass, centre of mass and inertia (links as solids of even
  /// density, flat ones thickened to 0.05 of the module's extent), to 1e-6 of their sizes; and the
  /// hulls of the links as a set, to 1e-6 of the extent.
  [[nodiscard]] MassComparison Compare(const Mapping& mapping) const;

 private:
  /// How the masses of a body and its image differ, R being the rotation that takes the one to the
  /// other; empty if they are alike.
  [[nodiscard]] std::string MassDifference(int body, int image, const Eigen::Matrix3d& R) const;
  [[nodiscard]] std::string PairName(int body, int image) const;

  const ScrewGraph& a_;
  const ScrewGraph& b_;
  std::vector<BodyShape> of_a_;  ///< By body.
  std::vector<BodyShape> of_b_;
  double extent_m_;  ///< The larger of both (m).
};

}  // namespace morphbus::congruence
