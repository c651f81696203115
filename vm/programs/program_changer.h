#pragma once
// The programs of one module: the one that runs, and the one that takes its place when it has come
// from a neighbour, or was deployed here, and its tick has come. For hosts and firmware alike.

#include <cstdint>

#include "vm/image/program.h"
#include "vm/spread/package.h"
#include "vm/spread/program_relay.h"
#include "vm/vm.h"

namespace morphbus::vm {

/// Verifies a package: its program, which refers to the bytes, and its head. False if the bytes are
/// no package, or if the verifier refuses the image.
bool VerifyPackage(const uint8_t* bytes, uint32_t size, VerifiedProgram* program,
                   PackageHead* head);

/// Feeds a relay and does what follows, around each tick of the VM.
class ProgramChanger {
 public:
  /// All that it is given outlives it. `state` is as made, before Begin, or saved, before Resume.
  ProgramChanger(const VerifiedProgram& first, RelayState* state, PackageStore* store)
      : first_(first), program_(&first), relay_(first.bytes(), first.size(), state, store) {}

  /// Begins with the first program, which is offered to the neighbours as the newest there is.
  void Begin();
  /// Goes on with the state and the store of an earlier one, whose packages are verified again.
  /// False if they cannot be of one.
  bool Resume();

  /// Computes a tick of the VM. Before it takes what the neighbours said of programs, and has a
  /// package verified that has come whole. Refused, it is remembered, so that it is not collected a
  /// second time. Then, if the tick of what was verified has come, the VM goes over to it. A module
  /// that has heard of no root has no clock to wait by, and no role to lose: it goes at once.
  /// Afterwards adds to the VM's message what this module says of programs.
  void Tick(const TickInput& input, Vm* vm, TickOutput* output);

  /// Hands a package to this module, from where it spreads; false if it is none that can run here,
  /// or not the one of this id (PackageId), of which 0 says nothing.
  bool Deploy(const uint8_t* package, uint32_t size, uint64_t id = 0);

  /// The program that runs now: the first one, or a later one.
  [[nodiscard]] const VerifiedProgram& program() const { return *program_; }
  /// Nothing has happened since Begin that another Begin would not give.
  [[nodiscard]] bool AsBegun() const { return program_ == &first_ && relay_.AsStarted(); }
  [[nodiscard]] const ProgramRelay& relay() const { return relay_; }

 private:
  /// Verifies what lies in the incoming place.
  bool VerifyIncoming();
  void VerifyIfReady();
  void SwitchIfDue(int64_t tick, Vm* vm);

  const VerifiedProgram& first_;
  const VerifiedProgram* program_;
  ProgramRelay relay_;
  /// The programs in the two places of the store, and when the one that was verified is to run.
  VerifiedProgram placed_[2];
  int64_t switch_tick_ = 0;
};

}  // namespace morphbus::vm
