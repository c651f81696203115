#include "vm/image/pose.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "test/support/vm_robot.h"

namespace morphbus::vm {
namespace {

using test::ToFloat;

class PoseTest : public ::testing::Test {
 protected:
  Eigen::Vector3d RandomVector() { return {u_(random_), u_(random_), u_(random_)}; }
  model::Pose RandomPose() {
    model::Pose X = model::Pose::Identity();
    X.translation() = RandomVector();
    X.linear() = Eigen::AngleAxisd(3 * u_(random_), RandomVector().normalized()).toRotationMatrix();
    return X;
  }
  static void ExpectSame(const PoseF& actual, const model::Pose& expected) {
    const PoseF e = ToFloat(expected);
    EXPECT_LT(Norm(Subtract(actual.p, e.p)), 2e-6f);
    const float dot =
        actual.q.w * e.q.w + actual.q.x * e.q.x + actual.q.y * e.q.y + actual.q.z * e.q.z;
    EXPECT_NEAR(std::abs(dot), 1.0f, 1e-6f);
  }
  std::mt19937_64 random_{11};
  std::uniform_real_distribution<double> u_{-1.0, 1.0};
};

TEST_F(PoseTest, CompositionAndInverseAgreeWithDoublePrecision) {
  for (int i = 0; i < 100; ++i) {
    const model::Pose X_AB = RandomPose(), X_BC = RandomPose();
    ExpectSame(Compose(ToFloat(X_AB), ToFloat(X_BC)), X_AB * X_BC);
    ExpectSame(Inverse(ToFloat(X_AB)), X_AB.inverse());
    const Eigen::Vector3d v = RandomVector();
    const Vec3 rotated =
        Rotate(ToFloat(X_AB).q,
               {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
    const Eigen::Vector3d expected = X_AB.linear() * v;
    EXPECT_NEAR(rotated.x, expected.x(), 1e-6);
    EXPECT_NEAR(rotated.y, expected.y(), 1e-6);
    EXPECT_NEAR(rotated.z, expected.z(), 1e-6);
  }
}

TEST_F(PoseTest, JointMotionsAgreeWithTheModel) {
  for (int i = 0; i < 100; ++i) {
    model::Joint joint;
    joint.p_MoJo_M = RandomVector();
    joint.axis = RandomVector().normalized();
    const double q = 3 * u_(random_);
    model::Pose at;
    at = Eigen::Translation3d(joint.p_MoJo_M) * Eigen::AngleAxisd(q, joint.axis) *
         Eigen::Translation3d(-joint.p_MoJo_M);
    model::Pose frame = model::Pose::Identity();
    frame.translation() = joint.p_MoJo_M;
    const Vec3 o = ToFloat(frame).p;
    frame.translation() = joint.axis;
    const Vec3 axis = ToFloat(frame).p;
    ExpectSame(RevoluteMotion(o, axis, static_cast<float>(q)), at);
    joint.type = model::JointType::kRevolute;
    ExpectSame(RevoluteMotion(o, axis, static_cast<float>(q)), model::JointMotion(joint, q));
    joint.type = model::JointType::kPrismatic;
    ExpectSame(PrismaticMotion(axis, static_cast<float>(q)), model::JointMotion(joint, q));
  }
}

TEST_F(PoseTest, AQuaternionTooSmallToScaleBecomesTheIdentity) {
  const Quat q = Normalize({0, 0, 0, 0});
  EXPECT_EQ(q.w, 1.0f);
  EXPECT_EQ(q.x, 0.0f);
}

}  // namespace
}  // namespace morphbus::vm
