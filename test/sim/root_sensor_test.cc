#include "sim/root_sensor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "compiler/model/forward_kinematics.h"
#include "sim/bullet_robot.h"
#include "test/sim/mtran.h"

namespace morphbus::sim {
namespace {

class RootSensorTest : public ::testing::Test {
 protected:
  RootSensorTest() { world_ = std::move(BulletRobot::Create(model_, "quadruped", {}).value()); }

  const std::shared_ptr<const model::Model> model_ = test::MtranModel();
  const model::Robot& robot_ = *model_->FindRobot("quadruped");
  std::unique_ptr<BulletRobot> world_;
};

TEST_F(RootSensorTest, AtTheStartItMeasuresThePoseOfTheModel) {
  RootSensor sensor(*model_, robot_, {});
  const model::KinematicState start =
      model::ForwardKinematics(*model_, robot_, model::StartValues(robot_));
  for (int m = 0; m < static_cast<int>(robot_.modules.size()); ++m) {
    for (int l = 0; l < 2; ++l) {
      const model::Pose X_RL = sensor.Measure(world_->LinkPose(m, l));
      EXPECT_TRUE(X_RL.isApprox(start.X_RL[static_cast<size_t>(m)][static_cast<size_t>(l)], 1e-8))
          << "module " << m << " link " << l;
    }
  }
}

TEST_F(RootSensorTest, ItSeesTheRobotFall) {
  RootSensor sensor(*model_, robot_, {});
  const model::Pose before = sensor.Measure(world_->LinkPose(4, 1));
  ASSERT_TRUE(world_->Push("m5", {0, 0, 200}, "", 0.2));
  for (int i = 0; i < 10; ++i) world_->Advance();
  const model::Pose after = sensor.Measure(world_->LinkPose(4, 1));
  const model::Pose moved = world_->LinkPose(4, 1);
  EXPECT_GT((after.translation() - before.translation()).norm(), 0.005);
  EXPECT_TRUE(after.linear().isApprox(moved.linear(), 1e-12));
}

TEST_F(RootSensorTest, NoiseHasItsStandardDeviationsAndItsSeed) {
  const model::Pose truth = world_->LinkPose(4, 1);
  const model::Pose exact = RootSensor(*model_, robot_, {}).Measure(truth);
  const PoseNoise noise = {0.01, 0.02, 7};
  RootSensor sensor(*model_, robot_, noise), same(*model_, robot_, noise),
      other(*model_, robot_, {0.01, 0.02, 8});
  constexpr int kReadings = 4000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum;
  double turns = 0;
  for (int i = 0; i < kReadings; ++i) {
    const model::Pose reading = sensor.Measure(truth);
    EXPECT_TRUE(reading.matrix() == same.Measure(truth).matrix());
    EXPECT_FALSE(reading.matrix() == other.Measure(truth).matrix());
    const Eigen::Vector3d error = reading.translation() - exact.translation();
    sum += error;
    squares += error.cwiseProduct(error);
    const double turn = Eigen::AngleAxisd(exact.linear().transpose() * reading.linear()).angle();
    turns += turn * turn;
  }
  // Means within four of their own standard deviations, deviations within 5 %.
  EXPECT_LT((sum / kReadings).cwiseAbs().maxCoeff(), 4 * 0.01 / std::sqrt(kReadings));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(std::sqrt(squares(i) / kReadings), 0.01, 0.0005);
  EXPECT_NEAR(std::sqrt(turns / (3 * kReadings)), 0.02, 0.001);
}

}  // namespace
}  // namespace morphbus::sim
