#include "vm/programs/program_changer.h"

#include "vm/image/verifier.h"

namespace morphbus::vm {

bool VerifyPackage(const uint8_t* bytes, uint32_t size, VerifiedProgram* program,
                   PackageHead* head) {
  // The image lies behind the head, in which the bytes say for which tick they are meant.
  Package package;
  if (!ReadPackage(bytes, size, &package)) return false;
  *head = package;
  return Verifier::Verify(package.image, package.image_size, program).message == nullptr;
}

void ProgramChanger::Begin() {
  program_ = &first_;
  relay_.Start(first_.hash());
}

bool ProgramChanger::Resume() {
  // The state comes from a file, so that nothing of it is taken for granted.
  if (!relay_.Sound()) return false;
  program_ = &first_;
  const uint8_t* running = relay_.running_image();
  if (running != first_.bytes()) {
    VerifiedProgram* placed = &placed_[1 - relay_.incoming_place()];
    if (Verifier::Verify(running, relay_.running_size(), placed).message != nullptr) return false;
    program_ = placed;
  }
  // What waited for its tick waits on.
  return !relay_.verified() || VerifyIncoming();
}

bool ProgramChanger::VerifyIncoming() {
  // Bytes from a neighbour are as untrusted as any: only the verifier makes a program of them.
  VerifiedProgram* placed = &placed_[relay_.incoming_place()];
  PackageHead head;
  if (!VerifyPackage(relay_.incoming_package(), relay_.incoming_size(), placed, &head)) {
    return false;
  }
  switch_tick_ = head.switch_tick;
  return PackageId(placed->hash(), head) == relay_.incoming_id();
}

void ProgramChanger::VerifyIfReady() {
  if (!relay_.ready()) return;
  // What is refused is remembered, as the neighbours go on offering it.
  VerifyIncoming() ? relay_.Keep() : relay_.Refuse();
}

void ProgramChanger::SwitchIfDue(int64_t tick, Vm* vm) {
  if (!relay_.verified()) return;
  // All modules go over in one tick of the root's clock; one that knows no root does not wait for
  // others.
  int64_t root_tick = 0;
  if (vm->RootTick(tick, &root_tick) && root_tick < switch_tick_) return;
  // The VM lets go of the old one.
  program_ = &placed_[relay_.incoming_place()];
  vm->ReplaceProgram(*program_);
  relay_.Accept();
}

void ProgramChanger::Tick(const TickInput& input, Vm* vm, TickOutput* output) {
  // The order matters: pieces that came in this tick may complete a program, which may be due, and
  // then runs already now.
  relay_.Receive(input);
  VerifyIfReady();
  SwitchIfDue(input.tick, vm);
  vm->Tick(input, output);
  relay_.Fill(&output->message);
}

bool ProgramChanger::Deploy(const uint8_t* package, uint32_t size, uint64_t id) {
  // Not into the place of what was verified, which a package that is refused shall not disturb.
  VerifiedProgram program;
  PackageHead head;
  if (size > relay_.capacity() || !VerifyPackage(package, size, &program, &head)) return false;
  const uint64_t actual = PackageId(program.hash(), head);
  if (id != 0 && id != actual) return false;
  relay_.Deploy(package, size, actual, head.number);
  return true;
}

}  // namespace morphbus::vm
