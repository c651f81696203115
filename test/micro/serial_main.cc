// The firmware of a module on an emulated Cortex-M3 (MPS2, AN385), whose UART is the link of the
// one connector that is docked. Two machines with this program are a robot of two modules
// (test/micro/serial_line.py). Joints are where they were in a run on the host; what the
// module knows of its neighbour, it learns over the line. Reads config.bin and input.bin of the
// folder that the emulator was started in, and writes output.bin there.

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <new>

#include "test/micro/tick_record.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"
#include "vm/port/firmware.h"

using namespace morphbus;

// The images, which the VM reads straight out of the flash.
__asm__(
    ".section .rodata.images\n"
    ".global program_image\nprogram_image:\n.incbin \"image.bin\"\nprogram_image_end:\n"
    ".global program_image_end\n"
    ".balign 4\n"
    ".global kinematics_image\nkinematics_image:\n.incbin \"kinematics.bin\"\n"
    ".global kinematics_image_end\nkinematics_image_end:\n"
    ".text\n");
extern "C" const uint8_t program_image[], program_image_end[];
extern "C" const uint8_t kinematics_image[], kinematics_image_end[];

namespace {

/// A UART of ARM's Cortex-M System Design Kit.
struct Uart {
  volatile uint32_t data, state, control, interrupts, divider;
};
Uart& uart = *reinterpret_cast<Uart*>(0x40004000);
constexpr uint32_t kSendFull = 1, kReceiveFull = 2;

/// The electronics. A module's clock would be a timer. Here a tick begins when the neighbour has
/// said what it had to say in the tick before, so that both are in step as on the host.
class Machine final : public vm::Hardware {
 public:
  /// The tick that the host computed next; false behind the last one. Of it are used the joints,
  /// the time, and of how the modules are docked what an orientation sensor would say.
  bool NextRecorded(int file, const vm::VerifiedKinematics& kinematics);
  /// The UART works, and the recorded tick says which connector it belongs to.
  void Start(const vm::Firmware* firmware) {
    firmware_ = firmware;
    uart.divider = 16;
    uart.control = 3;
    while (docked_ < vm::kMaxConnectors && !recorded.connectors[docked_].docked) ++docked_;
  }
  /// The neighbour is known, and from the second tick on the tick that it computed last.
  [[nodiscard]] bool TickIsDue() const {
    return firmware_->neighbour(docked_).heard && firmware_->lag() >= 0;
  }

  int Receive(int connector, uint8_t* bytes, int /*capacity*/) override {
    // What the neighbour says of its next tick is left for later.
    if (connector != docked_ || TickIsDue() || (uart.state & kReceiveFull) == 0) return 0;
    bytes[0] = static_cast<uint8_t>(uart.data);
    return 1;
  }
  void Send(int connector, const uint8_t* bytes, int size) override {
    if (connector != docked_) return;
    for (int i = 0; i < size; ++i) {
      while ((uart.state & kSendFull) != 0) {
      }
      uart.data = bytes[i];
    }
    longest = size > longest ? size : longest;
  }
  vm::ConnectorReading ReadConnector(int connector, const vm::LinkedNeighbour& neighbour) override {
    if (connector != docked_ || !neighbour.heard) return {};
    const vm::ConnectorReading& sensed = recorded.connectors[connector];
    return {.docked = true,
            .mate_module = neighbour.module,
            .mate_connector = neighbour.connector,
            .connection_type = sensed.connection_type,
            .number = sensed.number,
            .is_member_b = sensed.is_member_b};
  }
  void ReadJoint(int joint, double* position, double* velocity) override {
    *position = recorded.joint_position[joint];
    *velocity = recorded.joint_velocity[joint];
  }
  void ReadSensors(vm::TickInput* input) override {
    for (int j = 0; j < vm::kMaxJoints; ++j) input->joint_effort[j] = recorded.joint_effort[j];
  }
  // There is no motor: what it would do is in the output.
  void DriveJoint(int /*joint*/, const vm::JointCommand& /*command*/) override {}

  vm::TickInput recorded;
  int longest = 0;

 private:
  const vm::Firmware* firmware_ = nullptr;
  int docked_ = 0;
};

vm::VerifiedProgram program;
vm::VerifiedKinematics kinematics;
vm::VmState state;
Machine machine;
alignas(vm::Firmware) uint8_t firmware_place[sizeof(vm::Firmware)];
// Only for the exchange with the host.
uint8_t bytes[6000];
vm::NeighbourMessage message;

bool Machine::NextRecorded(int file, const vm::VerifiedKinematics& type) {
  uint16_t size = 0;
  if (read(file, &size, 2) != 2 || size > sizeof bytes || read(file, bytes, size) != size) {
    return false;
  }
  test::ByteReader reader(bytes);
  return test::GetInput(&reader, type.num_joints(), type.num_connectors(), &message, 1, &recorded);
}

bool Load() {
  vm::VerifyError error = vm::Verifier::Verify(
      program_image, static_cast<uint32_t>(program_image_end - program_image), &program);
  if (error.message == nullptr) {
    error = vm::VerifyKinematics(kinematics_image,
                                 static_cast<uint32_t>(kinematics_image_end - kinematics_image),
                                 &kinematics);
  }
  if (error.message != nullptr) printf("refused: %s\n", error.message);
  return error.message == nullptr;
}

int Run() {
  const int in = open("input.bin", O_RDONLY), config_file = open("config.bin", O_RDONLY);
  const int out = open("output.bin", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (in < 0 || out < 0 || read(config_file, bytes, sizeof bytes) <= 0) {
    return printf("files are missing\n"), 1;
  }
  vm::VmConfig config;
  test::ByteReader reader(bytes);
  test::GetConfig(&reader, &config);
  if (!Load() || !machine.NextRecorded(in, kinematics)) return 1;
  auto* firmware = new (firmware_place) vm::Firmware(config, kinematics, program, &state, &machine);
  machine.Start(firmware);
  firmware->Greet();
  int ticks = 0;
  do {
    while (!machine.TickIsDue()) firmware->Listen();
    firmware->Tick(machine.recorded.sim_time_us);
    if (firmware->tick() != machine.recorded.tick) return printf("out of step\n"), 1;
    test::ByteWriter writer(bytes + 2);
    test::PutOutput(firmware->output(), kinematics.num_joints(), &writer);
    const auto size = static_cast<uint16_t>(writer.size());
    memcpy(bytes, &size, 2);
    if (write(out, bytes, size + 2u) != size + 2) return printf("disk full\n"), 1;
    ++ticks;
  } while (machine.NextRecorded(in, kinematics));
  // The line stays until the neighbour has heard all, which it shows by its own last words.
  while (!machine.TickIsDue()) firmware->Listen();
  close(out);
  printf("ticks %d role %d firmware %u longest %d\n", ticks, firmware->output().status.role,
         static_cast<unsigned>(sizeof(vm::Firmware)), machine.longest);
  return 0;
}

}  // namespace

int main() { return Run(); }
