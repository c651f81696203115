#pragma once
// The virtual machine of one module (docs/vm.md), for hosts of one's own: without a bus, a
// simulator or a clock. Who calls it gives it what the module senses and what its neighbours said,
// tick by tick.
//
// Library morphbus-vm. A machine belongs to one thread at a time. Equal inputs give equal outputs.
// Units are SI; joints, sensors and connectors are those of the module's type, in the order in
// which M3L declares them. Firmware compiles the machine itself, which needs no library
// (docs/porting.md).

#include <morphbus/dynarole/program.h>
#include <morphbus/export.h>
#include <morphbus/model/model.h>
#include <morphbus/vm/joint_command.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace morphbus {

/// What a connector's sensor says, and what came from there.
struct ConnectorInput {
  bool docked = false;
  /// The place in Robot::modules of the module that it is docked to, and of the connector in that
  /// one's type.
  int mate_module = 0;
  int mate_connector = 0;
  /// The place of the connection in Model::connection_types, and its number with this module as the
  /// first one.
  int connection_type = 0;
  int number = 0;
  /// True where it can be told with this module as the second one only; then the number is that.
  /// May be left false: the machine then looks for both.
  bool is_second = false;
  /// What the neighbour's machine returned a tick ago (VmOutput::message); empty if nothing came.
  std::string message;
};

/// What a module senses and hears in one tick.
struct VmInput {
  /// From 0, one more every time.
  int64_t tick = 0;
  double time_s = 0;
  /// Of the joints: rad or m, per second, N m or N.
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
  /// Of the sensors, one behind the other; as many as VirtualMachine::num_sensor_values.
  std::vector<double> sensors;
  std::vector<ConnectorInput> connectors;
};

/// What a module does and says in one tick.
struct VmOutput {
  /// One for each joint.
  std::vector<JointCommand> joints;
  /// What all neighbours must be told before their next tick; bytes that only a machine reads.
  std::string message;
  /// The role that it plays; empty while it has none. Labels, with the links and joints that they
  /// name
  /// ("knee", "joint_1").
  std::string role;
  std::vector<std::pair<std::string, std::string>> labels;
  /// Whether the module knows where it is in the robot frame, and the poses X_RL of its links if
  /// so.
  bool has_pose = false;
  std::vector<Pose> X_RL;
  /// Faults of this tick, each a sentence, and lines that the program printed.
  std::vector<std::string> faults;
  std::vector<std::string> prints;
};

/// The virtual machine of one module.
class MORPHBUS_EXPORT VirtualMachine {
 public:
  /// Of a module of this robot, by its place in Robot::modules. The machine is told the type and
  /// the number of its module, and nothing of the robot; but that of the module which carries the
  /// robot frame knows where it starts, and tells the others. Throws Failure where there is no such
  /// module, or its type has more of something than a machine can hold.
  VirtualMachine(const Robot& robot, const Program& program, int module, uint64_t random_seed = 1);
  ~VirtualMachine();
  VirtualMachine(VirtualMachine&& other) noexcept;
  VirtualMachine& operator=(VirtualMachine&& other) noexcept;

  /// Computes one tick. Throws Failure, and has computed nothing, for inputs of the wrong sizes or
  /// messages that are damaged.
  VmOutput Tick(const VmInput& input);
  /// An input of the right sizes: all at rest, connectors as the robot has them, nothing heard.
  [[nodiscard]] VmInput InputAtRest() const;
  [[nodiscard]] int num_sensor_values() const;

  /// The whole state. A machine of the same module, program and version of Morphbus goes on from it
  /// with the same outputs.
  [[nodiscard]] std::string Save() const;
  /// Goes on from what Save returned. Throws Failure for other bytes; the machine is of no use
  /// then.
  void Load(std::string_view state);

 private:
  class Content;
  std::unique_ptr<Content> content_;
};

}  // namespace morphbus
