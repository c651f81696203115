#include "sim/breakdown.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace morphbus::sim {
namespace {

// With masses further apart than this the masses are named as what to change. The solver lost hold
// of M-TRAN's joints with a bar of 1 g and with one of 1000 kg, and did not with 1, 10 or 100 kg.
constexpr double kMostMassRatio = 100;

// How far a joint is beyond its limits, as a part of what it may be; at most 1 while all is well.
double Overrun(const JointSpec& spec, double theta) {
  const double beyond = std::max(theta - spec.upper, spec.lower - theta);
  return beyond / (spec.type == model::JointType::kPrismatic ? kMostOverrunLinear : kMostOverrun);
}

// What to change, by what the robot is made of.
std::string Remedy(const RigidBodyModel& rigid_bodies) {
  const auto [light, heavy] = std::minmax_element(
      rigid_bodies.bodies.begin(), rigid_bodies.bodies.end(),
      [](const BodySpec& a, const BodySpec& b) { return a.mass_kg < b.mass_kg; });
  if (heavy->mass_kg > kMostMassRatio * light->mass_kg) {
    return fmt::format("bodies weigh {:.3g} to {:.3g} kg: bring 'mass=' nearer together",
                       light->mass_kg, heavy->mass_kg);
  }
  return "lessen the push, 'torque=' or the load that forces it";
}

// "m3.joint_1 is at -353 degrees, 263 beyond its limit".
std::string JointText(const JointSpec& spec, double theta, const model::Model& model,
                      const model::Robot& robot) {
  const double beyond = std::max(theta - spec.upper, spec.lower - theta);
  const bool slides = spec.type == model::JointType::kPrismatic;
  const double scale = slides ? 1e3 : 180.0 / EIGEN_PI;
  return fmt::format(
      "{}.{} is at {:.4g} {}, {:.3g} beyond its limit", robot.modules[spec.module].name,
      model.TypeOf(robot, spec.module).joints[spec.joint].name,
      (spec.start + spec.sign * theta) * scale, slides ? "mm" : "degrees", beyond * scale);
}

}  // namespace

std::string WhyBroken(const World& world, const model::Model& model, const model::Robot& robot) {
  const RigidBodyModel& rigid_bodies = world.rigid_bodies();
  if (world.lost()) {
    return "the simulation broke down: a body is nowhere; " + Remedy(rigid_bodies);
  }
  // The joint that is furthest out names the fault.
  int worst = -1;
  double most = 1.0;
  for (int j = 0; j < static_cast<int>(rigid_bodies.joints.size()); ++j) {
    const double overrun = Overrun(rigid_bodies.joints[j], world.joint(j).theta);
    if (overrun <= most) continue;
    most = overrun;
    worst = j;
  }
  if (worst < 0) return {};
  return fmt::format("the simulation broke down: {}; {}",
                     JointText(rigid_bodies.joints[worst], world.joint(worst).theta, model, robot),
                     Remedy(rigid_bodies));
}

}  // namespace morphbus::sim
