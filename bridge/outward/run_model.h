#pragma once
// A run's description, read once: the model, the robot, and the images that name what messages give
// as numbers.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bridge/module/module_instance.h"
#include "compiler/base/result.h"
#include "compiler/base/role_colors.h"
#include "compiler/model/robot_model.h"
#include "compiler/world/obstacle.h"

namespace morphbus {
class Description;
}

namespace morphbus::bridge {

/// What does not change while a run goes on. Made by ReadRunModel; shared and never moved, for
/// `robot` points into `model`.
struct RunModel {
  std::string run;            ///< The run's name, with which its channels begin.
  uint64_t model_hash = 0;    ///< That every message's header names.
  uint64_t program_hash = 0;  ///< Of the program that the run began with.
  uint32_t tick_us = 0;       ///< Length of a control tick, microseconds of sim time.
  double speed = 0;           ///< Times real time at which it was started; 0: as fast as possible.
  bool root_sensor = false;   ///< Whether the root measures its pose.
  std::string program_file;   ///< Path as given to `morphbus run`.
  model::Model model;
  /// The robot that runs; ids of modules in messages are indices into its modules.
  const model::Robot* robot = nullptr;
  /// The module that broadcasts its pose, and the link of it whose pose that is.
  int root_module = 0, root_link = 0;
  /// Pose of each link in the robot frame R at the start values (m), by module and link.
  std::vector<std::vector<model::Pose>> X_RL_start;
  /// What stands in the world beside the robot.
  std::vector<world::Obstacle> obstacles;
  /// The program's image, if `has_program`, and those of the module types' kinematics.
  ModuleImages images;
  bool has_program = false;
  /// Of the program's roles.
  RoleColors colors;
  /// What viewers are told of the run (morphbus.Description), but for the program's text.
  std::shared_ptr<const morphbus::Description> description;

  /// The type of a module of the robot.
  [[nodiscard]] const model::ModuleType& TypeOf(int module) const {
    return model.TypeOf(*robot, module);
  }
};

/// Reads a serialized morphbus.proto.RunDescription. Fails if the bytes are none, if the model in
/// it is unusable or not the one that its hash names, or if the model lacks the robot.
Result<std::shared_ptr<const RunModel>> ReadRunModel(const std::string& description);

}  // namespace morphbus::bridge
