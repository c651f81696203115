// The firmware of a module with a clock of its own, on an emulated board (test/micro/board.h). Two
// machines with it, which are switched on at different moments and joined by a line that damages
// and loses bytes, are a robot of two modules (test/micro/clock_line.py). Its joints are simple
// models of servos. Of the host's run it knows only what a sensor would say of how the modules are
// docked. The root is handed a new program, which is in its flash, once both are in step.

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <new>

#include "test/micro/board.h"
#include "test/micro/flash_pages.h"
#include "test/micro/servo.h"
#include "test/micro/stack_paint.h"
#include "test/micro/story.h"
#include "test/micro/tick_record.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"
#include "vm/port/firmware.h"

using namespace morphbus;

// The images, which the VM reads straight out of the flash, and the program that comes later.
__asm__(
    ".section .rodata.images\n"
    ".global program_image\nprogram_image:\n.incbin \"image.bin\"\nprogram_image_end:\n"
    ".global program_image_end\n"
    ".balign 4\n"
    ".global kinematics_image\nkinematics_image:\n.incbin \"kinematics.bin\"\n"
    ".global kinematics_image_end\nkinematics_image_end:\n"
    ".global later_image\nlater_image:\n.incbin \"later.bin\"\n"
    ".global later_image_end\nlater_image_end:\n"
    ".text\n");
extern "C" const uint8_t program_image[], program_image_end[];
extern "C" const uint8_t kinematics_image[], kinematics_image_end[];
extern "C" const uint8_t later_image[], later_image_end[];

namespace {

constexpr int64_t kPeriodUs = 40000;
/// A neighbour that is silent for so many ticks is taken to be gone.
constexpr int kGoneTicks = 25;
/// Ticks between a deployment and its switch: more than the pieces need on a line that loses some,
/// and a host that is busy.
constexpr int64_t kSpreadTicks = 150;

/// The electronics: a UART for the connector that is docked, servos that go where they are told.
class Board final : public vm::Hardware {
 public:
  void Start(const vm::TickInput& sensed) {
    while (docked_ < vm::kMaxConnectors && !sensed.connectors[docked_].docked) ++docked_;
    sensed_ = sensed.connectors[docked_];
    uart_.Start();
  }
  int Receive(int connector, uint8_t* bytes, int capacity) override {
    int count = 0;
    while (connector == docked_ && count < capacity && uart_.Get(bytes + count)) ++count;
    if (connector == docked_ && count == 0) test::LetLineMoveOn();
    return count;
  }
  void Send(int connector, const uint8_t* bytes, int size) override {
    for (int i = 0; i < size && connector == docked_; ++i) uart_.Put(bytes[i]);
  }
  vm::ConnectorReading ReadConnector(int connector, const vm::LinkedNeighbour& neighbour) override {
    if (connector != docked_ || !neighbour.heard || neighbour.silent_ticks > kGoneTicks) return {};
    vm::ConnectorReading reading = sensed_;
    reading.mate_module = neighbour.module;
    reading.mate_connector = neighbour.connector;
    return reading;
  }
  void ReadJoint(int joint, double* position, double* velocity) override {
    servos[joint].Move(1e-6 * static_cast<double>(kPeriodUs), position, velocity);
  }
  void DriveJoint(int joint, const vm::JointCommand& command) override {
    servos[joint].command = command;
  }

  test::Servo servos[vm::kMaxJoints];

 private:
  test::Uart uart_;
  int docked_ = 0;
  vm::ConnectorReading sensed_;
};

vm::VerifiedProgram program;
vm::VerifiedKinematics kinematics;
vm::VmState state;
Board board;
test::SysTick clock;
test::FlashPages packages;
alignas(vm::Firmware) uint8_t firmware_place[sizeof(vm::Firmware)];
// Only for the exchange with the host, and for the program that it would load.
__attribute__((section(".bss.exchange"))) uint8_t bytes[1024];

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

/// The configuration, and how the board is docked in the first recorded tick in which it is.
bool Configure(vm::VmConfig* config) {
  const int in = open("input.bin", O_RDONLY), file = open("config.bin", O_RDONLY);
  if (in < 0 || read(file, bytes, sizeof bytes) <= 0) return false;
  test::ByteReader config_reader(bytes);
  test::GetConfig(&config_reader, config);
  config->grace_ticks = 3;
  uint16_t size = 0;
  if (read(in, &size, 2) != 2 || size > sizeof bytes || read(in, bytes, size) != size) return false;
  // The firmware does not exist yet, and its place has room for what is read only here.
  auto* message = new (firmware_place) vm::NeighbourMessage;
  auto* input = new (firmware_place + sizeof(vm::NeighbourMessage)) vm::TickInput;
  test::ByteReader reader(bytes);
  if (!test::GetInput(&reader, kinematics.num_joints(), kinematics.num_connectors(), message, 1,
                      input)) {
    return false;
  }
  board.Start(*input);
  return true;
}

/// Hands the later program to this module, to run at a tick to come.
bool Deploy(vm::Firmware* firmware) {
  const auto size = static_cast<uint32_t>(later_image_end - later_image);
  if (vm::kPackageHeadBytes + size > sizeof bytes) return false;
  vm::WritePackageHead({.switch_tick = firmware->tick() + kSpreadTicks, .number = 0}, bytes);
  memcpy(bytes + vm::kPackageHeadBytes, later_image, size);
  printf("deployed %ld\n", static_cast<long>(firmware->tick() + kSpreadTicks));
  return firmware->Deploy(bytes, vm::kPackageHeadBytes + size);
}

/// What a firmware's own main program does, for ever: the host switches the machine off.
int Run() {
  int depth = 0;
  test::PaintStack();
  vm::VmConfig config;
  if (!Load() || !Configure(&config)) return printf("files are missing\n"), 1;
  auto* firmware =
      new (firmware_place) vm::Firmware(config, kinematics, program, &state, &board, &packages);
  clock.Start();
  firmware->Greet();
  test::Story story(program);
  bool deployed = false, told = false;
  // The clock of the module that is no root is three percent slow.
  const int64_t period_us = config.is_root ? kPeriodUs : kPeriodUs * 103 / 100;
  int64_t next_us = 0;
  for (;;) {
    firmware->Listen();
    const int64_t now_us = clock.Microseconds();
    if (now_us < next_us) continue;
    const int64_t before = firmware->tick();
    firmware->Tick(now_us);
    next_us += period_us;
    // Whoever is behind a little hurries.
    if (firmware->lag() > 0) next_us -= kPeriodUs / 20;
    story.Note(*firmware, before);
    if (config.is_root && !deployed && story.HasSettled()) {
      deployed = true;
      if (!Deploy(firmware)) return printf("not deployed\n"), 1;
    }
    if (told || !story.IsOver()) continue;
    told = true;
    const int stack = test::StackUsed(&depth);
    story.Tell(*firmware, board.servos, packages);
    printf("static firmware %u state %u program %u kinematics %u stack %d\ndone\n",
           static_cast<unsigned>(sizeof firmware_place), static_cast<unsigned>(sizeof state),
           static_cast<unsigned>(sizeof program), static_cast<unsigned>(sizeof kinematics), stack);
  }
}

}  // namespace

int main() { return Run(); }
