#pragma once
// The VM as what computes a module's ticks, with the program's way from module to module.

#include <cstdint>
#include <memory>
#include <vector>

#include "bridge/module_party.h"
#include "vm/program_relay.h"
#include "vm/vm.h"

namespace morphbus::bridge {

class VmBrain : public ModuleBrain {
 public:
  /// Both images outlive the brain.
  VmBrain(const vm::VmConfig& config, const vm::VerifiedKinematics& kinematics,
          const vm::VerifiedProgram& program);
  ~VmBrain() override;

  void Tick(const vm::TickInput& input, vm::TickOutput* output) override;
  void TakePiece(const morphbus::deploy_piece_t& piece) override;
  std::vector<morphbus::status_t> Describe(const vm::StatusReport& report) override;
  void Save(std::vector<uint8_t>* out) override;
  bool Load(const uint8_t* data, size_t size) override;

  /// The program that runs now: the first one, or a deployed one.
  [[nodiscard]] const vm::VerifiedProgram& program() const { return *program_; }

 private:
  void ReplaceIfReady();
  [[nodiscard]] bool RelayIsPristine() const;

  const vm::VmConfig config_;
  const vm::VerifiedKinematics& kinematics_;
  const vm::VerifiedProgram* program_;
  std::unique_ptr<vm::VmState> state_;
  std::unique_ptr<vm::Vm> vm_;
  std::unique_ptr<vm::RelayState> relay_state_;
  vm::ProgramRelay relay_;
  std::vector<uint8_t> pristine_;  ///< relay_state_ without its images, as begun.
  std::unique_ptr<vm::VerifiedProgram> replacement_;  ///< Once a program was deployed.
  uint64_t deploy_hash_ = 0;
  std::vector<uint8_t> deploy_;  ///< What came of a program from outside.
};

}  // namespace morphbus::bridge
