#pragma once
// Where a single body may go: with these a search begins. Internal to compiler/congruence.

#include <Eigen/Core>
#include <vector>

#include "compiler/congruence/correspondence.h"
#include "compiler/congruence/decomposition.h"

namespace morphbus::congruence {

/// Where a body of a may go, and how it is turned there.
struct Place {
  int image = 0;      ///< A body of b.
  Eigen::Matrix3d R;  ///< Takes coordinates in the body to coordinates in the image.
  /// Zero, but for a coaxial body the axis (in the image) about which any turn may follow R.
  Eigen::Vector3d free_axis = Eigen::Vector3d::Zero();
};

/// A body of a that has the fewest bodies of its class, so the fewest places; one that is not
/// coaxial if there is any. -1 if no body of b is in the class of any of a.
int SeedBody(const Classes& classes, const Decomposition& a);

/// The places of `body` on `image` that bring those of its joints that fix its rotation (one whose
/// axis misses the reference point, else two that are not parallel) onto joints of the image. No
/// two of them are the same within the tolerance.
std::vector<Place> PlacesOn(const Correspondence& matched, const Decomposition& a, int body,
                            int image);

/// The places of `body` on all bodies of b in its class.
std::vector<Place> PlacesOf(const Correspondence& matched, const Decomposition& a, int body);

/// The place of `body` of a in a itself, unmoved.
Place HomeOf(const Correspondence& matched, const Decomposition& a, int body);

/// Are they one place within `tolerance` (rad)? For free axes only these have to agree.
bool SamePlace(const Place& x, const Place& y, double tolerance);

}  // namespace morphbus::congruence
