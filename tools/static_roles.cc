#include "tools/static_roles.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "bridge/vm_codec.h"
#include "tools/program.h"
#include "vm/vm.h"

namespace morphbus::tools {
namespace {

constexpr int64_t kQuietTicks = 100;
constexpr int64_t kMaxTicks = 500;

/// One module with its VM.
struct Module {
  std::string name;
  const vm::VerifiedKinematics* kinematics = nullptr;
  vm::VmState state;
  std::unique_ptr<vm::Vm> vm;
  vm::TickInput input;
  vm::TickOutput output;
  vm::NeighbourMessage last_message;  ///< Of the previous tick.
  vm::StatusReport report;            ///< The newest.
  std::vector<std::string> faults;
};

/// The VMs of a robot that stands still.
class StillRobot {
 public:
  static Result<std::unique_ptr<StillRobot>> Create(const RunPlan& plan);

  /// One tick of all; true if any role, label or convention changed.
  bool Tick(int64_t tick);
  [[nodiscard]] StaticRole Describe(size_t module) const;
  [[nodiscard]] size_t size() const { return modules_.size(); }

 private:
  explicit StillRobot(const RunPlan& plan) : plan_(plan) {}
  Result<void> LoadImages();
  Result<void> AddModules();
  void NoteFaults(Module* module) const;
  [[nodiscard]] std::string LabelTarget(const Module& module, const vm::LabelInfo& label,
                                        int index) const;
  void ExplainMissingRole(const Module& module, std::vector<std::string>* problems) const;

  const RunPlan& plan_;
  std::unique_ptr<vm::VerifiedProgram> program_;
  std::map<std::string, std::unique_ptr<vm::VerifiedKinematics>> kinematics_;
  std::vector<std::unique_ptr<Module>> modules_;
};

Result<std::unique_ptr<StillRobot>> StillRobot::Create(const RunPlan& plan) {
  std::unique_ptr<StillRobot> robot(new StillRobot(plan));
  if (Result<void> r = robot->LoadImages(); !r) return Fail(r.error().message);
  if (Result<void> r = robot->AddModules(); !r) return Fail(r.error().message);
  return robot;
}

Result<void> StillRobot::LoadImages() {
  Result<std::unique_ptr<vm::VerifiedProgram>> program =
      VerifyProgram(plan_.description.program_image());
  if (!program) return Fail(program.error().message);
  program_ = std::move(*program);
  for (const proto::KinematicsImage& entry : plan_.description.kinematics()) {
    Result<std::unique_ptr<vm::VerifiedKinematics>> image = VerifyKinematicsImage(entry.image());
    if (!image) return Fail(image.error().message);
    kinematics_[entry.type_name()] = std::move(*image);
  }
  return {};
}

Result<void> StillRobot::AddModules() {
  // The simulator's sensors at rest; its world is never stepped.
  const auto assembly = BuildAssembly(plan_);
  if (!assembly) return Fail(assembly.error().message);
  std::vector<morphbus::module_sensors_t> sensors;
  (*assembly)->Sense(&sensors);
  const model::Robot& robot = plan_.robot();
  const int root = robot.FindModule(plan_.description.root_module()).value_or(robot.root_module);
  const RootPose root_pose = RootPoseOf(plan_, root);
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    auto module = std::make_unique<Module>();
    module->name = robot.modules[m].name;
    module->kinematics = kinematics_.at(plan_.model.TypeOf(robot, static_cast<int>(m)).name).get();
    vm::VmConfig config;
    config.module_id = static_cast<uint16_t>(m);
    config.is_root = static_cast<int>(m) == root;
    if (config.is_root) {
      config.root_link = static_cast<uint8_t>(root_pose.link);
      config.X_RL_root = ToVmPose(root_pose.X_RL);
    }
    module->vm = std::make_unique<vm::Vm>(config, *module->kinematics, *program_, &module->state);
    if (Result<void> r = bridge::FromSensors(sensors[m], module->kinematics->num_joints(),
                                             module->kinematics->num_connectors(), &module->input);
        !r) {
      return r;
    }
    modules_.push_back(std::move(module));
  }
  return {};
}

bool StillRobot::Tick(int64_t tick) {
  bool changed = false;
  for (const auto& module : modules_) {
    module->input.tick = tick;
    module->input.sim_time_us = tick * plan_.description.tick_us();
    for (int c = 0; c < module->kinematics->num_connectors(); ++c) {
      const vm::ConnectorReading& reading = module->input.connectors[c];
      module->input.messages[c] =
          tick > 0 && reading.docked ? &modules_[reading.mate_module]->last_message : nullptr;
    }
    module->vm->Tick(module->input, &module->output);
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

void StillRobot::NoteFaults(Module* module) const {
  const vm::StatusReport& status = module->output.status;
  for (int i = 0; i < status.num_faults; ++i) {
    const vm::Fault& fault = status.faults[i];
    // Nothing moves here, so every rotation stalls: that says nothing about the program.
    if (fault.code == vm::FaultCode::kStalled) continue;
    const std::string function =
        fault.function >= 0 ? ToString(program_->function(fault.function).name) : "";
    const std::string text =
        fault.line > 0
            ? fmt::format("{}: {}:{}: {} (in {})", module->name, plan_.description.program_file(),
                          fault.line, vm::FaultText(fault.code), function)
            : fmt::format("{}: {}", module->name, vm::FaultText(fault.code));
    if (std::find(module->faults.begin(), module->faults.end(), text) == module->faults.end()) {
      module->faults.push_back(text);
    }
  }
}

std::string StillRobot::LabelTarget(const Module& module, const vm::LabelInfo& label,
                                    int index) const {
  if (label.type == vm::ValueType::kLink) return ToString(module.kinematics->link(index).name);
  return ToString(module.kinematics->joint(index).name);
}

void StillRobot::ExplainMissingRole(const Module& module,
                                    std::vector<std::string>* problems) const {
  if (!module.report.has_pose) {
    problems->push_back(module.name + ": no pose reaches it, so it can take no role");
    return;
  }
  for (int r = 0; r < program_->num_roles(); ++r) {
    const vm::RoleInfo& role = program_->role(r);
    if (role.abstract_role) continue;
    const vm::RoleCheck check = module.vm->CheckRole(r);
    std::string why;
    if (check.missing_keyword >= 0) {
      why = fmt::format("its type has no {}",
                        ToString(program_->keyword(check.missing_keyword).name));
    } else if (check.failed_requirement >= 0) {
      why = fmt::format("a requirement fails ({}:{})", plan_.description.program_file(),
                        program_->LineOf(role.requirements[check.failed_requirement], 0));
    } else if (check.failed_label >= 0) {
      why =
          fmt::format("label {} does not resolve", ToString(role.labels[check.failed_label].name));
    }
    if (!why.empty()) {
      problems->push_back(fmt::format("{}: not {}: {}", module.name, ToString(role.name), why));
    }
  }
}

StaticRole StillRobot::Describe(size_t index) const {
  const Module& module = *modules_[index];
  StaticRole out;
  out.module = module.name;
  out.problems = module.faults;
  if (module.report.role < 0) {
    ExplainMissingRole(module, &out.problems);
    return out;
  }
  const vm::RoleInfo& role = program_->role(module.report.role);
  out.role = ToString(role.name);
  std::vector<bool> labelled(static_cast<size_t>(module.kinematics->num_joints()));
  for (int l = 0; l < role.num_labels; ++l) {
    const int target = module.report.labels[l];
    if (target < 0) continue;
    const std::string name = ToString(role.labels[l].name);
    out.labels[name] = LabelTarget(module, role.labels[l], target);
    if (role.labels[l].type == vm::ValueType::kLink) continue;
    labelled[static_cast<size_t>(target)] = true;
    if (module.report.signs[target] != 0) out.signs[name] = module.report.signs[target];
  }
  for (int j = 0; j < module.kinematics->num_joints(); ++j) {
    if (module.report.signs[j] == 0 || labelled[static_cast<size_t>(j)]) continue;
    out.signs[ToString(module.kinematics->joint(j).name)] = module.report.signs[j];
  }
  return out;
}

}  // namespace

Result<StaticRoles> SettleRoles(const RunPlan& plan) {
  const Result<std::unique_ptr<StillRobot>> robot = StillRobot::Create(plan);
  if (!robot) return Fail(robot.error().message);
  StaticRoles roles;
  int64_t quiet = 0;
  while (roles.ticks < kMaxTicks && quiet < kQuietTicks) {
    quiet = (*robot)->Tick(roles.ticks++) ? 0 : quiet + 1;
  }
  roles.settled = quiet >= kQuietTicks;
  for (size_t m = 0; m < (*robot)->size(); ++m) roles.modules.push_back((*robot)->Describe(m));
  return roles;
}

}  // namespace morphbus::tools
