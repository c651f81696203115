#include "tools/control/command_effects.h"

#include <vector>

#include "tools/control/program_call.h"
#include "vm/spread/package.h"

namespace morphbus::tools {
namespace {

using bridge::ControlCommand;
using bridge::ControlKind;

constexpr const char* kStopped = "stopped by command";

}  // namespace

CommandEffects::CommandEffects(CommandCheck* check, RunImages* images, DeploymentSchedule* schedule,
                               bridge::SimParticipant* sim, sim::ControlledRobot* robot)
    : check_(*check), images_(*images), schedule_(*schedule), sim_(*sim), robot_(*robot) {}

Result<void> CommandEffects::Apply(const ControlCommand& command, int64_t tick) {
  switch (command.kind) {
    // The run as a whole.
    case ControlKind::kPause:
      sim_.Pause();
      return {};
    case ControlKind::kResume:
      sim_.Resume();
      return {};
    case ControlKind::kStep:
      sim_.Step(command.steps);
      return {};
    case ControlKind::kSpeed:
      sim_.SetSpeed(command.speed);
      return {};
    case ControlKind::kStop:
      sim_.RequestStop(kStopped);
      return {};
    // The robot.
    case ControlKind::kPush:
      return Push(command);
    case ControlKind::kLose:
      robot_.Lose(check_.ModuleOf(command));
      return {};
    case ControlKind::kConnect:
      return robot_.Connect(command.part.module, command.part.part, command.mate.module,
                            command.mate.part);
    case ControlKind::kDisconnect:
      return robot_.Disconnect(command.part.module, command.part.part);
    // The program.
    case ControlKind::kDeploy:
    case ControlKind::kSet:
      Deploy(command, tick);
      return {};
    case ControlKind::kInvoke:
      return Invoke(command);
    case ControlKind::kInspect:
      Inspect(command);
      return {};
    // Processes are not the simulator's.
    case ControlKind::kKill:
    case ControlKind::kRestart:
      return {};
  }
  return {};
}

DeploymentSchedule::Order CommandEffects::OrderOf(const ControlCommand& command,
                                                  int64_t tick) const {
  // How long the image needs to reach every module depends on the hops from where it is put in.
  const auto module = static_cast<size_t>(check_.Addressee(command));
  return {tick, command.at, images_.Image(command.program_hash).size(),
          sim_.readings().HopsFrom(module), sim_.delivery().whole()};
}

Result<void> CommandEffects::Push(const ControlCommand& command) {
  // The direction may have any length, since the strength is a number of its own.
  const Eigen::Vector3d direction_W(command.direction_W[0], command.direction_W[1],
                                    command.direction_W[2]);
  return robot_.Push(command.part.module, command.newtons * direction_W.normalized(),
                     command.part.part, command.seconds);
}

void CommandEffects::Deploy(const ControlCommand& command, int64_t tick) {
  const DeploymentSchedule::Order order = OrderOf(command, tick);
  // The times are planned before anything is sent: all modules begin the program in one tick.
  const DeploymentSchedule::Times times = schedule_.Plan(order);
  const vm::PackageHead head = schedule_.Begin(order, times);
  // The head goes before the image, and gives the package its name.
  const std::string& image = images_.Image(command.program_hash);
  images_.SetNewest(command.program_hash);
  std::vector<uint8_t> package(vm::kPackageHeadBytes);
  vm::WritePackageHead(head, package.data());
  package.insert(package.end(), image.begin(), image.end());
  sim_.delivery().Deploy(static_cast<size_t>(check_.Addressee(command)),
                         vm::PackageId(command.program_hash, head), package, times.from_tick);
}

Result<void> CommandEffects::Invoke(const ControlCommand& command) {
  const auto module = static_cast<size_t>(check_.Addressee(command));
  // What roles and commands there are is known only from the program that runs in the module now.
  const vm::VerifiedProgram* program = images_.Find(sim_.program_of(module));
  if (program == nullptr) return Fail("nobody knows the program that runs there");
  const Result<vm::InvokeRequest> request = ResolveCall(*program, command);
  if (!request) return tl::unexpected(request.error());
  sim_.orders().Invoke(module, *request);
  return {};
}

void CommandEffects::Inspect(const ControlCommand& command) {
  // A lost module cannot answer, and nobody waits for it.
  const bool all = command.part.module.empty();
  for (size_t module = 0; module < check_.num_modules(); ++module) {
    const bool asked = all || module == static_cast<size_t>(check_.ModuleOf(command));
    if (asked && !sim_.lost(module)) sim_.orders().Inspect(module);
  }
}

}  // namespace morphbus::tools
