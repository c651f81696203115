#include "test/sim/mtran.h"

#include <cmath>
#include <numbers>

#include "compiler/model/forward_kinematics.h"
#include "test/support/compiled.h"

namespace morphbus::sim::test {
namespace {

using Eigen::Vector3d;
using model::Pose;

constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace

std::shared_ptr<const model::Model> MtranModel() {
  static const auto model =
      std::make_shared<const model::Model>(morphbus::test::ModelFrom("models/mtran.m3l"));
  return model;
}

Quadruped AssignParts(const model::Model& model, const model::Robot& robot) {
  // Upper and lower half of each leg; the legs on the other side of the hub in the second robot.
  const int m[2][kNumLegs][2] = {{{2, 1}, {7, 6}, {3, 4}, {8, 9}},
                                 {{7, 6}, {2, 1}, {8, 9}, {3, 4}}};
  const int which = robot.name == "quadruped" ? 0 : 1;
  const std::vector<std::vector<Pose>> X_RL =
      model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  Quadruped quadruped;
  for (size_t leg = 0; leg < kNumLegs; ++leg) {
    const bool front = leg == kFrontLeft || leg == kFrontRight;
    for (size_t part = 0; part < kNumParts; ++part) {
      FunctionalJoint& joint = quadruped[leg][part];
      joint.module = m[which][leg][part == kUpperJoint || part == kHip ? 0 : 1] - 1;
      // Active blocks lie to the south of their module in both robots, so in front legs joint_1 is
      // the one nearer to the hub.
      const bool inner = part == kUpperJoint || part == kKnee;
      joint.joint = inner == front ? 0 : 1;
      const Vector3d axis_R = X_RL[joint.module][joint.joint].linear() * Vector3d::UnitZ();
      // Raw values turn the block against the bar; only the ankle's convention is about the block.
      joint.sign = (axis_R.z() > 0.0 ? 1.0 : -1.0) * (part == kAnkle ? 1.0 : -1.0);
    }
  }
  return quadruped;
}

Posture GaitTargets(double t) {
  Posture q{};
  if (t < 0.5) return q;
  const auto turn = [&q](Leg leg, Part part, double degrees) { q[leg][part] += degrees * kDegree; };
  for (const Leg leg : {kFrontLeft, kFrontRight, kBackLeft, kBackRight}) {
    const double side = leg == kFrontLeft || leg == kFrontRight ? 1.0 : -1.0;
    turn(leg, kUpperJoint, -45 * side);
    turn(leg, kHip, 45 * side);
  }
  if (t < kGaitStart) return q;
  const double phase = std::fmod(t - kGaitStart, kGaitCycle);
  const auto move_leg = [&](Leg leg, double begin) {
    const double side = leg == kFrontLeft || leg == kFrontRight ? 1.0 : -1.0;
    if (phase < begin) return;
    turn(leg, kKnee, 90);
    turn(leg, kAnkle, -90);
    // 45 degrees at 180 degrees/s take 0.25 s; the second half starts on the tick after arrival.
    if (phase < begin + 0.28) {
      turn(leg, kUpperJoint, 45 * side);
      turn(leg, kHip, 45 * side);
    }
  };
  if (phase >= 2.0) {
    for (const Leg leg : {kFrontLeft, kFrontRight, kBackLeft, kBackRight}) {
      turn(leg, kKnee, -45);
      turn(leg, kAnkle, 45);
    }
  }
  move_leg(kFrontRight, 2.25);
  move_leg(kBackLeft, 3.25);
  move_leg(kBackRight, 4.75);
  move_leg(kFrontLeft, 5.0);
  return q;
}

}  // namespace morphbus::sim::test
