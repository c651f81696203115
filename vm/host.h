#pragma once
// The services of a module that instructions use, over the VM's state.

#include "vm/context.h"
#include "vm/interpreter.h"

namespace morphbus::vm {

class Host final : public ProgramHost {
 public:
  explicit Host(Context* context) : context_(*context) {}

  /// The task whose instructions call from now on; nullptr for requirements and labels.
  void SetRunning(Task* task) { running_ = task; }
  /// True once after an operation has reported its fault itself, with more than its code.
  bool TakeReported() {
    const bool reported = reported_;
    reported_ = false;
    return reported;
  }

  /// True if neighbours' roles have been asked for since the last call.
  bool TakeReadRoles() {
    const bool read = read_roles_;
    read_roles_ = false;
    return read;
  }

  uint32_t Connected(Direction d) override;
  uint32_t ConnectedRole(Direction d, int role) override;
  int CountModules(uint32_t connector_mask) override;
  uint32_t Joints(Axis axis, int adjacent) override;
  uint32_t Links(int degree) override;
  Axis JointAxis(int joint) override;
  Axis CenterAxis() override;
  int Keyword(int keyword) override;
  OpResult SetJointAxis(int joint, int link, Axis axis) override;
  OpResult RotateDegrees(int joint, float degrees, bool blocking) override;
  OpResult SetDegrees(int joint, float degrees, bool blocking) override;
  OpResult JointDegrees(int joint, float* degrees) override;
  OpResult TurnContinuous(int joint, float degrees_per_s) override;
  OpResult MoveMillimetres(int joint, float mm) override;
  OpResult SetPosition(int joint, float degrees) override;
  OpResult GetPosition(int joint, float* degrees) override;
  OpResult SetConnectorState(int connector, int state_keyword, Cell value) override;
  OpResult Sleep(int64_t duration_us) override;
  OpResult Invoke(int role, int command_slot, const Cell* arguments, int count) override;

 private:
  [[nodiscard]] bool IsJoint(int joint) const;
  [[nodiscard]] bool Turns(int joint) const;
  OpResult MoveTo(int joint, double target, bool blocking);
  void ReportHere(Fault fault);

  Context& context_;
  Task* running_ = nullptr;
  bool reported_ = false;
  bool read_roles_ = false;
};

}  // namespace morphbus::vm
