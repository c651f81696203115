#include "tools/control/command_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "tools/base/messages.h"
#include "tools/control/program_call.h"
#include "tools/plan/control_script.h"

namespace morphbus::tools {

using bridge::ControlCommand;
using bridge::ControlKind;

CommandCheck::CommandCheck(const model::Model& model, const model::Robot& robot,
                           const std::string& root, RunImages* images, ModuleStates states)
    : model_(model),
      robot_(robot),
      root_(robot.FindModule(root).value_or(0)),
      images_(*images),
      states_(std::move(states)) {}

Refusal CommandCheck::Check(const ControlCommand& command) {
  // Names come first: only a command whose names exist can be held against anything else.
  if (Refusal named = CheckNames(command)) return named;
  return command.kind == ControlKind::kDeploy ? CheckImage(command) : Refusal();
}

Refusal CommandCheck::CheckNames(const ControlCommand& command) const {
  // Every module that is named must be one of the robot's.
  for (const std::string& name : {command.part.module, command.mate.module, command.to}) {
    if (name.empty() || robot_.FindModule(name)) continue;
    return {kUnusable, fmt::format("the robot has no module '{}'{}", name,
                                   DidYouMean(name, NamesOf(robot_.modules)))};
  }
  // What is addressed to a module that is lost would never be done.
  // Who does it stands in the part for what is done to a process or asked of it, else in `to`.
  const bool by_part = OfProcess(command.kind) || command.kind == ControlKind::kInspect;
  const std::string& doer = by_part ? command.part.module : command.to;
  if (!doer.empty() && states_.lost(*robot_.FindModule(doer))) {
    return {kNo, doer + " is lost: the run goes on without it"};
  }
  if (Refusal refusal = CheckPart(command.kind, command.part)) return refusal;
  return CheckPart(command.kind, command.mate);
}

Refusal CommandCheck::CheckPart(ControlKind kind, const bridge::ControlPart& part) const {
  if (part.part.empty()) return {};
  // Links are pushed, connectors joined and taken off.
  const model::ModuleType& type = model_.TypeOf(robot_, *robot_.FindModule(part.module));
  const std::vector<std::string> names =
      kind == ControlKind::kPush ? NamesOf(type.links) : NamesOf(type.connectors);
  if (std::ranges::find(names, part.part) != names.end()) return {};
  return {kUnusable,
          fmt::format("{} has no '{}'{}", part.module, part.part, DidYouMean(part.part, names))};
}

Refusal CommandCheck::CheckImage(const ControlCommand& command) {
  // The sim verifies an image itself: who laid it there may have been mistaken.
  if (images_.Find(command.program_hash) == nullptr) {
    return {kUnusable, command.program + " was not handed over as an image that can be verified"};
  }
  // An image in itself sound may still be for other module types than the robot has.
  const std::string why = WhyNotFor(model_, images_.Image(command.program_hash));
  return why.empty() ? Refusal() : Refusal{kUnusable, why};
}

Refusal CommandCheck::CheckProgram(const ControlCommand& command) {
  const int module = Addressee(command);
  const uint64_t hash = states_.program(module);
  if (command.kind == ControlKind::kDeploy && hash == command.program_hash) {
    return {kNo, robot_.modules[module].name + " runs this program already"};
  }
  if (command.kind != ControlKind::kInvoke) return {};
  // The program of the module that issues it says whether there is such a command.
  const vm::VerifiedProgram* program = images_.Find(hash);
  if (program == nullptr) return {kFailed, "nobody knows the program that runs there"};
  const Result<vm::InvokeRequest> request = ResolveCall(*program, command);
  return request ? Refusal() : Refusal{kUnusable, request.error().message};
}

int CommandCheck::Addressee(const ControlCommand& command) const {
  return command.to.empty() ? root_ : robot_.FindModule(command.to).value_or(root_);
}

int CommandCheck::ModuleOf(const ControlCommand& command) const {
  return *robot_.FindModule(command.part.module);
}

}  // namespace morphbus::tools
