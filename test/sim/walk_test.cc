// The dynamics as a whole: both quadrupeds of Fig. 9 under the gait of Fig. 10, by a script instead
// of a program.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "sim/bullet_robot.h"
#include "test/sim/mtran.h"
#include "test/sim/world_contacts.h"

namespace morphbus::sim {
namespace {

constexpr double kTick = 0.02;

class Walker {
 public:
  Walker(const std::string& robot, const BulletRobotOptions& options) : model_(test::MtranModel()) {
    bullet_robot_ = std::move(*BulletRobot::Create(model_, robot, options));
    parts_ = test::AssignParts(*model_, bullet_robot_->robot());
  }

  void Tick() {
    const test::Posture posture = test::GaitTargets(kTick * ticks_++);
    std::array<morphbus::actuator_t, 9> commands;
    for (size_t m = 0; m < commands.size(); ++m) {
      commands[m].module_id = static_cast<int16_t>(m);
      commands[m].num_joints = 2;
      commands[m].joints.resize(2);
    }
    for (size_t leg = 0; leg < test::kNumLegs; ++leg) {
      for (size_t part = 0; part < test::kNumParts; ++part) {
        const test::FunctionalJoint& joint = parts_[leg][part];
        morphbus::joint_command_t& command = commands[joint.module].joints[joint.joint];
        command.mode = morphbus::joint_command_t::MODE_POSITION;
        command.target_si = joint.sign * posture[leg][part];
        command.speed_si = std::numbers::pi;
      }
    }
    for (const morphbus::actuator_t& command : commands) bullet_robot_->Actuate(command);
    bullet_robot_->Advance();
  }

  void RunUntil(double t) {
    while (kTick * ticks_ < t - 1e-9) Tick();
  }

  /// Centre of the hub, world (m).
  Eigen::Vector3d Hub() const {
    return bullet_robot_->LinkPoses()[4][1] * Eigen::Vector3d(0.0325, 0, 0);
  }
  /// Turn about the vertical since the start (degrees).
  double Heading() const {
    const Eigen::Matrix3d R = bullet_robot_->LinkPoses()[4][1].linear();
    return std::atan2(-R(2, 0), R(0, 0)) * 180.0 / std::numbers::pi;
  }
  /// Vertical component of the hub's own up direction.
  double Upright() const { return bullet_robot_->LinkPoses()[4][1].linear()(1, 1); }

  const BulletRobot& bullet_robot() const { return *bullet_robot_; }

 private:
  std::shared_ptr<const model::Model> model_;
  std::unique_ptr<BulletRobot> bullet_robot_;
  test::Quadruped parts_;
  int ticks_ = 0;
};

TEST(WalkTest, QuadrupedStandsUpAsHighAsItsLegsAreLong) {
  Walker walker("quadruped", {});
  walker.RunUntil(2.4);
  EXPECT_NEAR(walker.Hub().y(), 0.208, 0.003);
  EXPECT_GT(walker.Upright(), 0.999);
  EXPECT_LT(std::abs(walker.Heading()), 10.0);
}

TEST(WalkTest, QuadrupedWalksNorth) {
  Walker walker("quadruped", {});
  walker.RunUntil(test::kGaitStart + test::kGaitCycle);
  const Eigen::Vector3d start = walker.Hub();
  double lowest = 1.0;
  for (int cycle = 2; cycle <= 4; ++cycle) {
    const double before = walker.Hub().x();
    for (int tick = 0; tick < 350; ++tick) {
      walker.Tick();
      lowest = std::min(lowest, walker.Upright());
    }
    const double step = walker.Hub().x() - before;
    EXPECT_GT(step, 0.070) << "cycle " << cycle;
    EXPECT_LT(step, 0.095) << "cycle "
                           << cycle;  // 2 * 2 * sin 45 degrees units at most, and a slip
  }
  EXPECT_GT(lowest, 0.95);
  EXPECT_LT(std::abs(walker.Heading()), 10.0);
  EXPECT_LT(std::abs(walker.Hub().z() - start.z()), 0.06);
}

TEST(WalkTest, WithoutFrictionItGetsNowhere) {
  BulletRobotOptions options;
  options.world.friction = 0.0;
  Walker walker("quadruped", options);
  walker.RunUntil(test::kGaitStart + 2 * test::kGaitCycle);
  EXPECT_LT(std::abs(walker.Hub().x()), 0.07);
}

TEST(WalkTest, BothRobotsOfFigure9WalkAlikeBitForBit) {
  Walker one("quadruped", {});
  Walker other("equivalent_quadruped", {});
  EXPECT_EQ(one.bullet_robot().world_hash(), other.bullet_robot().world_hash());
  const auto same_state = [](const BodyState& a, const BodyState& b) {
    return a.X_WB.matrix() == b.X_WB.matrix() && a.v_WBo_W == b.v_WBo_W && a.w_WB_W == b.w_WB_W;
  };
  for (int tick = 0; tick < 475; ++tick) {
    one.Tick();
    other.Tick();
    for (int b = 0; b < 17; ++b) {
      ASSERT_TRUE(
          same_state(one.bullet_robot().world().body(b), other.bullet_robot().world().body(b)))
          << "tick " << tick << ", body " << b;
    }
  }
  // It is the same walk and no other: modules swap sides, so m1 of one is m6 of the other.
  EXPECT_EQ(one.bullet_robot().Positions()[4][0], other.bullet_robot().Positions()[4][0]);
}

TEST(WalkTest, FeetNeverSinkIntoTheGround) {
  Walker walker("quadruped", {});
  double deepest = 0.0;
  for (int tick = 0; tick < 475; ++tick) {
    walker.Tick();
    for (const auto& contact : WorldContacts::Of(walker.bullet_robot().world())) {
      deepest = std::max(deepest, contact.depth_m);
    }
  }
  EXPECT_LT(deepest, 0.003);
}

}  // namespace
}  // namespace morphbus::sim
