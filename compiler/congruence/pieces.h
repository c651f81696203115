#pragma once
// An assembly cut into pieces that know of each other only by the rotation of a body they share.
// Internal to compiler/congruence.

#include <vector>

#include "compiler/congruence/assembly.h"

namespace morphbus::congruence {

/// The pieces are the biconnected parts of the graph of bodies and joints: a joint that no loop
/// runs through, or loops with joints in common. Bodies that several pieces share and all pieces
/// form a tree. Once it is known where a body goes and how it is turned, the pieces at it are
/// matched each for itself.
///
/// That holds where a body's own joints and reference point fix how it is turned. A body that is
/// *loose* (its reference point on the one axis that all its joints have) is turned as a neighbour
/// is, to which limits or a slide tie it; parts that would tell each other so through it are one
/// piece.
struct Pieces {
  std::vector<std::vector<int>> joints;   ///< [piece]
  std::vector<int> of_joint;              ///< [joint]; -1: both ends in one body, in no piece.
  std::vector<std::vector<int>> at_body;  ///< [body]
  std::vector<std::vector<int>> bodies;   ///< [piece]
  std::vector<bool> loose;                ///< [body]
};

/// `length_tolerance` in m.
Pieces CutIntoPieces(const Assembly& assembly, double length_tolerance);

/// From `body`'s reference point to that of the body at the other end of a slide, square to it (m).
Eigen::Vector3d AcrossFrom(const Assembly& assembly, int body, int joint);

}  // namespace morphbus::congruence
