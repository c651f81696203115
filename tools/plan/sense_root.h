#pragma once
// --root-sensor: the root is told where it is by a sensor, tick by tick.

#include "bridge/lockstep/sim/sim_participant.h"
#include "sim/controlled_robot.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// Puts a sensor of its pose onto the root module of the plan, if the plan says so. `robot`
/// outlives the participant.
void AddRootSensor(const RunPlan& plan, const sim::ControlledRobot* robot,
                   bridge::SimParticipant* participant);

}  // namespace morphbus::tools
