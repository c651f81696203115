#pragma once
// The services that a module offers to the instructions of its program, over the VM's state. What
// each does is said in ProgramHost (vm/run/interpreter.h).

#include "vm/run/context.h"
#include "vm/run/interpreter.h"

namespace morphbus::vm {

/// Lives for one tick. An operation that fails reports its fault itself, with all that a person
/// needs, and tells the interpreter only the code.
class ModuleServices final : public ProgramHost {
 public:
  /// `context` outlives the services.
  explicit ModuleServices(Context* context) : context_(*context) {}

  /// The task whose instructions call from now on; nullptr for requirements and labels.
  void SetRunning(Task* task) { running_ = task; }
  /// True once after an operation has reported its fault itself, so that the scheduler does not
  /// report it again.
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

  // The services, in the order of ProgramHost, whose comments hold here too.
  uint32_t Connected(Direction d) override;
  uint32_t ConnectedRole(Direction d, int role) override;
  int CountModules(uint32_t connector_mask) override;
  uint32_t Joints(Axis axis, int adjacent) override;
  uint32_t Links(int degree) override;
  // The axis along which a joint, or the module's only joint, lies.
  Axis JointAxis(int joint) override;
  Axis CenterAxis() override;
  // What a keyword of the program stands for in this module.
  int Keyword(int keyword) override;
  // Motion under the convention of setJointAxis.
  OpResult SetJointAxis(int joint, int link, Axis axis) override;
  OpResult RotateDegrees(int joint, float degrees, bool blocking) override {
    return MoveBy(joint, degrees, true, blocking);
  }
  OpResult SetDegrees(int joint, float degrees, bool blocking) override;
  OpResult JointDegrees(int joint, float* degrees) override;
  OpResult JointEffort(int joint, float* effort) override;
  OpResult JointVelocity(int joint, float* velocity) override;
  OpResult TurnContinuous(int joint, float degrees_per_s) override;
  OpResult MoveMillimetres(int joint, float mm, bool blocking) override {
    return MoveBy(joint, mm, false, blocking);
  }
  OpResult SetMillimetres(int joint, float mm, bool blocking) override;
  OpResult JointMillimetres(int joint, float* mm) override;
  // The raw actuator, and the states of connectors.
  OpResult SetPosition(int joint, float degrees) override;
  OpResult GetPosition(int joint, float* degrees) override;
  OpResult SetConnectorState(int connector, int state_keyword, Cell value) override;
  OpResult GetConnectorState(int connector, int state_keyword, int* value) override;
  bool Docked(int connector) override;
  // Sensors.
  OpResult SensorTowards(SensorKind kind, int keyword, Direction d, float* value) override;
  OpResult Tilt(Axis axis, float* degrees) override;
  OpResult SensorReading(SensorKind kind, int keyword, float* value) override;
  // Time, chance and other modules.
  int64_t RootTimeUs() override;
  int Hops() override;
  int Id() override { return context_.config.module_id; }
  OpResult Place(Axis axis, float* mm) override;
  OpResult Heading(float* degrees) override;
  float Random() override;
  OpResult Sleep(int64_t duration_us) override;
  OpResult Invoke(int role, int command_slot, const Cell* arguments, int count) override;
  OpResult InvokeNear(uint32_t connector_mask, int role, int command_slot, const Cell* arguments,
                      int count) override;
  uint32_t Telling(uint32_t connector_mask, int role) override;
  uint32_t FirstModule(uint32_t connector_mask) override;
  OpResult NeighbourField(uint32_t connector_mask, int role, int field, Cell* value) override;
  OpResult Print(int text, const Cell* values, int count) override;

 private:
  /// True for a joint of the module's type that is not fixed.
  [[nodiscard]] bool Moves(int joint) const;
  /// True for a number of one of the type's connectors.
  [[nodiscard]] bool Exists(int connector) const;
  /// A mask of the connectors of the module's type.
  [[nodiscard]] uint32_t OwnConnectors() const {
    return (uint32_t{1} << context_.kinematics.num_connectors()) - 1;
  }
  /// Whether the module at a connector has told the shared fields of a role.
  [[nodiscard]] bool HasTold(int connector, int role) const;
  /// kNone if the joint can move as asked, by degrees (rotary) or by millimetres; else the fault.
  [[nodiscard]] FaultCode WhyNot(int joint, bool rotary) const;
  /// Moves to `sign` times `asked`, or by `by` from the present target, in degrees or millimetres;
  /// `blocking` lets the task wait until the joint has come to rest.
  OpResult MoveTo(int joint, double asked, double sign, bool blocking);
  OpResult MoveBy(int joint, float by, bool rotary, bool blocking);
  /// Remembers the call as the one that set the joint in motion, for faults that come later.
  void NoteCall(int joint);
  /// Sets a fault's place to the instruction that runs.
  void SetPlaceOfCall(Fault* fault) const;
  /// Reports a fault that does not end the task, with its place.
  void ReportHere(Fault fault);
  /// What an operation returns that reports a fault and does nothing.
  OpResult Refuse(const Fault& fault);
  /// The same for a fault about a joint.
  OpResult RefuseJoint(FaultCode code, int joint);

  /// What all parts of the VM share in this tick.
  Context& context_;
  /// The task that waits if an operation makes it wait; nullptr outside of tasks.
  Task* running_ = nullptr;
  /// See TakeReported.
  bool reported_ = false;
  /// See TakeReadRoles.
  bool read_roles_ = false;
};

}  // namespace morphbus::vm
