#include "test/bridge/fake_images.h"

#include <string>

#include "compiler/base/check.h"
#include "test/bridge/fake_run.h"
#include "vm/image/image.h"
#include "vm/image/kinematics_encoder.h"

namespace morphbus::bridge {

std::vector<uint8_t> FakeKinematics() {
  vm::KinematicsTables tables;
  tables.type_name = "FAKE";
  tables.model_hash = kFakeModel;
  tables.links = {"base", "middle", "tip"};
  for (int i = 0; i < 2; ++i) {
    vm::KinematicsTables::Joint joint;
    joint.name = i == 0 ? "joint_1" : "joint_2";
    joint.link_a = i + 1;
    joint.link_b = i;
    joint.origin_m = {0, 0, 0.05F * static_cast<float>(i)};
    joint.axis = {0, 1, 0};
    joint.lower = -2;
    joint.upper = 2;
    joint.speed = 1;
    tables.joints.push_back(joint);
  }
  tables.connectors = {{"c1", 0, {}}, {"c2", 2, {}}};
  vm::KinConnection up;
  up.number = 5;
  up.connector = 1;
  up.mate_connector = 0;
  up.X_MN.p = {0, 0, 0.1F};
  vm::KinConnection down = up;
  down.connector = 0;
  down.mate_connector = 1;
  down.X_MN.p = {0, 0, -0.1F};
  tables.connections = {up, down};
  std::string error;
  std::vector<uint8_t> image = vm::EncodeKinematics(tables, &error);
  MORPHBUS_CHECK(error.empty());
  return image;
}

std::vector<uint8_t> EmptyProgram(uint16_t settle_ticks) {
  namespace image = vm::image;
  std::vector<uint8_t> bytes(image::kHeaderBytes, 0);
  const auto put = [&bytes](uint32_t at, uint64_t value, uint32_t size) {
    for (uint32_t i = 0; i < size; ++i) bytes[at + i] = static_cast<uint8_t>(value >> (8 * i));
  };
  put(0, image::kMagic, 4);
  put(image::kVersionAt, image::kVersion, 2);
  put(image::kSettleTicksAt, settle_ticks, 2);
  put(image::kSizeAt, image::kHeaderBytes, 4);
  put(image::kBudgetAt, image::kDefaultBudget, 4);
  put(image::kHashAt, image::HashOf(bytes.data(), image::kHeaderBytes), 8);
  return bytes;
}

}  // namespace morphbus::bridge
