#include "compiler/emit/kinematics.h"

#include <gtest/gtest.h>

#include "compiler/model/forward_kinematics.h"
#include "test/compiler/solver/known_modules.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/pose.h"

namespace morphbus::emit {
namespace {

model::Pose ToModel(const vm::PoseF& X) {
  model::Pose result = model::Pose::Identity();
  result.linear() = Eigen::Quaterniond(X.q.w, X.q.x, X.q.y, X.q.z).toRotationMatrix();
  result.translation() = Eigen::Vector3d(X.p.x, X.p.y, X.p.z);
  return result;
}

TEST(KinematicsImage, HoldsEveryConnectionFromBothSides) {
  const model::Model model = test::MtranModel(0.0325);
  const Result<std::string> bytes = KinematicsImage(model, 0, 0x1234);
  ASSERT_TRUE(bytes.has_value()) << bytes.error().message;
  vm::VerifiedKinematics kinematics;
  const vm::VerifyError error =
      vm::VerifyKinematics(reinterpret_cast<const uint8_t*>(bytes->data()),
                           static_cast<uint32_t>(bytes->size()), &kinematics);
  ASSERT_EQ(error.message, nullptr);
  EXPECT_EQ(kinematics.model_hash(), 0x1234u);
  EXPECT_EQ(kinematics.num_links(), 3);
  EXPECT_EQ(kinematics.num_joints(), 2);
  EXPECT_EQ(kinematics.num_connectors(), 6);
  EXPECT_EQ(kinematics.num_connections(), 144);
  for (const model::ConnectionOption& option : model.connection_types[0].options) {
    vm::KinConnection from_a;
    vm::KinConnection from_b;
    ASSERT_TRUE(kinematics.Find(0, option.number, false, option.connector_a, &from_a));
    ASSERT_TRUE(kinematics.Find(0, option.number, true, option.connector_b, &from_b));
    EXPECT_EQ(from_a.mate_connector, option.connector_b);
    EXPECT_EQ(from_b.mate_connector, option.connector_a);
    EXPECT_LT((ToModel(from_a.X_MN).matrix() - option.X_AB.matrix()).norm(), 1e-6);
    EXPECT_LT((ToModel(from_b.X_MN).matrix() - option.X_AB.inverse().matrix()).norm(), 1e-6);
  }
}

TEST(KinematicsImage, MovesLinksAsTheModelDoes) {
  const model::Model model = test::MtranModel(0.0325);
  const Result<vm::KinematicsTables> tables = KinematicsTablesOf(model, 0, 0);
  ASSERT_TRUE(tables.has_value());
  for (size_t j = 0; j < tables->joints.size(); ++j) {
    const auto& joint = tables->joints[j];
    for (const float q : {-1.5f, -0.3f, 0.0f, 0.7f}) {
      const model::Pose expected = model::JointMotion(model.module_types[0].joints[j], q);
      const model::Pose actual = ToModel(vm::RevoluteMotion(joint.origin_m, joint.axis, q));
      EXPECT_LT((actual.matrix() - expected.matrix()).norm(), 1e-6);
    }
  }
}

TEST(KinematicsImage, SaysWhichCapacityIsExceeded) {
  model::Model model = test::MtranModel();
  while (model.module_types[0].links.size() < 40) {
    model.module_types[0].links.push_back(model.module_types[0].links[0]);
  }
  const Result<std::string> bytes = KinematicsImage(model, 0, 0);
  ASSERT_FALSE(bytes.has_value());
  EXPECT_NE(bytes.error().message.find("40 links"), std::string::npos) << bytes.error().message;
}

}  // namespace
}  // namespace morphbus::emit
