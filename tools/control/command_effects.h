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

  /// A deployment, or a setting, as it would be at `tick`.
  [[nodiscard]] DeploymentSchedule::Order OrderOf(const bridge::ControlCommand& command,
                                                  int64_t tick) const;
  /// What can be said against a setting that is done at `tick`: the program has no such parameter,
  /// not with that value, or has it already.
  Refusal CheckSetting(const bridge::ControlCommand& command, int64_t tick);
  /// The same for one that is done now; if nothing can be said against it, it gets its image.
  Refusal PrepareSetting(bridge::ControlCommand* command, int64_t tick);

 private:
  /// Pushes a body at its centre of mass.
  Result<void> Push(const bridge::ControlCommand& command);
  /// Gives a module a program with the tick at which all go over to it.
  void Deploy(const bridge::ControlCommand& command, int64_t tick);
  /// Hash of the program to which a setting at `tick` gives another value: the one that all are on
  /// their way to, or else the one that the root runs.
  [[nodiscard]] uint64_t ProgramAt(int64_t tick) const;
  /// Gives a module a call of a role's command to issue.
  Result<void> Invoke(const bridge::ControlCommand& command);
  /// Asks a module, or every one that is not lost, what it holds.
  void Inspect(const bridge::ControlCommand& command);

  CommandCheck& check_;
  RunImages& images_;
  DeploymentSchedule& schedule_;
  bridge::SimParticipant& sim_;
  sim::ControlledRobot& robot_;
  uint64_t deployed_ = 0;  ///< Hash of the program that was deployed last.
};

}  // namespace morphbus::tools
