#pragma once
// What each command does to the simulator and the robot.

#include <cstdint>

#include "bridge/control/control_command.h"
#include "bridge/lockstep/sim/sim_participant.h"
#include "sim/controlled_robot.h"
#include "tools/control/command_check.h"
#include "tools/control/deployment_schedule.h"
#include "tools/control/run_images.h"

namespace morphbus::tools {

/// Does what commands say, between two ticks; when, others decide. What modules do as processes is
/// the launcher's (ProcessOrders).
class CommandEffects {
 public:
  /// All outlive this.
  CommandEffects(CommandCheck* check, RunImages* images, DeploymentSchedule* schedule,
                 bridge::SimParticipant* sim, sim::ControlledRobot* robot);

  /// Does it: a command that passed the check, before the sensors of `tick` are read. Fails, in a
  /// sentence for people, if the robot is in no state for it; then nothing has changed.
  Result<void> Apply(const bridge::ControlCommand& command, int64_t tick);

  /// A deployment as it would be at `tick`.
  [[nodiscard]] DeploymentSchedule::Order OrderOf(const bridge::ControlCommand& command,
                                                  int64_t tick) const;

 private:
  /// Pushes a body at its centre of mass.
  Result<void> Push(const bridge::ControlCommand& command);
  /// Gives a module a program with the tick at which all go over to it.
  void Deploy(const bridge::ControlCommand& command, int64_t tick);
  /// Gives a module a call of a role's command to issue.
  Result<void> Invoke(const bridge::ControlCommand& command);
  /// Asks a module, or every one that is not lost, what it holds.
  void Inspect(const bridge::ControlCommand& command);

  CommandCheck& check_;
  RunImages& images_;
  DeploymentSchedule& schedule_;
  bridge::SimParticipant& sim_;
  sim::ControlledRobot& robot_;
};

}  // namespace morphbus::tools
