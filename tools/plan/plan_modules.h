#pragma once
// The modules of a planned run within this process: for --inproc and for `morphbus roles`.

#include <memory>
#include <vector>

#include "bridge/module/module_instance.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// All modules of the plan's robot, in order of id, and the images that they run on. The instances
/// refer to the images, so they live and go together; nobody but the owner of this struct has them.
struct PlanModules {
  /// The verified program and kinematics, shared by all instances.
  bridge::ModuleImages images;
  /// The element at i is the module whose id and index in the robot is i.
  std::vector<std::unique_ptr<bridge::ModuleInstance>> instances;
};

/// Verifies the plan's images and puts its modules together. None has joined a run yet. Fails if an
/// image of the description is damaged or a name cannot be used on the bus.
Result<std::unique_ptr<PlanModules>> BuildModules(const RunPlan& plan);

}  // namespace morphbus::tools
