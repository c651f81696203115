#pragma once
// Poses in which a robot that was put together by hand is compared with what it should be.

#include <string>
#include <vector>

#include "compiler/model/assembly_plan.h"

namespace morphbus::solver {

/// A way of mating that a pose does not tell from the right one.
struct AlikeWay {
  /// Index into AssemblyPlan::modules; the first mating of that module is meant.
  int added = 0;
  /// The number of the other way.
  int number = 0;
};

/// A pose to compare, with what it shows.
struct CheckPose {
  /// The values at the start, all at 0, or joints bent so that modules put on the wrong way round
  /// show.
  enum class Kind { kStart, kZero, kBent };
  Kind kind = Kind::kStart;
  model::JointValues q;
  /// X_RL[module][link] there (m).
  std::vector<std::vector<model::Pose>> X_RL;
  /// Other ways in which the connectors of this robot mate, of those dockings that are in no loop.
  int num_other_ways = 0;
  /// Those of them in which every link's middle would lie nearer than `least_shift_m` to where it
  /// belongs.
  std::vector<AlikeWay> alike;
  /// 5 % of the extent of the smallest module that is put on (m).
  double least_shift_m = 0.0;
};

/// The poses to check a robot in, and why there are not more.
struct CheckPoses {
  /// The start pose, then that with all joints at 0 if it is another one, then the bent one.
  std::vector<CheckPose> poses;
  /// Sentences: which of them are left out, and why.
  std::vector<std::string> left_out;
  /// Other ways of the dockings that are in loops: with one of them the loop does not close.
  int num_ways_in_loops = 0;
  /// The largest gap with which the loops close at the start values (m, rad), and their number.
  double closure_m = 0.0;
  double closure_rad = 0.0;
  int num_loops = 0;
};

/// The poses for `robot`. In the bent pose joints outside of loops are turned by up to 30 degrees
/// or slid by a quarter of their range, one this way and the next that way, and less where modules
/// that are not neighbours would then lie in each other.
CheckPoses FindCheckPoses(const model::Model& model, const model::Robot& robot,
                          const model::AssemblyPlan& plan);

}  // namespace morphbus::solver
