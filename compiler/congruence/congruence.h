#pragma once
// Are two assemblies kinematically congruent? (docs/congruence.md)
//
// They are if there are one proper rigid motion G, a bijection of bodies and one of joints, and for
// each joint a sign and an offset that map its limits onto the other's, such that for all joint
// values each body's reference point (mean of its links' origins) and its rotation, up to a
// constant, coincide under G. Start values play no part in it, but for joints that loops lock in
// both: theirs, the only values there are, must be mapped onto each other.
//
// How it is decided: ScrewGraph (bodies and screw axes) -> Classes (which can correspond at all)
// -> Plan (an order of joints, and what can be matched independently) -> Search, which grows a
// Correspondence -> FirstMapping, CountSymmetries, ForEachMapping (mappings.h); where there is no
// mapping, DeadEnds (explain.h) says which joint has no counterpart.

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

/// One way in which assembly a is congruent to b. Bodies have the numbers that model::BodiesOf
/// (model/kinematic_graph.h) gives them, and frames parallel to the robot frame at the start values
/// with origins in their reference points.
struct Mapping {
  std::vector<int> body_to;        ///< By body of a: the body of b.
  std::vector<JointImage> joints;  ///< By index into Congruence::joints_a.
  /// By body of a: takes coordinates in it to coordinates in its image.
  std::vector<Eigen::Matrix3d> R;
  /// By body of a. Where nothing but coaxial joints touches a body and its reference point lies on
  /// their axis, R is one of many: any turn about `free_axis` (unit, in the image) may follow it.
  /// Bodies with the same `free_group` turn by the same angle. Zero and -1 where R is unique.
  std::vector<Eigen::Vector3d> free_axis;
  std::vector<int> free_group;
  std::vector<int> module_to;  ///< By module of a; -1 where its joints go to several modules.
  /// Does G take a's robot frame to b's, and the link that carries it to the body of b's?
  bool keeps_frame = false;
};

/// A joint that is compared.
struct JointRef {
  int module = 0;       ///< Index into Robot::modules.
  int joint = 0;        ///< Index into ModuleType::joints.
  bool slide = false;   ///< Is it prismatic? Else it turns.
  bool locked = false;  ///< Do loops lock it? False where that was not computed.
};

/// How the masses and hulls of two congruent assemblies compare.
struct MassComparison {
  bool masses_equal = true;     ///< Mass, centre of mass and inertia of each body.
  bool hulls_equal = true;      ///< Hulls of the links of each body, as a set.
  std::string mass_difference;  ///< The first difference, for people; empty if there is none.
  std::string hull_difference;  ///< Likewise.
};

/// Mappings are counted exactly, and kept, up to this many.
inline constexpr int64_t kMaxCounted = 1000;

/// So many pairs of joints are tried at most, each in a microsecond or a few.
inline constexpr int64_t kMaxSteps = 5'000'000;

/// The answer.
struct Congruence {
  /// False where the search was given up as too much (many bodies that nothing tells apart).
  bool decided = true;
  int64_t count = 0;  ///< The number of mappings, at most kMaxCounted.
  /// False if there are more than kMaxCounted or, where `count` is below that, perhaps more than
  /// it, since counting was given up as too much.
  bool count_complete = true;
  /// The mapping that keeps the robot frame first, if there is one, then by the names of the
  /// modules that a's modules, in declared order, go to. These are all mappings, if they are few in
  /// a small robot; else the first one, and perhaps some others.
  std::vector<Mapping> mappings;
  std::vector<JointRef> joints_a;  ///< All joints but fixed ones, in order of module, then joint.
  std::vector<JointRef> joints_b;  ///< Likewise.
  /// False where a part of a or b has so many joints in loops that it is not known which are
  /// locked; their values at the start were not compared.
  bool locked_computed = true;
  MassComparison masses;    ///< Under the first mapping.
  size_t masses_alike = 0;  ///< The number of `mappings` under which masses are equal.
  size_t hulls_alike = 0;   ///< The number of `mappings` under which hulls are equal.
  /// If not congruent: the first body or joint that cannot match, for people, with where in the
  /// robot frame of b one would have to be.
  std::string reason;

  [[nodiscard]] bool congruent() const { return count > 0; }
};

/// A number that congruent robots share and others hardly ever: for finding a robot among many
/// (HashOfClasses in classes.h says what enters it).
uint64_t CongruenceHash(const model::Model& model, const model::Robot& robot);

/// Compares robot `a` with `b`, each of a model of its own or both of one. Each must be connected,
/// as robots from the compiler are (checked). Takes time in proportion to size, and to the pairs of
/// seed bodies that look alike and are not; gives up deciding (see `decided`), and counting, after
/// trying `max_steps` pairs of joints, which takes some seconds.
Congruence Compare(const model::Model& model_a, const model::Robot& a, const model::Model& model_b,
                   const model::Robot& b, int64_t max_steps = kMaxSteps);

/// Only asks for a mapping that keeps the robot frame: how masses compare under it, or nothing
/// if there is none (or it was given up, as above).
std::optional<MassComparison> CompareInFrame(const model::Model& model_a, const model::Robot& a,
                                             const model::Model& model_b, const model::Robot& b);

}  // namespace morphbus::congruence
