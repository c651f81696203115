#pragma once
// Runs verified functions as tasks. Pure: all effects go through ProgramHost.

#include <cstdint>

#include "vm/program.h"

namespace morphbus::vm {

/// What an operation with an effect tells the interpreter.
struct OpResult {
  FaultCode fault = FaultCode::kNone;  ///< Ends the task unless kNone.
  bool wait = false;                   ///< The task waits; the host has recorded for what.
};

/// The services of a module that instructions use. Implemented by the VM (vm/vm.cc) and by fakes in
/// tests. Angles in degrees, as in the language; joints, links, connectors are own indices.
class ProgramHost {
 public:
  // Structure.
  virtual uint32_t Connected(Direction d) = 0;  ///< Mask over own connectors.
  virtual uint32_t ConnectedRole(Direction d, int role) = 0;
  virtual int CountModules(uint32_t connector_mask) = 0;  ///< Distinct modules in the set.
  virtual uint32_t Joints(Axis axis, int adjacent) = 0;   ///< Mask over own joints.
  virtual uint32_t Links(int degree) = 0;                 ///< Mask over own links.
  /// Axis along which the joint lies now, to 15 degrees; kAny if along none.
  virtual Axis JointAxis(int joint) = 0;
  /// Orientation of the only joint of a one-joint module; kAny where that fails.
  virtual Axis CenterAxis() = 0;
  virtual int Keyword(int keyword) = 0;  ///< Own index, -1 if the type lacks it.

  // Motion under the convention of setJointAxis.
  virtual OpResult SetJointAxis(int joint, int link, Axis axis) = 0;
  virtual OpResult RotateDegrees(int joint, float degrees, bool blocking) = 0;
  virtual OpResult SetDegrees(int joint, float degrees, bool blocking) = 0;
  virtual OpResult JointDegrees(int joint, float* degrees) = 0;
  virtual OpResult TurnContinuous(int joint, float degrees_per_s) = 0;
  virtual OpResult MoveMillimetres(int joint, float mm) = 0;

  // Raw actuator and connector state.
  virtual OpResult SetPosition(int joint, float degrees) = 0;
  virtual OpResult GetPosition(int joint, float* degrees) = 0;
  virtual OpResult SetConnectorState(int connector, int state_keyword, Cell value) = 0;

  // Time and other modules.
  virtual OpResult Sleep(int64_t duration_us) = 0;
  virtual OpResult Invoke(int role, int command_slot, const Cell* arguments, int count) = 0;

 protected:
  ~ProgramHost() = default;
};

struct Frame {
  uint16_t function = 0;
  uint16_t base = 0;  ///< First cell of its locals.
  uint32_t pc = 0;    ///< Byte offset within the function of the next instruction.
};

/// A task's whole state; trivially copyable, part of VmState.
struct TaskState {
  Frame frames[kMaxCallDepth];
  Cell cells[kStackCells];
  uint16_t top = 0;   ///< Cells in use.
  uint8_t depth = 0;  ///< Frames in use.
};

/// What instructions see of the role they run under.
struct RoleContext {
  int role = -1;
  Cell* fields = nullptr;          ///< num_fields of the role.
  const int8_t* labels = nullptr;  ///< Resolved index of each label, -1 while unresolved.
};

enum class RunStatus : uint8_t { kFinished, kWaiting, kOutOfBudget, kFaulted };

struct RunResult {
  RunStatus status = RunStatus::kFinished;
  FaultCode fault = FaultCode::kNone;
  uint16_t function = 0;  ///< Where it faulted, waits or was preempted.
  uint32_t pc = 0;
  Cell value;  ///< Return value when finished.
};

/// Prepares `task` to run `function` with its arguments.
void StartTask(const VerifiedProgram& program, int function, const Cell* arguments, int count,
               TaskState* task);

/// Runs until the task finishes, waits, faults, or `*budget` instructions are used up
/// (decremented).
RunResult RunTask(const VerifiedProgram& program, const RoleContext& role, ProgramHost& host,
                  TaskState* task, int32_t* budget);

/// Runs a requirement or label function to its end at once. Waiting or running out of budget is a
/// fault; a label that matches none or several ends with kUnresolved.
RunResult Evaluate(const VerifiedProgram& program, int function, const RoleContext& role,
                   ProgramHost& host, int32_t* budget);

}  // namespace morphbus::vm
