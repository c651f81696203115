#pragma once
// A simulator of one's own in the place of Bullet, or a real robot: behind the same messages.
//
// Library morphbus-bus. The function works in the thread of its caller. Units are SI. The world
// frame W has x north, y up and z east.

#include <morphbus/bus/address.h>
#include <morphbus/dynarole/program.h>
#include <morphbus/export.h>
#include <morphbus/model/model.h>
#include <morphbus/vm/joint_command.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace morphbus {

/// What one module senses. Joints and sensors are those of its type, in the order in which M3L
/// declares them.
struct ModuleReading {
  /// Of the joints: rad or m, rad/s or m/s, and N m or N. All three have an entry a joint.
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
  /// Of the sensors: a distance (m), 0 or 1 of a contact, three components of a tilt; one behind
  /// the other.
  std::vector<double> sensors;
};

/// A robot that moves. Modules are numbered as in Robot::modules. Its connections stay as the robot
/// has them.
class Simulator {
 public:
  virtual ~Simulator() = default;
  /// What a module senses now. Called once a tick for every module.
  virtual ModuleReading Sense(int module) = 0;
  /// The pose X_WL of a link, by its place in Robot::links, for logs, pictures and monitors;
  /// nothing where it is not known. Asked once a tick of the first link of every body.
  virtual std::optional<Pose> LinkPose(int /*link*/) { return std::nullopt; }
  /// What a module's joints shall do from now on, one entry a joint.
  virtual void Command(int module, std::span<const JointCommand> joints) = 0;
  /// Goes on by so many seconds: one tick.
  virtual void Step(double seconds) = 0;
};

/// How the run goes.
struct SimulationOptions {
  /// Sim time after which it ends (s); 0: when it is stopped.
  double seconds = 0;
  /// Times real time; 0: as fast as the members answer. A real robot needs 1.
  double speed = 0;
  /// The clock runs with the wall and waits for nobody, as a real robot's does.
  bool realtime = false;
  /// Whether the run has a logger (`morphbus log`), for which it waits.
  bool logger = true;
  /// Before the first tick: gives up after so many seconds in which nobody joined.
  double give_up_s = 60;
};

/// How it went.
struct SimulationResult {
  /// 32 hexadecimal digits over all messages that count.
  std::string hash;
  int64_t ticks = 0;
  /// Why it ended: "finished" if nothing else.
  std::string reason;
};

/// Takes the simulator's part in a run, as `morphbus sim` does, until it is over. Throws Failure
/// where the bus or the key cannot be had, a reading is of the wrong size, or the run fails; and
/// what the simulator throws.
/// @param stop  if not null, looked at some times a second: true ends the run at its next tick.
MORPHBUS_EXPORT SimulationResult Simulate(const Robot& robot, const Program& program,
                                          const RunAddress& address, Simulator* simulator,
                                          const SimulationOptions& options = {},
                                          const std::atomic<bool>* stop = nullptr);

}  // namespace morphbus
