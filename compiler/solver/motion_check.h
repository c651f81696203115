#pragma once
// Which links of neighbouring modules meet within the ranges of their joints: for `check --motion`.
//
// Neighbours are two modules that a docking holds together. How their links lie to each other
// depends only on the joints of these two modules, so they are looked at pair by pair and never as
// a whole robot, and dockings of one kind are looked at once. A link that lies rigidly with another
// (they are mated, or held together by fixed joints or another docking) is not compared with it;
// touching is no meeting. The method is sampling: a meeting that is found is one, but what is not
// found may still be there between two postures.

#include <cstdint>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::solver {

/// What a check of motion may cost: pairs of edges, and of faces and corners, that are looked at. A
/// bound on hostile input, some ten seconds of work.
inline constexpr double kMaxMotionWork = 2e9;

/// How much is tried.
struct MotionOptions {
  /// Postures of each docking, 1 or more. The first is that of the start values, the others follow
  /// from `seed` (motion_postures.h). Joints that loops lock keep their start values.
  int postures = 1000;
  /// The random postures follow from it. More postures with the same seed are those of before, and
  /// more.
  uint64_t seed = 1;
  /// When this is used up, no further posture is begun.
  double max_work = kMaxMotionWork;
};

/// A joint of one of the two modules that a docking joins.
struct PairJoint {
  /// True for one of module_a's joints, false for one of module_b's.
  bool of_a = true;
  /// The index of the joint in its module's type.
  int joint = 0;
};

/// A posture in which two links meet.
struct MeetingPosture {
  /// The length of the least translation that separates the two links (m).
  double depth_m = 0.0;
  /// The value of each of LinkMeeting::joints (rad or m).
  std::vector<double> values;
};

/// Two links of neighbours that meet.
struct LinkMeeting {
  /// Indices of the links in the types of module_a and module_b.
  int link_a = 0;
  int link_b = 0;
  /// The joints between the two, which alone decide how they lie: from link_a to the docking, then
  /// from there to link_b.
  std::vector<PairJoint> joints;
  /// In how many of the postures they meet.
  int num_postures = 0;
  /// The first posture in which they do, and the one in which they lie deepest in each other.
  MeetingPosture first;
  MeetingPosture deepest;
};

/// Dockings of one kind, with what meets across each of them.
struct MeetingsOfDockings {
  /// Indices into Robot::dockings, ascending.
  std::vector<int> dockings;
  /// In the order of link_a, then of link_b.
  std::vector<LinkMeeting> links;
};

/// What a check of motion has found. CheckMotion makes it for printing.
struct MotionReport {
  /// How many postures of each docking were tried: less than asked for if the work was too much, 0
  /// if it was so for a single one.
  int postures = 0;
  /// How many pairs of links were compared, over all dockings.
  int64_t num_link_pairs = 0;
  /// How many kinds of dockings there are: those of one kind differ in names and start values
  /// alone.
  int num_kinds = 0;
  /// Independent loops of the robot. Joints that they do not lock are sampled as if they were free,
  /// so a posture may be one that a loop does not allow.
  int num_loops = 0;
  /// How many joints of the robot the loops lock: as far as that is computed (KinematicGraph).
  int num_locked = 0;
  /// What the check has cost, in units of MotionOptions::max_work.
  double work = 0.0;
  /// What meets, in the order of the first docking.
  std::vector<MeetingsOfDockings> meetings;
};

/// Looks for links of neighbouring modules of `robot`, one of `model`'s, that lie in each other by
/// more than MatingTolerance: the tolerance of connections and of overlaps at the start values.
MotionReport CheckMotion(const model::Model& model, const model::Robot& robot,
                         const MotionOptions& options);

}  // namespace morphbus::solver
