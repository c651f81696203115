#include "tools/plan/sense_root.h"

#include <memory>

#include "bridge/wire/vm_codec.h"
#include "compiler/base/check.h"
#include "logger/compare/kinematic_tracks.h"
#include "sim/root_sensor.h"
#include "tools/base/program.h"

namespace morphbus::tools {

void AddRootSensor(const RunPlan& plan, const sim::ControlledRobot* robot,
                   bridge::SimParticipant* participant) {
  const proto::RunDescription& d = plan.description;
  if (!d.root_sensor()) return;
  // The plan was checked when it was made.
  const std::optional<int> module = plan.robot().FindModule(d.root_module());
  MORPHBUS_CHECK(module.has_value());
  const int link = RootPoseOf(plan, *module).link;
  // The noise has a seed of its own in the run's description, so that runs repeat.
  const sim::PoseNoise noise = {d.root_noise_m(), d.root_noise_rad(), d.noise_seed()};
  const auto sensor = std::make_shared<sim::RootSensor>(plan.model, plan.robot(), noise);
  participant->OnSenseRoot([sensor, robot, module = *module, link] {
    morphbus::root_pose_t reading = {};
    // Measured where the physics has the link, rounded as the VM will have it.
    const vm::PoseF X_RL = logger::ToVmPose(sensor->Measure(robot->LinkPose(module, link)));
    bridge::ToRootPose(static_cast<uint16_t>(module), static_cast<uint8_t>(link), X_RL, &reading);
    return reading;
  });
}

}  // namespace morphbus::tools
