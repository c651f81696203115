#pragma once
// The loop of a module's firmware around the VM; docs/porting.md walks through it. No heap.

#include "vm/port/frame.h"
#include "vm/port/message_pool.h"
#include "vm/programs/program_changer.h"
#include "vm/vm.h"

namespace morphbus::vm {

/// The module that speaks on a connector's link, by the frames that come there.
struct LinkedNeighbour {
  bool heard = false;        ///< Whether there ever was one. The others are those of the last.
  uint16_t module = 0;       ///< Its VmConfig::module_id.
  uint8_t connector = 0;     ///< Its connector, by number in its type.
  int64_t silent_ticks = 0;  ///< How many ticks have begun since its last frame.
};

/// What a module's electronics give: a link per connector, connectors, joints. Units and frames are
/// those of vm/module_api.h; `connector` and `joint` are numbers in the module's type.
class Hardware {
 public:
  /// Takes up to `capacity` bytes that have come on a connector's link; how many. Never waits.
  virtual int Receive(int connector, uint8_t* bytes, int capacity) = 0;
  /// Sends all bytes, or, if the link has no room, none; what is lost is said anew next tick.
  virtual void Send(int connector, const uint8_t* bytes, int size) = 0;
  /// What is docked here and how: from sensors, or from `neighbour` and a table, or both.
  virtual ConnectorReading ReadConnector(int connector, const LinkedNeighbour& neighbour) = 0;
  /// Where a joint is and how it moves, as in TickInput.
  virtual void ReadJoint(int joint, double* position, double* velocity) = 0;
  /// What a joint's actuator does from now on until it is told again.
  virtual void DriveJoint(int joint, const JointCommand& command) = 0;
  /// What only some modules have: sensors, also of efforts, a root's pose, what a person asks for.
  /// The last two are of one tick, the others stay until they are written again.
  virtual void ReadSensors(TickInput* /*input*/) {}
  /// And hooks to extend.
  virtual void DriveConnector(const ConnectorCommand& /*command*/) {}

 protected:
  ~Hardware() = default;
};

/// One module. It is large (sizeof) and belongs into static memory.
class Firmware {
 public:
  /// All that it is given must outlive it. `state` is begun anew. `packages` keeps programs that
  /// come later; without, the first one runs for ever.
  Firmware(const VmConfig& config, const VerifiedKinematics& kinematics,
           const VerifiedProgram& program, VmState* state, Hardware* hardware,
           PackageStore* packages = nullptr);

  /// May say on all links which module is here, so that it is known before the first tick.
  void Greet() { SendAll(0); }
  /// Takes in what has come on the links. To be called so often that their buffers do not overflow.
  void Listen();
  /// Computes a tick: senses, runs the VM, drives, sends. To be called once a control period;
  /// `time_us` counts from any moment and does not go back.
  void Tick(int64_t time_us);

  /// Hands a package (vm/spread/package.h) to this module to spread; false if it cannot run here.
  bool Deploy(const uint8_t* package, uint32_t size) { return programs_.Deploy(package, size); }
  /// The program that runs now.
  [[nodiscard]] const VerifiedProgram& program() const { return programs_.program(); }
  /// The last tick computed, by the root's clock; false without a root.
  [[nodiscard]] bool RootTick(int64_t* tick) const { return vm_.RootTick(input_.tick, tick); }

  /// The last tick computed; -1 before the first.
  [[nodiscard]] int64_t tick() const { return input_.tick; }
  /// By how many ticks the newest message heard is ahead of tick(). While it is above 0 right after
  /// Tick(), the module's clock is behind: shorter periods mend that. Far behind, it leaps.
  [[nodiscard]] int64_t lag() const { return heard_tick_ - input_.tick; }
  /// All that the VM said in it: role, faults and prints are for a console, where there is one.
  [[nodiscard]] const TickOutput& output() const { return output_; }
  [[nodiscard]] const LinkedNeighbour& neighbour(int connector) const {
    return neighbours_[connector];
  }

 private:
  /// Takes the frame that was found on a connector.
  void Hear(int connector);
  /// Sends what lies in frame_: a packet of that size, or a greeting if it is 0.
  void SendAll(int packet_size);

  const VerifiedKinematics& kinematics_;
  const uint16_t module_;
  Hardware& hardware_;
  Vm vm_;
  NoPackages no_packages_;
  RelayState relay_state_;
  ProgramChanger programs_;
  TickInput input_;
  TickOutput output_;
  int64_t heard_tick_ = -1;  ///< The newest tick that any neighbour spoke of.
  // By connector: which module is there, and what has come of a frame; what input_ points to.
  LinkedNeighbour neighbours_[kMaxConnectors];
  FrameReader readers_[kMaxConnectors];
  MessagePool pool_;
  uint8_t frame_[kMaxFrameBytes];  ///< The frame that is sent.
};

}  // namespace morphbus::vm
