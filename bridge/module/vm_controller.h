#pragma once
// The VM as what computes a module's ticks, with the program's way from module to module. This is
// the seam between the VM, which knows no messages, and the lockstep, which knows no programs.

#include <cstdint>
#include <memory>
#include <vector>

#include "bridge/lockstep/module_participant.h"
#include "vm/spread/program_relay.h"
#include "vm/vm.h"

namespace morphbus::bridge {

/// Runs a verified program on the virtual machine, and replaces it when a new one has spread here
/// from a neighbour or was deployed from outside. Descriptions of the methods: ModuleController.
class VmController : public ModuleController {
 public:
  /// Starts the program at its beginning. Both images outlive the controller.
  VmController(const vm::VmConfig& config, const vm::VerifiedKinematics& kinematics,
               const vm::VerifiedProgram& program);
  ~VmController() override;

  // The methods of ModuleController. Save and Load hold the VM's state, the relay's (unless nothing
  // ever happened there) and what has come of a program from outside.
  void Tick(const vm::TickInput& input, vm::TickOutput* output) override;
  void TakePiece(const morphbus::deploy_piece_t& piece) override;
  std::vector<morphbus::status_t> Describe(const vm::StatusReport& report) override;
  void Save(std::vector<uint8_t>* out) override;
  bool Load(const uint8_t* data, size_t size) override;

  /// The virtual machine itself, for asking why it has no role. It is another one after Load.
  [[nodiscard]] vm::Vm& vm() { return *vm_; }
  /// The program that runs now: the first one, or a deployed one.
  [[nodiscard]] const vm::VerifiedProgram& program() const { return *program_; }

 private:
  /// Goes over to a program that has come whole from a neighbour, if the verifier accepts it;
  /// refused, it is remembered by version and hash, so that it is not collected a second time. The
  /// VM ends the role that it holds, and its joints hold their targets.
  void ReplaceIfReady();
  /// No program has been on its way here: the relay need not be saved. It holds two images, which
  /// is far more than all else together, and in most runs nothing ever happens there.
  [[nodiscard]] bool RelayIsPristine() const;

  // What the module is, and what its type is like. Neither changes, so neither is saved: a resumed
  // process is told both again, and the sim sees to it that they are the same.
  const vm::VmConfig config_;
  const vm::VerifiedKinematics& kinematics_;
  // The program that runs; replacement_ owns it once a new one has come.
  const vm::VerifiedProgram* program_;
  // The VM and its whole state; the relay that spreads programs and its own.
  std::unique_ptr<vm::VmState> state_;
  std::unique_ptr<vm::Vm> vm_;
  std::unique_ptr<vm::RelayState> relay_state_;
  // The relay's state is large, as it holds whole images; a copy of its beginning tells whether it
  // need be saved at all.
  vm::ProgramRelay relay_;
  std::vector<uint8_t> pristine_;  ///< relay_state_ without its images, as begun.
  std::unique_ptr<vm::VerifiedProgram> replacement_;  ///< Once a program was deployed.
  /// Hash of the program that pieces come of from outside.
  uint64_t deploy_hash_ = 0;
  /// What came of a program from outside: its bytes from the first one on, as pieces come in order.
  /// Empty once they were whole.
  std::vector<uint8_t> deploy_;
};

}  // namespace morphbus::bridge
