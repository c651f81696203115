#pragma once
// A robot that stands still: every module's VM, in one process, fed with what its sensors read at
// rest.

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <morphbus/docked_connector_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <set>
#include <string>
#include <vector>

#include "tools/plan/plan_modules.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// What is docked to a module's connectors, by the module's name.
using DockedTable = std::map<std::string, std::vector<morphbus::docked_connector_t>>;

/// How a robot stands, where that is not as its model declares it.
struct Situation {
  /// The connections: of modules that it names, nothing else is connected.
  DockedTable docked = {};
  /// Joint positions (rad or m) by module, in declaration order; other modules are at their start
  /// values.
  std::map<std::string, std::vector<double>> positions = {};
  /// Modules that do nothing and of which nobody hears, as those that a run has lost.
  std::set<std::string> silent = {};
  /// Set by somebody who does not wait any longer: roles then stay as they are by then. May be
  /// null.
  const std::atomic<bool>* stop = nullptr;
};

/// A fault that a module reported, and its sentence (vm/image/fault_text.h).
struct NotedFault {
  vm::Fault fault;
  std::string sentence;
};

/// The VMs of a plan's robot, joints where they are whatever they command.
class StaticRobot {
 public:
  /// One module and what its VM was told and said last.
  struct Module {
    bridge::ModuleInstance* instance = nullptr;
    bool silent = false;  ///< Its VM is not ticked, and its neighbours hear nothing of it.
    vm::TickInput input;
    vm::TickOutput output;
    vm::NeighbourMessage last_message;  ///< Of the previous tick.
    vm::StatusReport report;            ///< The newest.
    /// Each fault once, in its words, but for those that say only that nothing moves here.
    std::vector<NotedFault> faults;
  };

  /// The VMs of the plan, before their first tick. Fails if the plan's images are damaged or the
  /// world cannot be built.
  /// @param plan       outlives the robot.
  /// @param situation  how the robot stands; null: as the plan's model declares it.
  static Result<std::unique_ptr<StaticRobot>> Create(const RunPlan& plan,
                                                     const Situation* situation = nullptr);

  /// Ticks all VMs until neither roles nor labels nor conventions have changed for two seconds of
  /// sim time; false if they still do after ten.
  bool Settle();

  /// Control ticks that the VMs ran.
  [[nodiscard]] int64_t ticks() const { return ticks_; }
  /// In the robot's order.
  [[nodiscard]] const std::vector<std::unique_ptr<Module>>& modules() const { return modules_; }
  [[nodiscard]] const vm::VerifiedProgram& program() const { return built_->images.program(); }
  [[nodiscard]] const RunPlan& plan() const { return plan_; }

 private:
  explicit StaticRobot(const RunPlan& plan) : plan_(plan) {}
  /// Builds the modules and gives each what its sensors read at rest.
  Result<void> AddModules(const Situation* situation);
  /// Puts these connections and positions into the readings, in place of those that are there.
  static void Place(const Situation& situation, std::vector<morphbus::module_sensors_t>* sensors);
  /// One tick of all; true if any role, label or convention changed.
  bool Tick();
  /// Adds the faults of the last tick to the module's, each once.
  void NoteFaults(Module* module) const;

  const RunPlan& plan_;
  std::unique_ptr<PlanModules> built_;
  std::vector<std::unique_ptr<Module>> modules_;
  const std::atomic<bool>* stop_ = nullptr;
  int64_t ticks_ = 0;
};

}  // namespace morphbus::tools
