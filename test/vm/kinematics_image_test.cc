#include "vm/image/kinematics_verifier.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/image/image.h"
#include "vm/image/kinematics_encoder.h"
#include "vm/image/kinematics_layout.h"

namespace morphbus::vm {
namespace {

std::string ToString(Text text) { return {text.data, text.size}; }

VerifyError Verify(const std::vector<uint8_t>& bytes, VerifiedKinematics* out) {
  return VerifyKinematics(bytes.data(), static_cast<uint32_t>(bytes.size()), out);
}

void RehashTables(std::vector<uint8_t>* bytes) {
  const uint64_t hash = image::HashOf(bytes->data(), static_cast<uint32_t>(bytes->size()));
  for (uint32_t i = 0; i < 8; ++i) {
    (*bytes)[kinematics::kHashAt + i] = static_cast<uint8_t>(hash >> (8 * i));
  }
}

class KinematicsImageTest : public ::testing::Test {
 protected:
  KinematicsImageTest() {
    hinge_ = Encode(test::TablesOf(model_, 0));
    rail_ = Encode(test::TablesOf(model_, 1));
  }
  static std::vector<uint8_t> Encode(const KinematicsTables& tables) {
    std::string error;
    std::vector<uint8_t> bytes = EncodeKinematics(tables, &error);
    EXPECT_EQ(error, "");
    return bytes;
  }
  const model::Model model_ = test::ToyModel();
  std::vector<uint8_t> hinge_, rail_;
  VerifiedKinematics kinematics_;
};

TEST_F(KinematicsImageTest, WhatIsEncodedIsDecoded) {
  KinematicsTables tables = test::TablesOf(model_, 1);
  tables.model_hash = 0x1122334455667788;
  tables.connectors[2].states = {{"extended", 2}, {"mode", 3}};
  const std::vector<uint8_t> bytes = Encode(tables);
  ASSERT_EQ(Verify(bytes, &kinematics_).message, nullptr);
  EXPECT_EQ(kinematics_.model_hash(), 0x1122334455667788u);
  EXPECT_EQ(ToString(kinematics_.type_name()), "Rail");
  ASSERT_EQ(kinematics_.num_links(), 4);
  EXPECT_EQ(ToString(kinematics_.link(2).name), "slider");
  ASSERT_EQ(kinematics_.num_joints(), 3);
  EXPECT_EQ(kinematics_.joint(0).kind, JointKind::kFixed);
  EXPECT_EQ(kinematics_.joint(1).kind, JointKind::kPrismatic);
  EXPECT_EQ(kinematics_.joint(1).link_a, 2);
  EXPECT_EQ(kinematics_.joint(1).link_b, 1);
  EXPECT_FLOAT_EQ(kinematics_.joint(1).upper_rad, 0.05f);
  EXPECT_FLOAT_EQ(kinematics_.joint(1).speed_rad_s, 0.1f);
  EXPECT_GT(kinematics_.joint(2).upper_rad, 1e30f);
  ASSERT_EQ(kinematics_.num_connectors(), 4);
  EXPECT_EQ(kinematics_.connector(2).num_states, 2);
  EXPECT_EQ(ToString(kinematics_.connector(2).states[1].name), "mode");
  EXPECT_EQ(kinematics_.connector(2).states[1].num_values, 3);
}

TEST_F(KinematicsImageTest, EveryConnectionIsFoundFromBothSides) {
  VerifiedKinematics hinge, rail;
  ASSERT_EQ(Verify(hinge_, &hinge).message, nullptr);
  ASSERT_EQ(Verify(rail_, &rail).message, nullptr);
  EXPECT_EQ(hinge.num_connections(), 84 + 84 + 24);  // As a, as b, and with a Rail.
  EXPECT_EQ(rail.num_connections(), 24);
  for (const model::ConnectionOption& option : model_.connection_types[1].options) {
    KinConnection from_hinge, from_rail;
    ASSERT_TRUE(hinge.Find(1, option.number, false, option.connector_a, &from_hinge));
    ASSERT_TRUE(rail.Find(1, option.number, true, option.connector_b, &from_rail));
    EXPECT_EQ(from_hinge.mate_connector, option.connector_b);
    EXPECT_EQ(from_rail.mate_connector, option.connector_a);
    const PoseF round_trip = Compose(from_hinge.X_MN, from_rail.X_MN);
    EXPECT_LT(Norm(round_trip.p), 1e-6f);
  }
  KinConnection none;
  EXPECT_FALSE(hinge.Find(1, 1, true, 0, &none));
  EXPECT_FALSE(hinge.Find(2, 1, false, 0, &none));
  EXPECT_FALSE(hinge.Find(1, 999, false, 0, &none));
}

TEST_F(KinematicsImageTest, FixedJointsMakeOneBody) {
  ASSERT_EQ(Verify(rail_, &kinematics_).message, nullptr);
  EXPECT_EQ(kinematics_.BodyLink(0), 0);
  EXPECT_EQ(kinematics_.BodyLink(1), 0);
  EXPECT_EQ(kinematics_.BodyLink(2), 2);
  EXPECT_EQ(kinematics_.BodyLink(3), 3);
}

TEST_F(KinematicsImageTest, AnyChangedByteIsRefused) {
  for (size_t i = 0; i < rail_.size(); ++i) {
    std::vector<uint8_t> bytes = rail_;
    bytes[i] ^= 0x10;
    EXPECT_NE(Verify(bytes, &kinematics_).message, nullptr) << "byte " << i;
    EXPECT_EQ(kinematics_.num_links(), 0);
  }
}

TEST_F(KinematicsImageTest, AnyShorterImageIsRefused) {
  for (size_t size = 0; size < rail_.size(); ++size) {
    const std::vector<uint8_t> bytes(rail_.begin(),
                                     rail_.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_NE(Verify(bytes, &kinematics_).message, nullptr) << "size " << size;
  }
}

TEST_F(KinematicsImageTest, DamageUnderACorrectHashIsRefusedOrHarmless) {
  std::mt19937_64 random(5);
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    std::vector<uint8_t> bytes = i % 2 == 0 ? rail_ : hinge_;
    for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<uint8_t>(random());
    RehashTables(&bytes);
    if (Verify(bytes, &kinematics_).message != nullptr) continue;
    ++accepted;
    for (int c = 0; c < kinematics_.num_connections(); ++c) {
      const KinConnection connection = kinematics_.connection(c);
      KinConnection found;
      EXPECT_TRUE(kinematics_.Find(connection.connection_type, connection.number,
                                   connection.is_member_b, connection.connector, &found));
    }
  }
  EXPECT_GT(accepted, 0);
}

TEST_F(KinematicsImageTest, NumbersThatAreNotFiniteAreRefused) {
  ASSERT_EQ(Verify(rail_, &kinematics_).message, nullptr);
  const auto first = static_cast<uint32_t>(rail_.size()) - 24 * kinematics::kConnectionBytes;
  const uint8_t nan[4] = {0, 0, 0xc0, 0x7f};
  for (uint32_t number = 0; number < 7; ++number) {
    std::vector<uint8_t> bytes = rail_;
    std::memcpy(bytes.data() + first + 8 + 4 * number, nan, 4);
    RehashTables(&bytes);
    EXPECT_STREQ(Verify(bytes, &kinematics_).message, "transform of a connection is not a pose");
  }
}

TEST_F(KinematicsImageTest, CapacitiesAreToldByName) {
  KinematicsTables tables = test::TablesOf(model_, 0);
  for (int i = 0; i < kMaxLinks; ++i) tables.links.push_back("extra" + std::to_string(i));
  std::string error;
  EXPECT_TRUE(EncodeKinematics(tables, &error).empty());
  EXPECT_EQ(error, "module type Hinge has 10 links; the virtual machine holds at most 8");
}

TEST_F(KinematicsImageTest, TablesThatContradictEachOtherAreRefused) {
  KinematicsTables tables = test::TablesOf(model_, 0);
  tables.joints[0].link_a = 1;
  std::string error;
  EXPECT_TRUE(EncodeKinematics(tables, &error).empty());
  EXPECT_EQ(error, "module type Hinge: joint does not connect two links");
}

}  // namespace
}  // namespace morphbus::vm
