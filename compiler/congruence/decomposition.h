#pragma once
// Cuts the graph of bodies and joints into pieces that can be matched independently of each other.
// Internal to compiler/congruence.

#include <vector>

#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// The pieces of one screw graph.
///
/// A piece is a biconnected part of the graph: a joint that no loop runs through, or loops that
/// have joints in common (Hopcroft, Tarjan 1973). Two pieces share at most one body, and pieces
/// and shared bodies form a tree. Once it is known where a shared body goes and how it is turned,
/// nothing that happens in one of its pieces can affect another, so each is matched by itself: a
/// robot of 48 wheels that can each be placed in 2 ways takes 96 attempts and not 2^48.
///
/// The one exception are *coaxial* bodies: all joints of such a body turn about (or slide along)
/// one axis, and its reference point lies on it. Its own geometry leaves the turn about that axis
/// open, and only the limits of a joint, or a slide, tie the turn to that of a neighbour. Parts
/// that can tell each other something through a coaxial body in this way are joined to one piece.
///
/// A joint with both ends in one body cannot affect any other and is in no piece.
struct Decomposition {
  std::vector<std::vector<int>> joints;   ///< By piece: the joints in it.
  std::vector<std::vector<int>> bodies;   ///< By piece: the bodies that its joints touch, sorted.
  std::vector<int> of_joint;              ///< By joint: its piece; -1 for one within a body.
  std::vector<std::vector<int>> at_body;  ///< By body: the pieces that touch it.
  std::vector<bool> coaxial;              ///< By body, as above.
};

/// Cuts `graph` into pieces. Two lengths are equal within `length_tolerance` (m).
Decomposition Decompose(const ScrewGraph& graph, double length_tolerance);

/// The whole graph as a single piece, which holds the joints within a body too: for a search that
/// has to visit every mapping, or to say where it failed.
Decomposition AsOnePiece(const ScrewGraph& graph, double length_tolerance);

/// The vector from `body`'s reference point to that of the body at the other end of the slide
/// `joint`, without its part along the slide (m, robot frame).
Eigen::Vector3d OffsetAcrossSlide(const ScrewGraph& graph, int body, int joint);

}  // namespace morphbus::congruence
