#pragma once
// A controller of one's own for a module, on the bus beside the virtual machines of the others.
//
// Library morphbus-bus. The functions work in the thread of their caller; several modules of one
// process need a thread each. Units are SI.

#include <morphbus/bus/address.h>
#include <morphbus/dynarole/program.h>
#include <morphbus/export.h>
#include <morphbus/model/model.h>
#include <morphbus/vm/joint_command.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace morphbus {

/// What a module knows at a tick. Joints, sensors and connectors are those of its type, in the
/// order in which M3L declares them.
struct ModuleTick {
  int64_t tick = 0;
  /// Sim time since the run's start (s).
  double time_s = 0;
  /// Measured values of the joints (rad or m, per second), and what their motors exert (N m or N).
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
  /// What the sensors measure: of a distance sensor a distance (m), of a contact sensor 0 or 1, of
  /// a tilt sensor the three components of the direction that points up; one behind the other.
  std::vector<double> sensors;
  /// Whether each connector is mated.
  std::vector<bool> docked;
  /// The role that the program gives the module; empty while it has none.
  std::string role;
};

/// What drives the joints of one module. A virtual machine with the run's program goes on in the
/// module all the same: it finds the module's role, passes poses and calls on to the neighbours,
/// and proposes what the joints shall do.
class ModuleController {
 public:
  virtual ~ModuleController() = default;
  /// Called once a tick, in order; in lockstep the run waits for it. What it throws ends the
  /// module's part in the run.
  /// @param joints  one for each joint: what the program says, and on return what is done.
  virtual void Tick(const ModuleTick& now, std::vector<JointCommand>* joints) = 0;
};

/// Takes a module's part in a run, as `morphbus module` does, until the run is over. Returns why it
/// ended. Throws Failure where the robot has no such module, the bus or the key cannot be had, or
/// the run fails or is silent for ten seconds; and what the controller throws.
/// @param robot    whose model and program must be those of the run.
/// @param stop     if not null, looked at some times a second: true ends the module's part. Another
///                 thread or a signal handler may set it.
MORPHBUS_EXPORT std::string DriveModule(const Robot& robot, const Program& program,
                                        const std::string& module, const RunAddress& address,
                                        ModuleController* controller,
                                        const std::atomic<bool>* stop = nullptr);

}  // namespace morphbus
