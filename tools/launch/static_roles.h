#pragma once
// Roles without motion: every module's VM, in one process, fed with a robot that stands still.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/launch/run_plan.h"

namespace morphbus::tools {

/// What one module has settled on: a copy of names, which outlives the VMs.
struct StaticRole {
  /// The module's name in the robot.
  std::string module;
  std::string role;                           ///< Empty: none.
  std::map<std::string, std::string> labels;  ///< Label -> joint or link of the module.
  std::map<std::string, int> signs;           ///< Label (else joint) -> sign under setJointAxis.
  /// Why it plays no role, one line a concrete role; faults that it reported otherwise.
  std::vector<std::string> problems;
};

/// What all modules have settled on, or what they had when SettleRoles gave up waiting.
struct StaticRoles {
  std::vector<StaticRole> modules;  ///< In the robot's order.
  bool settled = false;             ///< False: roles still changed after `ticks`.
  /// Control ticks that the VMs ran.
  int64_t ticks = 0;
};

/// Ticks all VMs, joints at their start values whatever they command, until neither roles nor
/// labels nor conventions have changed for two seconds of sim time (ten at most). Roles that never
/// settle are no error (`settled`). Fails if the plan's images are damaged or the world cannot be
/// built.
Result<StaticRoles> SettleRoles(const RunPlan& plan);

/// Whether the program has a role that a module could take, that is, one that is not abstract.
/// False for a damaged image.
bool HasRoles(const RunPlan& plan);

}  // namespace morphbus::tools
