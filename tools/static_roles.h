#pragma once
// Roles without motion: every module's VM, in one process, fed with a robot that stands still.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/run_plan.h"

namespace morphbus::tools {

/// What one module has settled on.
struct StaticRole {
  std::string module;
  std::string role;                           ///< Empty: none.
  std::map<std::string, std::string> labels;  ///< Label -> joint or link of the module.
  std::map<std::string, int> signs;           ///< Label (else joint) -> sign under setJointAxis.
  /// Why it plays no role, one line a concrete role; faults that it reported otherwise.
  std::vector<std::string> problems;
};

struct StaticRoles {
  std::vector<StaticRole> modules;  ///< In the robot's order.
  bool settled = false;             ///< False: roles still changed after `ticks`.
  int64_t ticks = 0;
};

/// Ticks all VMs, joints at their start values whatever they command, until neither roles nor
/// labels nor conventions have changed for two seconds of sim time (ten at most).
Result<StaticRoles> SettleRoles(const RunPlan& plan);

}  // namespace morphbus::tools
