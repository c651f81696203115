#pragma once
// Are two assemblies kinematically congruent? (docs/congruence.md)
//
// They are if there are one proper rigid motion G, a bijection of bodies and one of joints, and for
// each joint a sign and an offset that map its limits onto the other's, such that for all joint
// values each body's reference point (mean of its links' origins) and its rotation, up to a
// constant, coincide under G. Start values play no part in it, but for joints that loops lock in
// both: theirs, the only values there are, must be mapped onto each other.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

/// One joint's counterpart: q_to = sign * q + offset.
struct JointImage {
  int to = 0;  ///< Index into Congruence::joints_b.
  double sign = 1.0;
  double offset = 0.0;  ///< rad or m; 0 where it is free.
};

/// One congruence. Bodies by number as in BodiesOf (model/kinematic_graph.h).
struct Mapping {
  std::vector<int> body_to;        ///< [body of a] -> body of b.
  std::vector<JointImage> joints;  ///< By index into Congruence::joints_a.
  /// For each body: with body frames parallel to the robot frames at the start values, origins in
  /// the reference points, this takes coordinates in a's body to coordinates in its image.
  std::vector<Eigen::Matrix3d> R;
  /// Where nothing but coaxial joints touches a body and its reference point lies on their axis, R
  /// is one of many: a turn about `free_axis` may follow it. Bodies with one `free_group` turn
  /// together. Zero and -1 where R is unique.
  std::vector<Eigen::Vector3d> free_axis;
  std::vector<int> free_group;
  std::vector<int> module_to;  ///< [module of a]; -1: its joints go to several modules.
  /// G takes a's robot frame to b's, and the link that carries it to the body of b's.
  bool keeps_frame = false;
};

struct JointRef {
  int module = 0;
  int joint = 0;
  bool slide = false;   ///< Prismatic.
  bool locked = false;  ///< By loops; false where that was not computed.
};

/// How the masses and hulls of two congruent assemblies compare.
struct MassComparison {
  bool masses_equal = true;     ///< Mass, centre of mass and inertia of each body.
  bool hulls_equal = true;      ///< Hulls of the links of each body, as a set.
  std::string mass_difference;  ///< The first one, for people; empty if there is none.
  std::string hull_difference;
};

/// At most this many mappings are kept.
inline constexpr size_t kMaxKept = 1000;

/// Pairs of joints that are tried, each well under a microsecond to a few.
inline constexpr int64_t kMaxSteps = 5'000'000;

struct Congruence {
  /// False where the search was given up as too much (many bodies that nothing tells apart).
  bool decided = true;
  int64_t count = 0;           ///< Mappings.
  bool count_complete = true;  ///< False: there are at least `count`, which may be all.
  /// The one that keeps the robot frame first, if there is one, then by the names of the modules
  /// that a's modules, in declared order, go to. All of them, if they are few in a small robot;
  /// else the first of them, and perhaps some others.
  std::vector<Mapping> mappings;
  std::vector<JointRef> joints_a;  ///< All joints but fixed ones, module then joint order.
  std::vector<JointRef> joints_b;
  /// False where a part of a or b has so many joints in loops that it is not known which are
  /// locked; their values at the start were not compared.
  bool locked_computed = true;
  MassComparison masses;    ///< Under the first mapping.
  size_t masses_alike = 0;  ///< Of `mappings`, those under which masses are equal ...
  size_t hulls_alike = 0;   ///< ... and hulls.
  /// If not congruent: the first body or joint that cannot match, for people, with where in the
  /// robot frame of b one would have to be.
  std::string reason;

  [[nodiscard]] bool congruent() const { return count > 0; }
};

/// Compares robot `a` with `b`, each of a model of its own or both of one. Both hang together, as
/// robots from the compiler do (checked). Takes time in proportion to size, and to the pairs of
/// seed bodies that look alike and are not; gives up deciding (see `decided`), and counting, after
/// trying `max_steps` pairs of joints, which takes some seconds.
Congruence Compare(const model::Model& model_a, const model::Robot& a, const model::Model& model_b,
                   const model::Robot& b, int64_t max_steps = kMaxSteps);

/// Only asks for a mapping that keeps the robot frame: how masses compare under it, or nothing
/// if there is none (or it was given up, as above).
std::optional<MassComparison> CompareInFrame(const model::Model& model_a, const model::Robot& a,
                                             const model::Model& model_b, const model::Robot& b);

}  // namespace morphbus::congruence
