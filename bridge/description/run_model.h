#pragma once
// What ran: a run's description, read once. Model, robot, and the images that name what messages
// give as numbers.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bridge/description/described_run.h"
#include "bridge/module/module_images.h"
#include "compiler/base/result.h"
#include "compiler/dynarole/parameters.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/robot_model.h"
#include "compiler/world/obstacle.h"

namespace morphbus::bridge {

/// What does not change while a run goes on. Made by ReadRunModel; shared and never moved, for
/// `robot` points into `model`.
struct RunModel : DescribedRun {
  uint32_t tick_us = 0;  ///< Length of a control tick, microseconds of sim time.
  double speed = 0;      ///< Times real time at which it was started; 0: as fast as possible.
  model::Model model;
  /// The robot that runs; ids of modules in messages are indices into its modules. Null if the
  /// description does not hold it in a model that can be used.
  const model::Robot* robot = nullptr;
  /// The link of the robot whose pose its root module broadcasts.
  model::LinkRef root;
  /// Pose of each link in the robot frame R at the start values (m), by module and link.
  std::vector<std::vector<model::Pose>> X_RL_start;
  /// What stands in the world beside the robot; none if that cannot be read.
  std::vector<world::Obstacle> obstacles;
  /// The program's image, if `has_program`, and those of the module types' kinematics; those that
  /// are damaged are left out.
  ModuleImages images;
  bool has_program = false;
  /// The parameters of its program, with the values that the run began with.
  std::vector<dynarole::ProgramParameter> parameters;
  /// Why there is no robot, and why an image was left out; empty if all is there.
  std::string problem, images_problem;

  /// The type of a module of the robot.
  [[nodiscard]] const model::ModuleType& TypeOf(int module) const {
    return model.TypeOf(*robot, module);
  }
};

/// The link by which a module stands for the root: the robot's root link if the module is the
/// robot's root module, else its first link.
model::LinkRef RootLinkOf(const model::Robot& robot, int module);

/// Reads all of a serialized morphbus.proto.RunDescription. Fails if the bytes are none; what else
/// of it is unusable is left out.
Result<std::shared_ptr<const RunModel>> ReadRunModel(const std::string& description);
/// The same for who needs the robot: fails without one, with RunModel::problem.
Result<std::shared_ptr<const RunModel>> ReadRunWithRobot(const std::string& description);

}  // namespace morphbus::bridge
