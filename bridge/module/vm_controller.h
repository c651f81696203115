#pragma once
// The VM as what computes a module's ticks, with the program's way from module to module. This is
// the seam between the VM, which knows no messages, and the lockstep, which knows no programs.

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "bridge/lockstep/module/module_participant.h"
#include "bridge/module/package_memory.h"
#include "vm/programs/program_changer.h"
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

  /// Called at the end of every tick with what the module sensed and what it is about to do, which
  /// may be changed: for programs that drive joints themselves. It is not saved.
  void OnTick(std::function<void(const vm::TickInput& input, vm::TickOutput* output)> change) {
    change_ = std::move(change);
  }

  /// Begins anew under this incarnation, as a controller that was just made: with the program that
  /// it was made with, and without anything that it knew.
  void BeginAnew(uint32_t incarnation);

  /// The virtual machine itself, for asking why it has no role. It is another one after Load
  /// and BeginAnew.
  [[nodiscard]] vm::Vm& vm() { return *vm_; }
  /// All that the virtual machine knows.
  [[nodiscard]] const vm::VmState& state() const { return *state_; }
  /// The program that runs now: the first one, or a deployed one.
  [[nodiscard]] const vm::VerifiedProgram& program() const { return programs_.program(); }

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

  /// Makes the relay's state and the store as they are before anything has come.
  void ForgetPackages();

  // What the module is, and what its type is like. Neither is saved: a resumed process is told both
  // again, and the sim sees to it that they are the same.
  vm::VmConfig config_;
  const vm::VerifiedKinematics& kinematics_;
  // The VM and its whole state; what spreads programs and changes them, its state and its packages.
  std::unique_ptr<vm::VmState> state_;
  std::unique_ptr<vm::Vm> vm_;
  vm::RelayState relay_state_;
  PackageMemory packages_;
  vm::ProgramChanger programs_;
  Collected collected_;
  std::function<void(const vm::TickInput&, vm::TickOutput*)> change_;  ///< Called if set.
};

}  // namespace morphbus::bridge
