// A module on an emulated Cortex-M: the VM core with recorded inputs. Reads config.bin and
// input.bin of the folder that the emulator was started in, writes output.bin there, and says on
// the console how deep the stack was. Program and kinematics lie in flash (MORPHBUS_IMAGE_FILES).

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <new>

#include "test/micro/stack_paint.h"
#include "test/micro/tick_record.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"
#include "vm/vm.h"

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

/// As many neighbours as a module of the quadruped has.
constexpr int kNeighbours = 4;

/// Room for an object that is made when the program has begun, so that its first values take no
/// flash.
template <class T>
struct Place {
  alignas(T) uint8_t bytes[sizeof(T)];
  T* get() { return reinterpret_cast<T*>(bytes); }
};

// All that a module needs in RAM beside its stack, as docs/footprint.md lists it.
Place<vm::VerifiedProgram> program_place;
Place<vm::VerifiedKinematics> kinematics_place;
Place<vm::VmState> state_place;
Place<vm::TickInput> input_place;
Place<vm::TickOutput> output_place;
Place<vm::NeighbourMessage[kNeighbours]> messages_place;
Place<vm::Vm> vm_place;

// Only for the exchange with the host; a firmware has none of it.
__attribute__((section(".bss.exchange"))) uint8_t bytes[6000];

bool ReadExactly(int file, void* to, int size) {
  return read(file, to, static_cast<size_t>(size)) == size;
}

/// Verifies the images, into the places for what is kept of them.
__attribute__((noinline)) bool Load() {
  auto* program = new (program_place.bytes) vm::VerifiedProgram;
  auto* kinematics = new (kinematics_place.bytes) vm::VerifiedKinematics;
  vm::VerifyError error = vm::Verifier::Verify(
      program_image, static_cast<uint32_t>(program_image_end - program_image), program);
  if (error.message == nullptr) {
    error = vm::VerifyKinematics(kinematics_image,
                                 static_cast<uint32_t>(kinematics_image_end - kinematics_image),
                                 kinematics);
  }
  if (error.message != nullptr) {
    printf("refused: %s at %lu\n", error.message, static_cast<unsigned long>(error.offset));
  }
  return error.message == nullptr;
}

__attribute__((noinline)) void Tick(vm::Vm* vm) {
  vm->Tick(*input_place.get(), output_place.get());
}

int Replay() {
  const int in = open("input.bin", O_RDONLY);
  const int out = open("output.bin", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int config_file = open("config.bin", O_RDONLY);
  if (in < 0 || out < 0 || config_file < 0) return printf("files are missing\n"), 1;
  // Both images are verified once, on this machine.
  int depth = 0;
  test::PaintStack();
  if (!Load()) return 1;
  const int verify_stack = test::StackUsed(&depth);
  vm::VmConfig config;
  if (read(config_file, bytes, sizeof bytes) <= 0) return printf("config.bin is empty\n"), 1;
  test::ByteReader config_reader(bytes);
  test::GetConfig(&config_reader, &config);
  const vm::VerifiedKinematics& kinematics = *kinematics_place.get();
  auto* vm =
      new (vm_place.bytes) vm::Vm(config, kinematics, *program_place.get(), state_place.get());
  auto* input = new (input_place.bytes) vm::TickInput;
  vm::NeighbourMessage* messages = *messages_place.get();
  // A tick after the other, each with its size before it.
  int ticks = 0, tick_stack = 0;
  uint16_t size = 0;
  while (ReadExactly(in, &size, 2)) {
    if (size > sizeof bytes || !ReadExactly(in, bytes, size)) return printf("cut off\n"), 1;
    test::ByteReader reader(bytes);
    if (!test::GetInput(&reader, kinematics.num_joints(), kinematics.num_connectors(), messages,
                        kNeighbours, input)) {
      return printf("tick %d does not fit the profile\n", ticks), 1;
    }
    test::PaintStack();
    Tick(vm);
    const int used = test::StackUsed(&depth);
    if (used > tick_stack) tick_stack = used;
    test::ByteWriter writer(bytes + 2);
    test::PutOutput(*output_place.get(), kinematics.num_joints(), &writer);
    const auto written = static_cast<uint16_t>(writer.size());
    memcpy(bytes, &written, 2);
    if (write(out, bytes, writer.size() + 2u) != writer.size() + 2) return printf("disk full\n"), 1;
    ++ticks;
  }
  close(out);
  printf("ticks %d verify_stack %d tick_stack %d\n", ticks, verify_stack, tick_stack);
  printf("static state %u program %u kinematics %u input %u output %u messages %u vm %u\n",
         static_cast<unsigned>(sizeof state_place), static_cast<unsigned>(sizeof program_place),
         static_cast<unsigned>(sizeof kinematics_place), static_cast<unsigned>(sizeof input_place),
         static_cast<unsigned>(sizeof output_place), static_cast<unsigned>(sizeof messages_place),
         static_cast<unsigned>(sizeof vm_place));
  return 0;
}

}  // namespace

int main() { return Replay(); }
