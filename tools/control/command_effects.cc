#include "tools/control/command_effects.h"

#include <fmt/format.h>

#include <vector>

#include "compiler/base/check.h"
#include "tools/base/messages.h"
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
  // Another value makes an image no larger.
  const bool sets = command.kind == ControlKind::kSet;
  const std::string& image = images_.Image(sets ? ProgramAt(tick) : command.program_hash);
  return {tick, command.at, image.size(), sim_.readings().HopsFrom(module), sim_.delivery().whole(),
          sets};
}

uint64_t CommandEffects::ProgramAt(int64_t tick) const {
  const auto root = static_cast<size_t>(check_.Addressee({}));
  const uint64_t hash = schedule_.UnderWay(tick) ? deployed_ : sim_.program_of(root);
  // Found by its hash, so that it has an image here.
  const vm::VerifiedProgram* program = images_.Find(hash);
  return program == nullptr ? 0 : program->hash();
}

Refusal CommandEffects::CheckSetting(const ControlCommand& command, int64_t tick) {
  if (sim_.lost(static_cast<size_t>(check_.Addressee(command)))) {
    return {kNo, "the root is lost, from which values spread"};
  }
  const uint64_t base = ProgramAt(tick);
  const Result<CompiledProgram> program =
      images_.WithParameter(base, command.parameter, command.value);
  if (!program) return {kUnusable, program.error().message};
  if (program->hash == base) {
    return {kNo, fmt::format("{} is {} already", command.parameter, command.value)};
  }
  // Who says again what was said in another run means the program that ran there.
  if (command.program_hash == 0 || command.program_hash == program->hash) return {};
  return {kUnusable,
          fmt::format("the program is another one than {} was set in", command.parameter)};
}

Refusal CommandEffects::PrepareSetting(ControlCommand* command, int64_t tick) {
  if (Refusal refusal = CheckSetting(*command, tick)) return refusal;
  const Result<CompiledProgram> program =
      images_.WithParameter(ProgramAt(tick), command->parameter, command->value);
  images_.Keep(*program);
  command->program_hash = program->hash;
  // Found once, so that its image is known.
  if (images_.Find(program->hash) != nullptr) return {};
  return {kFailed, "the program with this value cannot be verified"};
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
  MORPHBUS_CHECK(!image.empty());
  deployed_ = command.program_hash;
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
