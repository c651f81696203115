#pragma once
// Runs verified functions as tasks. Pure: all effects go through ProgramHost. Nothing is checked
// that the verifier has proved (vm/image/verifier.h): types, depths, indices and targets.

#include <cstdint>

#include "vm/image/fault.h"
#include "vm/image/opcodes.h"
#include "vm/image/program.h"

namespace morphbus::vm {

/// What an operation with an effect tells the interpreter, which then goes on, waits or faults.
struct OpResult {
  /// The fault that ends the task, unless it is kNone.
  FaultCode fault = FaultCode::kNone;
  /// True if the task must wait; the host has recorded for what.
  bool wait = false;
};

/// The services of a module that instructions use. Implemented by ModuleServices
/// (vm/role/module_services.h) and by fakes in tests. Angles in degrees, as in the language;
/// joints, links, connectors are own indices.
class ProgramHost {
 public:
  // Structure.
  /// The connectors, as a mask over the own ones, whose neighbours lie towards d (kAny: all).
  virtual uint32_t Connected(Direction d) = 0;
  /// Those of them whose neighbours play the role or one that extends it.
  virtual uint32_t ConnectedRole(Direction d, int role) = 0;
  /// The number of distinct modules at the connectors of the mask.
  virtual int CountModules(uint32_t connector_mask) = 0;
  /// The own joints, as a mask, along an axis and with so many adjacent joints.
  virtual uint32_t Joints(Axis axis, int adjacent) = 0;
  /// The own links, as a mask, that so many joints touch.
  virtual uint32_t Links(int degree) = 0;
  /// Axis along which the joint lies now, to 15 degrees; kAny if along none.
  virtual Axis JointAxis(int joint) = 0;
  /// Orientation of the only joint of a one-joint module; kAny where that fails.
  virtual Axis CenterAxis() = 0;
  /// The own index of what a keyword names; -1 if the module type lacks it.
  virtual int Keyword(int keyword) = 0;

  // Motion under the convention of setJointAxis.
  /// From now on positive values turn the link about the axis.
  virtual OpResult SetJointAxis(int joint, int link, Axis axis) = 0;
  /// Turns by, or to, so many degrees; `blocking` makes the task wait until the joint has arrived.
  virtual OpResult RotateDegrees(int joint, float degrees, bool blocking) = 0;
  virtual OpResult SetDegrees(int joint, float degrees, bool blocking) = 0;
  /// Where the joint is now.
  virtual OpResult JointDegrees(int joint, float* degrees) = 0;
  /// What the joint's motor exerts: N m, of a prismatic joint N.
  virtual OpResult JointEffort(int joint, float* effort) = 0;
  /// How fast the joint moves: degrees a second, of a prismatic joint millimetres a second.
  virtual OpResult JointVelocity(int joint, float* velocity) = 0;
  /// Turns until told otherwise; 0 stops.
  virtual OpResult TurnContinuous(int joint, float degrees_per_s) = 0;
  /// Moves a prismatic joint by, or to, so much.
  virtual OpResult MoveMillimetres(int joint, float mm, bool blocking) = 0;
  virtual OpResult SetMillimetres(int joint, float mm, bool blocking) = 0;
  /// Where a prismatic joint is now.
  virtual OpResult JointMillimetres(int joint, float* mm) = 0;

  // Raw actuator and connector state.
  /// Target and reading in the actuator's own sign; never waits.
  virtual OpResult SetPosition(int joint, float degrees) = 0;
  virtual OpResult GetPosition(int joint, float* degrees) = 0;
  /// Sets a connector's state variable, named by a keyword; bools are 0 and 1.
  virtual OpResult SetConnectorState(int connector, int state_keyword, Cell value) = 0;
  /// The number of the value that it was set to last.
  virtual OpResult GetConnectorState(int connector, int state_keyword, int* value) = 0;
  /// Whether something is docked there.
  virtual bool Docked(int connector) = 0;

  // Sensors. A bool is 0 or 1.
  /// The reading of the own sensor of this kind that looks most nearly towards a direction; of
  /// contacts, whether any that looks there is touched. `keyword` names the kind in faults.
  virtual OpResult SensorTowards(SensorKind kind, int keyword, Direction d, float* value) = 0;
  /// Degrees by which R is turned about `axis` against gravity, from the first tilt sensor.
  virtual OpResult Tilt(Axis axis, float* degrees) = 0;
  /// The reading of the sensor that a keyword names, which must be of this kind.
  virtual OpResult SensorReading(SensorKind kind, int keyword, float* value) = 0;

  // Time, chance and other modules.
  /// The time of the root's clock at this tick; the own one's while no root has been heard.
  virtual int64_t RootTimeUs() = 0;
  /// Dockings between this module and the root.
  virtual int Hops() = 0;
  /// The number that stands for the module in messages.
  virtual int Id() = 0;
  /// Where the module is along an axis of R, by its first direction (north, up, east), in mm.
  virtual OpResult Place(Axis axis, float* mm) = 0;
  /// Degrees from north, counter-clockwise about up, of where the module's x axis points in R.
  virtual OpResult Heading(float* degrees) = 0;
  /// The next of the module's random numbers, from 0 up to, but not including, 1.
  virtual float Random() = 0;
  /// The task waits, at least until the next tick.
  virtual OpResult Sleep(int64_t duration_us) = 0;
  /// Sends an invocation of a role's command to all modules; never waits.
  virtual OpResult Invoke(int role, int command_slot, const Cell* arguments, int count) = 0;
  /// The same for the modules at the connectors of the mask only.
  virtual OpResult InvokeNear(uint32_t connector_mask, int role, int command_slot,
                              const Cell* arguments, int count) = 0;
  /// Of the connectors of the mask those whose module has told the shared fields of a role.
  virtual uint32_t Telling(uint32_t connector_mask, int role) = 0;
  /// Of the connectors of the mask all that the module is docked to which is on the first of them.
  virtual uint32_t FirstModule(uint32_t connector_mask) = 0;
  /// What the only module at the connectors of the mask has told of a shared field of a role.
  virtual OpResult NeighbourField(uint32_t connector_mask, int role, int field, Cell* value) = 0;
  /// Tells people a text of the program's constants, with its values; never waits.
  virtual OpResult Print(int text, const Cell* values, int count) = 0;

 protected:
  ~ProgramHost() = default;
};

/// One call of a function. Frames lie on the task's stack of calls, cells on its stack of values.
struct Frame {
  /// The function that runs in it.
  uint16_t function = 0;
  /// The index of the first cell of its locals.
  uint16_t base = 0;
  /// The byte offset within the function of the next instruction.
  uint32_t pc = 0;
};

/// A task's whole state; trivially copyable, part of VmState.
struct TaskState {
  /// The calls, the outermost first, and the locals and operands of all of them.
  Frame frames[kMaxCallDepth];
  Cell cells[kStackCells];
  /// The number of cells in use.
  uint16_t top = 0;
  /// The number of frames in use.
  uint8_t depth = 0;
};

/// What instructions see of the role they run under.
struct RoleContext {
  /// The role held, or the one that is being decided.
  int role = -1;
  /// The values of its fields; the verifier has proved that no slot lies beyond them.
  Cell* fields = nullptr;
  /// The resolved index of each label, -1 while it is unresolved.
  const int8_t* labels = nullptr;
};

/// How a run ended: only kFinished and kFaulted end the task. A task that is kWaiting or
/// kOutOfBudget goes on from where it is when RunTask is called again.
enum class RunStatus : uint8_t { kFinished, kWaiting, kOutOfBudget, kFaulted };

/// How a run ended, where, and with what.
struct RunResult {
  /// How it ended; the fields below are set as it says.
  RunStatus status = RunStatus::kFinished;
  FaultCode fault = FaultCode::kNone;
  /// The keyword that is missing, for kMissingKeyword.
  int16_t keyword = -1;
  /// How many joints or links fit where one is wanted, for kUnresolved; the number of the element,
  /// for kNoElement.
  int32_t num_found = 0;
  /// The function and the byte offset in it where the run faulted, waits or was preempted.
  uint16_t function = 0;
  uint32_t pc = 0;
  /// The value returned, if the task finished in a function that returns one.
  Cell value;
};

/// Prepares `task` to run `function` with its arguments.
void StartTask(const VerifiedProgram& program, int function, const Cell* arguments, int count,
               TaskState* task);

/// Runs until the task finishes, waits, faults, or `*budget` is used up, which is decremented by
/// what each instruction costs (vm/image/opcodes.def).
RunResult RunTask(const VerifiedProgram& program, const RoleContext& role, ProgramHost& host,
                  TaskState* task, int32_t* budget);

/// Runs a requirement or label function to its end at once. Waiting or running out of budget is a
/// fault; a label that matches none or several ends with kUnresolved.
RunResult Evaluate(const VerifiedProgram& program, int function, const RoleContext& role,
                   ProgramHost& host, int32_t* budget);

/// Runs a requirement function again, as Evaluate does, and tells what it compared: with `and` the
/// last comparison decided. For people who ask why a role does not fit.
Comparisons TraceComparisons(const VerifiedProgram& program, int function, const RoleContext& role,
                             ProgramHost& host, int32_t budget);

}  // namespace morphbus::vm
