#include <morphbus/bus/module.h>

#include <cmath>
#include <exception>
#include <utility>

#include "bridge/module/module_instance.h"
#include "tools/libraries/model_content.h"
#include "tools/libraries/module_setup.h"
#include "tools/libraries/run_bus.h"
#include "vm/image/image_texts.h"

namespace morphbus {
namespace {

/// Asks a controller of one's own at the end of each of the VM's ticks.
class Asked {
 public:
  Asked(bridge::ModuleInstance* instance, ModuleController* controller)
      : instance_(*instance), controller_(*controller) {}

  void Tick(const vm::TickInput& input, vm::TickOutput* output) {
    if (thrown_) return;
    try {
      const ModuleTick now = ToPublic(input, output->status);
      std::vector<JointCommand> joints;
      for (size_t j = 0; j < now.position.size(); ++j) {
        const vm::JointCommand& said = output->joints[j];
        joints.push_back({static_cast<JointCommand::Mode>(said.mode), said.target, said.speed});
      }
      controller_.Tick(now, &joints);
      if (joints.size() != now.position.size()) {
        throw Failure("a controller of " + instance_.name() + " gave another number of commands " +
                      "than the module has joints");
      }
      for (size_t j = 0; j < joints.size(); ++j) {
        const auto mode = static_cast<int>(joints[j].mode);
        if (!std::isfinite(joints[j].target) || !std::isfinite(joints[j].speed) || mode < 0 ||
            mode > static_cast<int>(JointCommand::Mode::kVelocity)) {
          throw Failure("a controller of " + instance_.name() +
                        " gave a command that is no number, or of no known mode");
        }
        output->joints[j] = {static_cast<vm::ActuatorMode>(joints[j].mode), joints[j].target,
                             joints[j].speed};
      }
    } catch (...) {
      // It goes on to the caller once the bus is done with its handlers.
      thrown_ = std::current_exception();
    }
  }
  [[nodiscard]] const std::exception_ptr& thrown() const { return thrown_; }

 private:
  [[nodiscard]] ModuleTick ToPublic(const vm::TickInput& input,
                                    const vm::StatusReport& status) const {
    const vm::VerifiedKinematics& type = instance_.type();
    ModuleTick now;
    now.tick = input.tick;
    now.time_s = static_cast<double>(input.sim_time_us) / 1e6;
    for (int j = 0; j < type.num_joints(); ++j) {
      now.position.push_back(input.joint_position[j]);
      now.velocity.push_back(input.joint_velocity[j]);
      now.effort.push_back(static_cast<double>(input.joint_effort[j]));
    }
    for (int v = 0; v < type.num_sensor_values(); ++v) {
      now.sensors.push_back(static_cast<double>(input.sensor_values[v]));
    }
    for (int c = 0; c < type.num_connectors(); ++c) {
      now.docked.push_back(input.connectors[c].docked);
    }
    if (status.role >= 0) {
      now.role = ToString(instance_.controller().program().role(status.role).name);
    }
    return now;
  }

  bridge::ModuleInstance& instance_;
  ModuleController& controller_;
  std::exception_ptr thrown_;
};

}  // namespace

std::string DriveModule(const Robot& robot, const Program& program, const std::string& module,
                        const RunAddress& address, ModuleController* controller,
                        const std::atomic<bool>* stop) {
  std::vector<std::string> names;
  for (const Module& one : robot.modules()) names.push_back(one.name);
  const std::optional<int> number = robot.content()->robot.FindModule(module);
  if (!number) ThrowUnknown("module", module, names);

  const std::unique_ptr<bridge::ModuleImages> images = ImagesOf(robot, program);
  bridge::ModuleSpec spec = SpecOf(robot, *number);
  spec.run = address.run;
  spec.claim = bridge::RandomClaim();
  auto created = bridge::ModuleInstance::Create(*images, std::move(spec));
  if (!created) throw Failure(created.error().message);
  bridge::ModuleInstance& instance = **created;
  Asked asked(&instance, controller);
  instance.controller().OnTick(
      [&asked](const vm::TickInput& input, vm::TickOutput* output) { asked.Tick(input, output); });
  RunBus bus(address);
  const bridge::MonotonicTime time;
  instance.Join(bus.bus(), &time);
  volatile bool ended = false;
  Watch watch(&time,
              [&] { ended = asked.thrown() != nullptr || (stop != nullptr && stop->load()); });
  bridge::RunParticipants(bus.bus(), time, {&instance.participant(), &watch}, &ended,
                          [&instance] { instance.participant().PublishHealth(); });
  if (asked.thrown()) std::rethrow_exception(asked.thrown());
  if (!instance.participant().error().empty()) throw Failure(instance.participant().error());
  return instance.participant().done() ? instance.participant().end_reason() : "stopped";
}

}  // namespace morphbus
