// Runs a DynaRole program on a module. Written by morphbus export: copy it before you make it your
// own.
#include <cstdio>

#include "morphbus_images.h"
#include "morphbus_module.h"
#include "morphbus_vm.h"

namespace vm = morphbus::vm;

namespace {

// How often the virtual machine runs, in milliseconds of simulation time; for all modules alike.
constexpr int kPeriodMs = 20;

vm::VerifiedKinematics kinematics;
vm::VerifiedProgram program;
vm::VmState state;
vm::TickInput input;
vm::TickOutput output;
vm::NeighbourMessage messages[NUM_CONNECTORS + 1];
int last_role = -1;

// Only images that the verifiers have accepted are run.
bool Verify() {
  const vm::VerifyError errors[] = {
      vm::VerifyKinematics(kKinematicsImage, sizeof kKinematicsImage, &kinematics),
      vm::Verifier::Verify(kProgramImage, sizeof kProgramImage, &program)};
  // Both are looked at before the first is told, so that the program below never sees one without
  // the other.
  for (const vm::VerifyError& error : errors) {
    if (error.message == nullptr) continue;
    std::fprintf(stderr, "%s: morphbus_images.h is damaged: %s (byte %u)\n", module_name(),
                 error.message, static_cast<unsigned>(error.offset));
    return false;
  }
  return true;
}

// What a module is told once; the root's pose is in single precision there.
vm::VmConfig Config() {
  vm::VmConfig config;
  config.module_id = static_cast<uint16_t>(module_id());
  // Only the root knows its pose from the beginning; the others hear it from their neighbours.
  int link = 0;
  double pose[7] = {0, 0, 0, 1, 0, 0, 0};
  config.is_root = module_is_root(&link, pose) != 0;
  config.root_link = static_cast<uint8_t>(link);
  float p[7];
  for (int k = 0; k < 7; ++k) p[k] = static_cast<float>(pose[k]);
  config.X_RL_root = {{p[0], p[1], p[2]}, {p[3], p[4], p[5], p[6]}};
  return config;
}

// What the connector senses, and what the module there says.
void Listen(int connector) {
  module_reading reading;
  module_read_connector(connector, &reading);
  vm::ConnectorReading& sensed = input.connectors[connector];
  sensed.docked = reading.docked != 0;
  sensed.mate_module = static_cast<uint16_t>(reading.mate_module);
  sensed.mate_connector = static_cast<uint8_t>(reading.mate_connector);
  sensed.connection_type = static_cast<uint8_t>(reading.connection_type);
  sensed.number = static_cast<uint16_t>(reading.number);
  sensed.is_member_b = reading.is_member_b != 0;
  static unsigned char packet[MODULE_MAX_MESSAGE];
  const int size = module_receive(connector, packet, sizeof packet);
  const bool heard = size > 0 && vm::ReadPacket(packet, size, &messages[connector]);
  // A packet of another version, or a damaged one, counts as not heard.
  input.messages[connector] = heard ? &messages[connector] : nullptr;
}

// Arrays are by number in the module's type, here as there.
void Sense(int64_t tick) {
  input.tick = tick;
  input.sim_time_us = module_time_us();
  for (int j = 0; j < NUM_JOINTS; ++j) {
    input.joint_position[j] = module_joint(j);
    input.joint_velocity[j] = module_joint_velocity(j);
    input.joint_effort[j] = static_cast<float>(module_joint_effort(j));
  }
  for (int v = 0; v < NUM_SENSOR_VALUES; ++v)
    input.sensor_values[v] = static_cast<float>(module_sensor(v));
  for (int c = 0; c < NUM_CONNECTORS; ++c) Listen(c);
}

// Carries out what the machine asks for, and leaves its message for the mates on all connectors.
void Act() {
  for (int j = 0; j < NUM_JOINTS; ++j) {
    const vm::JointCommand& command = output.joints[j];
    // Every tick commands every joint: what the motor was told last is repeated.
    module_command_joint(j, static_cast<module_mode>(command.mode), command.target, command.speed);
  }
  for (int i = 0; i < output.num_connector_commands; ++i) {
    const vm::ConnectorCommand& command = output.connector_commands[i];
    module_command_connector(command.connector, command.state, command.value);
  }
  static unsigned char packet[vm::kMaxPacketBytes];
  static_assert(vm::kMaxPacketBytes <= MODULE_MAX_MESSAGE, "a message must fit into a packet");
  // One message for all neighbours: each finds in it what concerns itself.
  const int size = vm::WritePacket(output.message, packet);
  for (int c = 0; c < NUM_CONNECTORS; ++c) module_send(c, packet, size);
}

// Roles that are taken, what the program prints, and faults, for Webots' console.
void Report() {
  const vm::StatusReport& status = output.status;
  if (status.role != last_role) {
    last_role = status.role;
    const vm::Text name = last_role >= 0 ? program.role(last_role).name : vm::Text{"none", 4};
    std::printf("%s: role %.*s\n", module_name(), name.size, name.data);
  }
  for (int i = 0; i < status.num_prints; ++i) {
    const vm::PrintReport& print = status.prints[i];
    std::printf(
        "%s: %s\n", module_name(),
        vm::PrintText(program, &kinematics, print.text, print.values, print.num_values).c_str());
  }
  for (int i = 0; i < status.num_faults; ++i) {
    const vm::Fault& fault = status.faults[i];
    std::printf("%s: line %d: %s (asked %g, measured %g, limit %g)\n", module_name(), fault.line,
                vm::FaultName(fault.code), static_cast<double>(fault.asked),
                static_cast<double>(fault.measured), static_cast<double>(fault.limit));
  }
  std::fflush(stdout);
}

}  // namespace

int main() {
  module_start(kPeriodMs);
  // Modules know each other by their numbers.
  if (module_id() < 0 || !Verify()) return 1;
  vm::Vm machine(Config(), kinematics, program, &state);
  for (int64_t tick = 0; module_step(); ++tick) {
    // In this order, as in a run: sense, compute, act; what neighbours hear now is of this tick.
    Sense(tick);
    machine.Tick(input, &output);
    Act();
    Report();
  }
  return 0;
}
