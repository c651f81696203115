#include "tools/roles/static_robot.h"

#include <algorithm>

#include "bridge/wire/vm_codec.h"
#include "vm/image/fault_text.h"
#include "vm/vm.h"

namespace morphbus::tools {
namespace {

/// Nothing must change for so many ticks, 2 s of sim time at 20 ms a tick; after 10 s roles count
/// as unsettled.
constexpr int64_t kQuietTicks = 100;
constexpr int64_t kMaxTicks = 500;

}  // namespace

Result<std::unique_ptr<StaticRobot>> StaticRobot::Create(const RunPlan& plan,
                                                         const Situation* situation) {
  std::unique_ptr<StaticRobot> robot(new StaticRobot(plan));
  if (situation != nullptr) robot->stop_ = situation->stop;
  if (Result<void> r = robot->AddModules(situation); !r) return Fail(r.error().message);
  return robot;
}

bool StaticRobot::Settle() {
  // Some roles need their neighbours' roles first: settled is what stays for a while.
  int64_t quiet = 0;
  while (ticks_ < kMaxTicks && quiet < kQuietTicks) {
    if (stop_ != nullptr && *stop_) return false;
    quiet = Tick() ? 0 : quiet + 1;
  }
  return quiet >= kQuietTicks;
}

bool StaticRobot::Tick() {
  bool changed = false;
  for (const auto& module : modules_) {
    if (module->silent) continue;
    module->input.tick = ticks_;
    module->input.sim_time_us = ticks_ * plan_.description.tick_us();
    for (int c = 0; c < module->instance->type().num_connectors(); ++c) {
      // As in lockstep, a module hears at a tick what its neighbours said at the one before.
      const vm::ConnectorReading& reading = module->input.connectors[c];
      const bool hears = ticks_ > 0 && reading.docked && !modules_[reading.mate_module]->silent;
      module->input.messages[c] = hears ? &modules_[reading.mate_module]->last_message : nullptr;
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
  // Only when all have computed the tick may any message change, or the order of modules would
  // matter.
  for (const auto& module : modules_) module->last_message = module->output.message;
  ++ticks_;
  return changed;
}

Result<void> StaticRobot::AddModules(const Situation* situation) {
  Result<std::unique_ptr<PlanModules>> built = BuildModules(plan_);
  if (!built) return Fail(built.error().message);
  built_ = std::move(*built);
  // The simulator's sensors at rest; its world is never stepped.
  const auto robot = BuildRobot(plan_);
  if (!robot) return Fail(robot.error().message);
  std::vector<morphbus::module_sensors_t> sensors;
  (*robot)->Sense(&sensors);
  if (situation != nullptr) Place(*situation, &sensors);
  for (size_t m = 0; m < built_->instances.size(); ++m) {
    auto module = std::make_unique<Module>();
    module->instance = built_->instances[m].get();
    module->silent = situation != nullptr && situation->silent.contains(sensors[m].name);
    // A reading must fit the module type, as the module process checks too.
    const vm::VerifiedKinematics& type = module->instance->type();
    if (Result<void> r = bridge::FromSensors(sensors[m], type.num_joints(), type.num_connectors(),
                                             type.num_sensor_values(), &module->input);
        !r) {
      return r;
    }
    modules_.push_back(std::move(module));
  }
  return {};
}

void StaticRobot::Place(const Situation& situation,
                        std::vector<morphbus::module_sensors_t>* sensors) {
  for (morphbus::module_sensors_t& reading : *sensors) {
    const auto placed = situation.positions.find(reading.name);
    // They come from messages, which may speak of another number of joints.
    if (placed != situation.positions.end() &&
        placed->second.size() == reading.joint_position_si.size()) {
      reading.joint_position_si = placed->second;
    }
    const auto found = situation.docked.find(reading.name);
    if (found == situation.docked.end()) continue;
    reading.docked = found->second;
    // They come from a log, which may name modules that there are not.
    std::erase_if(reading.docked, [&](const morphbus::docked_connector_t& connector) {
      return static_cast<size_t>(connector.mate_module) >= sensors->size();
    });
    reading.num_docked = static_cast<int8_t>(reading.docked.size());
  }
}

void StaticRobot::NoteFaults(Module* module) const {
  const vm::StatusReport& status = module->output.status;
  for (int i = 0; i < status.num_faults; ++i) {
    const vm::Fault& fault = status.faults[i];
    // Nothing moves here, so every rotation stalls: that says nothing about the program.
    if (fault.code == vm::FaultCode::kStalled || fault.code == vm::FaultCode::kTurnStalled) {
      continue;
    }
    // Names of roles and joints come from the two images.
    std::string sentence = vm::FaultSentence(fault, {&program(), &module->instance->type()});
    // A fault that comes in every tick is told once.
    const bool known =
        std::any_of(module->faults.begin(), module->faults.end(), [&](const NotedFault& had) {
          return had.fault.line == fault.line && had.fault.function == fault.function &&
                 had.sentence == sentence;
        });
    if (!known) module->faults.push_back({fault, std::move(sentence)});
  }
}

}  // namespace morphbus::tools
