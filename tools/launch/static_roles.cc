#include "tools/launch/static_roles.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <sstream>

#include "bridge/wire/vm_codec.h"
#include "compiler/base/text.h"
#include "compiler/base/utf8.h"
#include "tools/base/files.h"
#include "tools/base/program.h"
#include "tools/launch/plan_modules.h"
#include "vm/image/disassembler.h"
#include "vm/image/fault_text.h"
#include "vm/vm.h"

namespace morphbus::tools {
namespace {

/// Nothing must change for so many ticks, 2 s of sim time at 20 ms a tick; after 10 s roles count
/// as unsettled.
constexpr int64_t kQuietTicks = 100;
constexpr int64_t kMaxTicks = 500;

/// One module and what its VM was told and said last.
struct Module {
  bridge::ModuleInstance* instance = nullptr;
  vm::TickInput input;
  vm::TickOutput output;
  vm::NeighbourMessage last_message;  ///< Of the previous tick.
  vm::StatusReport report;            ///< The newest.
  std::vector<std::string> faults;
};

/// The VMs of a robot that stands still.
class StaticRobot {
 public:
  /// The VMs of the plan, before their first tick.
  static Result<std::unique_ptr<StaticRobot>> Create(const RunPlan& plan) {
    std::unique_ptr<StaticRobot> robot(new StaticRobot(plan));
    if (Result<void> r = robot->AddModules(); !r) return Fail(r.error().message);
    return robot;
  }

  /// One tick of all; true if any role, label or convention changed.
  bool Tick(int64_t tick) {
    bool changed = false;
    for (const auto& module : modules_) {
      module->input.tick = tick;
      module->input.sim_time_us = tick * plan_.description.tick_us();
      for (int c = 0; c < module->instance->type().num_connectors(); ++c) {
        // As in lockstep, a module hears at a tick what its neighbours said at the one before.
        const vm::ConnectorReading& reading = module->input.connectors[c];
        module->input.messages[c] =
            tick > 0 && reading.docked ? &modules_[reading.mate_module]->last_message : nullptr;
      }
      // Commands are thrown away: the sensors stay what they are.
      module->instance->controller().Tick(module->input, &module->output);
      // What a role has resolved and agreed on is part of what must settle.
      const vm::StatusReport& now = module->output.status;
      const vm::StatusReport& before = module->report;
      changed = changed || now.role != before.role || now.num_labels != before.num_labels ||
                !std::equal(now.labels, now.labels + now.num_labels, before.labels) ||
                !std::equal(std::begin(now.signs), std::end(now.signs), before.signs);
      NoteFaults(module.get());
      module->report = now;
    }
    for (const auto& module : modules_) module->last_message = module->output.message;
    return changed;
  }

  /// What the module has settled on, by names.
  [[nodiscard]] StaticRole Describe(size_t index) const {
    const Module& module = *modules_[index];
    StaticRole out;
    out.module = module.instance->name();
    out.problems = module.faults;
    // A module without a role has no labels and no signs.
    if (module.report.role < 0) {
      ExplainMissingRole(module, &out.problems);
      return out;
    }
    const vm::RoleInfo& role = program().role(module.report.role);
    out.role = ToString(role.name);
    // Signs are listed under the label, and under the joint's own name where it has none.
    std::vector<bool> labelled(static_cast<size_t>(module.instance->type().num_joints()));
    for (int l = 0; l < role.num_labels; ++l) {
      const int target = module.report.labels[l];
      // The label has not resolved to anything.
      if (target < 0) continue;
      const std::string name = ToString(role.labels[l].name);
      out.labels[name] = LabelTarget(module, role.labels[l], target);
      if (role.labels[l].type == vm::ValueType::kLink) continue;
      labelled[target] = true;
      if (module.report.signs[target] != 0) out.signs[name] = module.report.signs[target];
    }
    // What remains are joints with a convention but without a label.
    for (int j = 0; j < module.instance->type().num_joints(); ++j) {
      if (module.report.signs[j] == 0 || labelled[j]) continue;
      out.signs[ToString(module.instance->type().joint(j).name)] = module.report.signs[j];
    }
    return out;
  }

  [[nodiscard]] size_t size() const { return modules_.size(); }

 private:
  explicit StaticRobot(const RunPlan& plan) : plan_(plan) {}
  /// Builds the modules and gives each what its sensors read at rest.
  Result<void> AddModules() {
    Result<std::unique_ptr<PlanModules>> built = BuildModules(plan_);
    if (!built) return Fail(built.error().message);
    built_ = std::move(*built);
    // The simulator's sensors at rest; its world is never stepped.
    const auto robot = BuildRobot(plan_);
    if (!robot) return Fail(robot.error().message);
    std::vector<morphbus::module_sensors_t> sensors;
    (*robot)->Sense(&sensors);
    for (size_t m = 0; m < built_->instances.size(); ++m) {
      auto module = std::make_unique<Module>();
      module->instance = built_->instances[m].get();
      // A reading must fit the module type, as the module process checks too.
      const vm::VerifiedKinematics& type = module->instance->type();
      if (Result<void> r = bridge::FromSensors(sensors[m], type.num_joints(), type.num_connectors(),
                                               &module->input);
          !r) {
        return r;
      }
      modules_.push_back(std::move(module));
    }
    return {};
  }

  /// Adds the faults of the last tick to the module's, each once.
  void NoteFaults(Module* module) const {
    const vm::StatusReport& status = module->output.status;
    for (int i = 0; i < status.num_faults; ++i) {
      const vm::Fault& fault = status.faults[i];
      // Nothing moves here, so every rotation stalls: that says nothing about the program.
      if (fault.code == vm::FaultCode::kStalled || fault.code == vm::FaultCode::kTurnStalled) {
        continue;
      }
      // Names of roles and joints come from the two images.
      const vm::FaultContext context{&program(), &module->instance->type()};
      const std::string text =
          module->instance->name() + ": " +
          vm::FaultLine(plan_.description.program_file(), fault.line,
                        vm::FaultSentence(fault, context), vm::FaultFunction(fault, &program()));
      if (std::find(module->faults.begin(), module->faults.end(), text) == module->faults.end()) {
        module->faults.push_back(text);
      }
    }
  }

  /// Name of the joint or link, by its index in the module type, that a label stands for.
  [[nodiscard]] std::string LabelTarget(const Module& module, const vm::LabelInfo& label,
                                        int index) const {
    if (label.type == vm::ValueType::kLink)
      return ToString(module.instance->type().link(index).name);
    return ToString(module.instance->type().joint(index).name);
  }

  /// A sentence that the requirement on `line` fails, with its text if PROGRAM is source.
  [[nodiscard]] std::string RequirementText(int line) const {
    const std::string& file = plan_.description.program_file();
    const std::string place = fmt::format("a requirement fails ({}:{}", file, line);
    const Result<std::string> source = ReadFile(file);
    // An image does not hold its source.
    if (!source || !IsUtf8(*source)) return place + ")";
    // The line is looked up in the source as it is now.
    std::istringstream lines(*source);
    std::string text;
    for (int i = 0; i < line; ++i) std::getline(lines, text);
    const size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    return place + ": " + EscapeControl(text.substr(begin)) + ")";
  }

  /// Adds why the module takes none of the concrete roles, a line each.
  void ExplainMissingRole(const Module& module, std::vector<std::string>* problems) const {
    // Roles rest on where modules are, which spreads from the root over connections.
    if (!module.report.has_pose) {
      problems->push_back(module.instance->name() + ": no pose reaches it, so it can take no role");
      return;
    }
    for (int r = 0; r < program().num_roles(); ++r) {
      const vm::RoleInfo& role = program().role(r);
      if (role.abstract_role) continue;
      // The VM tells what fails first in this role for this module.
      const vm::RoleCheck check = module.instance->controller().vm().CheckRole(r);
      std::string why;
      // The first thing that fails, in the order in which the VM looks.
      if (check.missing_keyword >= 0) {
        why = fmt::format("its type has no {}",
                          ToString(program().keyword(check.missing_keyword).name));
      } else if (check.failed_requirement >= 0) {
        why = RequirementText(program().LineOf(role.requirements[check.failed_requirement], 0));
        if (check.measured.opcode != vm::Opcode::kPop) {
          why += ", measured " + vm::ComparisonText(check.measured, program());
        }
      } else if (check.failed_label >= 0) {
        why = fmt::format("label {} does not resolve",
                          ToString(role.labels[check.failed_label].name));
      }
      if (!why.empty()) {
        problems->push_back(
            fmt::format("{}: not {}: {}", module.instance->name(), ToString(role.name), why));
      }
    }
  }

  const RunPlan& plan_;
  [[nodiscard]] const vm::VerifiedProgram& program() const { return built_->images.program(); }

  std::unique_ptr<PlanModules> built_;
  std::vector<std::unique_ptr<Module>> modules_;
};

}  // namespace

Result<StaticRoles> SettleRoles(const RunPlan& plan) {
  const Result<std::unique_ptr<StaticRobot>> robot = StaticRobot::Create(plan);
  if (!robot) return Fail(robot.error().message);
  StaticRoles roles;
  // Some roles need their neighbours' roles first: settled is what stays for a while.
  int64_t quiet = 0;
  while (roles.ticks < kMaxTicks && quiet < kQuietTicks) {
    quiet = (*robot)->Tick(roles.ticks++) ? 0 : quiet + 1;
  }
  roles.settled = quiet >= kQuietTicks;
  for (size_t m = 0; m < (*robot)->size(); ++m) roles.modules.push_back((*robot)->Describe(m));
  return roles;
}

bool HasRoles(const RunPlan& plan) {
  const Result<std::unique_ptr<vm::VerifiedProgram>> program =
      VerifyProgram(plan.description.program_image());
  for (int r = 0; program && r < (*program)->num_roles(); ++r) {
    if (!(*program)->role(r).abstract_role) return true;
  }
  return false;
}

}  // namespace morphbus::tools
