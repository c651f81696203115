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
/// from a neighbour or was deployed from outside, and the tick that its package names has come by
/// the root's clock. Descriptions of the methods: ModuleController.
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
  std::vector<morphbus::status_t> Describe(const vm::StatusReport& report, bool inspected) override;
  void Save(std::vector<uint8_t>* out) override;
  bool Load(const uint8_t* data, size_t size) override;

  /// Begins anew under this incarnation, as a controller that was just made: with the program that
  /// it was made with, and without anything that it knew.
  void BeginAnew(uint32_t incarnation);

  /// The virtual machine itself, for asking why it has no role. It is another one after Load
  /// and BeginAnew.
  [[nodiscard]] vm::Vm& vm() { return *vm_; }
  /// All that the virtual machine knows.
  [[nodiscard]] const vm::VmState& state() const { return *state_; }
  /// The program that runs now: the first one, or a deployed one.
  [[nodiscard]] const vm::VerifiedProgram& program() const { return *program_; }

 private:
  /// A package that pieces come of from outside.
  struct Collected {
    /// Of the package; 0 before the first one.
    uint64_t id = 0;
    /// Its bytes, those that have not come yet 0, and for each piece 1 if it has come. Empty once
    /// it was whole, so that pieces of it that come again begin nothing.
    std::vector<uint8_t> bytes, have;
    uint64_t missing = 0;
  };

  /// Has a package verified that has come whole. Refused, it is remembered, so that it is not
  /// collected a second time; the program that runs goes on.
  void HoldIfReady();
  /// Goes over to the program that is held if its tick has come, `tick` being the one to compute. A
  /// module that has heard of no root has no clock to wait by, and no role to lose: it goes at
  /// once.
  void ReplaceIfDue(int64_t tick);
  /// Offers the program that the module was started with to the neighbours.
  void StartRelay();
  /// No program has been on its way here: the relay need not be saved. It holds two images, which
  /// is far more than all else together, and in most runs nothing ever happens there.
  [[nodiscard]] bool RelayIsAsBegun() const;

  // What the module is, and what its type is like. Neither is saved: a resumed process is told both
  // again, and the sim sees to it that they are the same.
  vm::VmConfig config_;
  const vm::VerifiedKinematics& kinematics_;
  // The program that the controller was made with, and the one that runs; replacement_ owns that
  // once a new one has come.
  const vm::VerifiedProgram& first_program_;
  const vm::VerifiedProgram* program_;
  // The VM and its whole state; the relay that spreads programs and its own.
  std::unique_ptr<vm::VmState> state_;
  std::unique_ptr<vm::Vm> vm_;
  std::unique_ptr<vm::RelayState> relay_state_;
  // The relay's state is large, as it holds whole images.
  vm::ProgramRelay relay_;
  std::unique_ptr<vm::VerifiedProgram> replacement_;  ///< Once a program was deployed.
  /// What the relay holds, verified, and when it is to run; null without one.
  std::unique_ptr<vm::VerifiedProgram> next_;
  vm::PackageHead next_head_;
  Collected collected_;
};

}  // namespace morphbus::bridge
