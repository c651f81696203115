#pragma once
// A robot of VMs in one process, without a bus: sensors from an ideal world, messages handed from
// module to module with losses, repeats and delays on demand. Deterministic for a given seed.

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/robot_model.h"
#include "vm/image/kinematics_encoder.h"
#include "vm/vm.h"

namespace morphbus::test {

/// Tables of a module type as the compiler makes them.
vm::KinematicsTables TablesOf(const model::Model& model, int module_type);

/// Single-precision copy of a pose.
vm::PoseF ToFloat(const model::Pose& X);

/// A program image without roles.
std::vector<uint8_t> EmptyProgram();

struct VmRobotOptions {
  int root = -1;    ///< Module that is the root; -1: the robot's own.
  double loss = 0;  ///< Chance that a message does not arrive, per receiver and tick.
  double late = 0;  ///< Chance that an older message arrives in its place.
  uint64_t seed = 1;
  bool instant_servo = false;  ///< Joints jump to their targets; else they move at their speed.
  uint16_t grace_ticks = 0;
  int64_t tick_us = 20000;
  bool tells_member = true;  ///< Sensors say ConnectorReading::is_member_b.
  /// Kinematics of each module type in C; empty: images.
  std::vector<const morphbus_kinematics*> tables;
};

class VmRobot {
 public:
  struct FaultEvent {
    int64_t tick = 0;
    int module = 0;
    vm::Fault fault;
  };

  VmRobot(const model::Model& model, const model::Robot& robot, const std::vector<uint8_t>& program,
          const VmRobotOptions& options = {});

  /// Computes `count` ticks of all modules.
  void Tick(int count = 1);

  [[nodiscard]] int size() const { return static_cast<int>(nodes_.size()); }
  [[nodiscard]] int64_t tick() const { return tick_; }
  /// How long the ticks of all modules' VMs have taken together, without the world around them.
  [[nodiscard]] std::chrono::nanoseconds vm_time() const { return vm_time_; }
  [[nodiscard]] const model::Robot& robot() const { return robot_; }
  [[nodiscard]] const vm::VerifiedProgram& program() const { return *program_; }
  [[nodiscard]] vm::Vm& vm(int m) { return *nodes_[Index(m)].vm; }
  [[nodiscard]] vm::VmState& state(int m) { return *nodes_[Index(m)].state; }
  [[nodiscard]] const vm::TickOutput& output(int m) const { return *nodes_[Index(m)].output; }
  [[nodiscard]] int ModuleNamed(const std::string& name) const;

  /// Role, "" while there is none.
  [[nodiscard]] std::string RoleOf(int m) const;
  /// Index of the joint or link that a label of the module's role resolves to; -1 if none.
  [[nodiscard]] int LabelOf(int m, const std::string& label) const;
  /// Index of a role in the program; -1 if it has none of that name.
  [[nodiscard]] int RoleNamed(const std::string& name) const;

  /// Joint values of the world, rad or m.
  model::JointValues& joints() { return q_; }
  /// A blocked joint does not follow its commands.
  void Block(int module, int joint, bool blocked) {
    blocked_[Index(module)][Index(joint)] = blocked;
  }

  /// What the motors of a module exert, N m or N, in the actuators' signs; at first 0.
  std::vector<float>& efforts(int module) { return efforts_[Index(module)]; }
  /// What the sensors of a module's type measure, one behind the other as in TickInput; at first 0.
  std::vector<float>& sensors(int module) { return sensors_[Index(module)]; }

  /// Breaks or makes one of the robot's dockings.
  void SetDocked(int docking, bool docked) { docked_[Index(docking)] = docked; }
  /// Index of the docking on this connector of a module; -1 if there is none.
  [[nodiscard]] int DockingAt(int module, const std::string& connector) const;

  /// A silent module computes nothing and sends nothing.
  void SetSilent(int module, bool silent) { nodes_[Index(module)].silent = silent; }
  /// A module starts again with nothing but its images.
  void ColdStart(int module);
  /// Replaces a module's VM by one that goes on from a copy of its state's bytes.
  void SaveAndRestore(int module);
  /// Another program for one module (the relay is not part of this harness).
  void ReplaceProgram(int module, const std::vector<uint8_t>& program);
  /// What the root's sensor measures from now on, of this link; nothing: it has none.
  void SenseRoot(const std::optional<vm::PoseF>& X_RL, int link) {
    X_RL_sensed_ = X_RL;
    sensed_link_ = static_cast<uint8_t>(link);
  }
  /// Handed to the module at the next tick.
  void Request(int module, const vm::InvokeRequest& request) {
    nodes_[Index(module)].requests.push_back(request);
  }

  std::vector<FaultEvent>& faults() { return faults_; }
  [[nodiscard]] int CountFaults(vm::FaultCode code) const;

 private:
  struct Node {
    vm::VmConfig config;
    const vm::VerifiedKinematics* kinematics = nullptr;
    std::unique_ptr<vm::VmState> state;
    std::unique_ptr<vm::Vm> vm;
    std::unique_ptr<vm::TickOutput> output;
    std::vector<vm::InvokeRequest> requests;
    bool silent = false;
  };
  static size_t Index(int i) { return static_cast<size_t>(i); }

  void LoadKinematics();
  const vm::VerifiedProgram* Load(const std::vector<uint8_t>& program);
  void Connect(int module, vm::TickInput* input);
  const vm::NeighbourMessage* Deliver(int from);
  void MoveJoints();

  const model::Model& model_;
  const model::Robot& robot_;
  const VmRobotOptions options_;
  std::vector<std::vector<uint8_t>> kinematics_bytes_;
  std::vector<std::unique_ptr<vm::VerifiedKinematics>> kinematics_;
  std::deque<std::vector<uint8_t>> program_bytes_;
  std::vector<std::unique_ptr<vm::VerifiedProgram>> programs_;
  const vm::VerifiedProgram* program_ = nullptr;
  std::vector<Node> nodes_;
  std::vector<bool> docked_;
  std::vector<std::vector<bool>> blocked_;
  model::JointValues q_;
  /// How fast the joints moved in the last tick; empty before the first one.
  model::JointValues speeds_;
  std::vector<std::vector<float>> sensors_, efforts_;
  /// history_[0]: what each module said in the last tick, nullptr if it was silent.
  std::deque<std::vector<std::unique_ptr<vm::NeighbourMessage>>> history_;
  std::mt19937_64 random_;
  std::vector<FaultEvent> faults_;
  std::optional<vm::PoseF> X_RL_sensed_;
  uint8_t sensed_link_ = 0;
  int64_t tick_ = -1;
  std::chrono::nanoseconds vm_time_{0};
};

}  // namespace morphbus::test
