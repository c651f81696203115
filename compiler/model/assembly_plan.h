#pragma once
// In which order a robot is put together by hand: one module after another, each of which mates
// with what stands already, and how each is put on.

#include <optional>
#include <utility>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/mating_turn.h"
#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// A docking as it is made: the module that is added, its own, comes to one that stands. Modules
/// are indices into Robot::modules, connectors into those of their types.
struct Mating {
  /// The index into Robot::dockings.
  int docking = 0;
  int own_connector = 0;
  int standing = 0;
  int standing_connector = 0;
  /// The numbers of all ways in which these two connectors mate, ascending: the first is their
  /// default. `number` is the one of the robot.
  std::vector<int> ways;
  int number = 0;
  /// The turn from the default to `number`: positive is anticlockwise to whoever looks at the face
  /// of the standing connector. Nothing if they differ by something else than a turn of that face.
  std::optional<MatingTurn> turn;
  /// Sub-points that meet, by index: one of the own connector, one of the standing one.
  std::vector<std::pair<int, int>> points;
  /// Connectors that face the same way when the two are mated at the robot's start values, by
  /// index: one of the module that is added, one of the standing module. Those that face along the
  /// line on which the two modules meet are left out, for they do so in all ways.
  std::vector<std::pair<int, int>> same_way;
  /// The modules of the loop that this docking closes, from the added module to the standing one;
  /// empty if it closes none.
  std::vector<int> loop;
};

/// A module as it is put on.
struct AddedModule {
  int module = 0;
  /// None for the first module, else one or more. By the first the module comes to stand; the
  /// others close loops.
  std::vector<Mating> matings;
  /// The unit direction in the robot frame from which the module comes; zero for the first.
  Eigen::Vector3d from_R = Eigen::Vector3d::Zero();
  /// Whether it slides along the face of one of the standing connectors, because others are in the
  /// way.
  bool sideways = false;
};

/// How a robot is put together. PlanAssembly makes it.
struct AssemblyPlan {
  /// Every module of the robot once; breadth first from that of the robot frame, so that a robot
  /// grows from its middle outward. Every docking is in one of them.
  std::vector<AddedModule> modules;
  /// X_RL[module][link] at the start values, at which the robot is put together (m).
  std::vector<std::vector<Pose>> X_RL;
  /// faces_R[module][connector]: the unit direction in the robot frame in which a connector faces
  /// at the start values; nothing where its type does not say (Connector::normals, "").
  std::vector<std::vector<std::optional<Eigen::Vector3d>>> faces_R;
};

/// The plan for `robot`, one of `model`'s, whose modules must hang together. Which way connectors
/// face is taken from their normals: a model that has them all (those of
/// m3l::CompileOutput::solved) has more to say.
AssemblyPlan PlanAssembly(const Model& model, const Robot& robot);

}  // namespace morphbus::model
