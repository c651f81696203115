// The VM as a module's controller: saved and restored, and with a program deployed from outside.

#include "bridge/module/vm_controller.h"

#include <gtest/gtest.h>

#include "bridge/wire/codec.h"
#include "bridge/wire/vm_codec.h"
#include "test/bridge/fake_images.h"
#include "test/vm/image_builder.h"
#include "vm/image/verifier.h"

namespace morphbus::bridge {
namespace {

struct Images {
  std::vector<uint8_t> kinematics_bytes = FakeKinematics();
  std::vector<uint8_t> program_bytes;
  vm::VerifiedKinematics kinematics;
  vm::VerifiedProgram program;

  explicit Images(std::vector<uint8_t> program_image = EmptyProgram())
      : program_bytes(std::move(program_image)) {
    EXPECT_EQ(vm::VerifyKinematics(kinematics_bytes.data(),
                                   static_cast<uint32_t>(kinematics_bytes.size()), &kinematics)
                  .message,
              nullptr);
    EXPECT_EQ(vm::Verifier::Verify(program_bytes.data(),
                                   static_cast<uint32_t>(program_bytes.size()), &program)
                  .message,
              nullptr);
  }
};

/// A role whose behavior counts its turns and moves the first joint on by ten degrees each time.
std::vector<uint8_t> CountingProgram() {
  using vm::operator+;
  using vm::Op;
  using vm::Op16;
  using vm::Opcode;
  vm::TestImage image(Op(Opcode::kLoadField, {0}) + Op(Opcode::kPushInt8, {1}) +
                      Op(Opcode::kAddInt) + Op(Opcode::kStoreField, {0}) +
                      Op(Opcode::kKeyword, {0}) + Op16(Opcode::kPushConst, 0) +
                      Op(Opcode::kRotate) + Op(Opcode::kReturn));
  image.keywords = {{vm::KeywordKind::kJoint, "JOINT_1"}};
  image.constants = {{vm::ValueType::kFloat, vm::Bits(10.0F)}};
  image.roles[0].fields = {vm::TestField{}};
  image.roles[0].startups = {};
  image.roles[0].behaviors = {0};
  return image.Build();
}

/// A root module with nobody around and one joint that moves, until at tick 60 it gets stuck.
vm::TickInput InputAt(int64_t tick) {
  vm::TickInput input;
  input.tick = tick;
  input.sim_time_us = tick * 20000;
  input.joint_position[0] = 0.01 * static_cast<double>(std::min<int64_t>(tick, 60));
  return input;
}

vm::VmConfig Root() {
  vm::VmConfig config;
  config.module_id = 3;
  config.is_root = true;
  return config;
}

std::vector<uint8_t> SavedAfter(VmController* controller, int64_t from, int64_t to) {
  for (int64_t tick = from; tick < to; ++tick) {
    vm::TickOutput output{};
    controller->Tick(InputAt(tick), &output);
  }
  std::vector<uint8_t> saved;
  controller->Save(&saved);
  return saved;
}

/// All pieces of an image, as SENSORS brings them.
void Deploy(VmController* controller, const std::vector<uint8_t>& image, uint64_t hash) {
  for (size_t at = 0; at < image.size(); at += 128) {
    morphbus::deploy_piece_t piece;
    piece.module_id = 3;
    piece.hash = static_cast<int64_t>(hash);
    piece.image_size = static_cast<int32_t>(image.size());
    piece.offset = static_cast<int32_t>(at);
    const size_t end = std::min(image.size(), at + 128);
    piece.bytes.assign(image.begin() + static_cast<long>(at),
                       image.begin() + static_cast<long>(end));
    piece.size = static_cast<int16_t>(end - at);
    controller->TakePiece(piece);
  }
}

uint64_t HashOf(const std::vector<uint8_t>& image) {
  vm::VerifiedProgram program;
  EXPECT_EQ(
      vm::Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), &program).message,
      nullptr);
  return program.hash();
}

/// All bytes that a module sends for one tick.
std::vector<uint8_t> BytesOf(const vm::TickOutput& output, VmController* controller) {
  std::vector<uint8_t> all, one;
  const auto add = [&](auto message) {
    message.header = {};
    Encode(message, &one);
    all.insert(all.end(), one.begin(), one.end());
  };
  morphbus::transform_t transform;
  ToTransform(output.message, &transform);
  add(transform);
  morphbus::actuator_t actuator;
  ToActuator(output, 3, 2, 0, &actuator);
  add(actuator);
  for (const morphbus::status_t& status : controller->Describe(output.status)) add(status);
  return all;
}

TEST(VmControllerTest, ARestoredControllerGoesOnAsIfNothingHadHappened) {
  const Images images(CountingProgram());
  VmController whole(Root(), images.kinematics, images.program);
  VmController before(Root(), images.kinematics, images.program);
  VmController after(Root(), images.kinematics, images.program);
  SavedAfter(&whole, 0, 40);
  const std::vector<uint8_t> middle = SavedAfter(&before, 0, 40);
  ASSERT_TRUE(after.Load(middle.data(), middle.size()));
  bool stalled = false;
  for (int64_t tick = 40; tick < 120; ++tick) {
    vm::TickOutput expected{}, resumed{};
    whole.Tick(InputAt(tick), &expected);
    after.Tick(InputAt(tick), &resumed);
    ASSERT_EQ(BytesOf(resumed, &after), BytesOf(expected, &whole)) << "tick " << tick;
    stalled = stalled || expected.status.num_faults > 0;
  }
  EXPECT_TRUE(stalled) << "the program must have done something worth restoring";
  // Both are saved and exchange their states: only bytes of padding, which no code reads, may
  // differ.
  std::vector<uint8_t> saved_whole, saved_after;
  whole.Save(&saved_whole);
  after.Save(&saved_after);
  ASSERT_EQ(saved_after.size(), saved_whole.size());
  ASSERT_TRUE(after.Load(saved_whole.data(), saved_whole.size()));
  ASSERT_TRUE(whole.Load(saved_after.data(), saved_after.size()));
  for (int64_t tick = 120; tick < 160; ++tick) {
    vm::TickOutput expected{}, resumed{};
    whole.Tick(InputAt(tick), &expected);
    after.Tick(InputAt(tick), &resumed);
    ASSERT_EQ(BytesOf(resumed, &after), BytesOf(expected, &whole)) << "tick " << tick;
  }
}

TEST(VmControllerTest, ADeployedProgramRunsFromTheNextTickAndSurvivesARestore) {
  const Images images;
  const std::vector<uint8_t> next = EmptyProgram(5);
  const uint64_t hash = HashOf(next);
  ASSERT_NE(hash, images.program.hash());
  VmController controller(Root(), images.kinematics, images.program);
  SavedAfter(&controller, 0, 3);
  Deploy(&controller, next, hash);
  const std::vector<uint8_t> saved = SavedAfter(&controller, 3, 5);
  EXPECT_EQ(controller.program().hash(), hash);
  vm::TickOutput output{};
  controller.Tick(InputAt(5), &output);
  EXPECT_EQ(output.message.program_hash, hash);
  EXPECT_EQ(output.message.news.hash, hash) << "and the mates hear of it";
  VmController restored(Root(), images.kinematics, images.program);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  EXPECT_EQ(restored.program().hash(), hash);
}

TEST(VmControllerTest, ADeploymentSavedHalfwayIsFinishedAfterwards) {
  const Images images;
  const std::vector<uint8_t> next = EmptyProgram(5);
  VmController controller(Root(), images.kinematics, images.program),
      restored(Root(), images.kinematics, images.program);
  morphbus::deploy_piece_t piece;
  piece.module_id = 3;
  piece.hash = static_cast<int64_t>(HashOf(next));
  piece.image_size = static_cast<int32_t>(next.size());
  piece.offset = 0;
  piece.size = 10;
  piece.bytes.assign(next.begin(), next.begin() + 10);
  controller.TakePiece(piece);
  const std::vector<uint8_t> saved = SavedAfter(&controller, 0, 2);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  piece.offset = 10;
  piece.size = static_cast<int16_t>(next.size() - 10);
  piece.bytes.assign(next.begin() + 10, next.end());
  restored.TakePiece(piece);
  SavedAfter(&restored, 2, 4);
  EXPECT_EQ(restored.program().hash(), HashOf(next));
}

TEST(VmControllerTest, DamagedOrMisorderedDeploymentsChangeNothing) {
  const Images images;
  std::vector<uint8_t> next = EmptyProgram(5);
  const uint64_t hash = HashOf(next);
  VmController controller(Root(), images.kinematics, images.program);
  Deploy(&controller, next, hash + 1);
  next[next.size() / 2] ^= 1;
  Deploy(&controller, next, hash);
  SavedAfter(&controller, 0, 3);
  EXPECT_EQ(controller.program().hash(), images.program.hash());
}

TEST(VmControllerTest, StatesOfOtherSizesAreRefused) {
  const Images images;
  VmController controller(Root(), images.kinematics, images.program);
  std::vector<uint8_t> saved = SavedAfter(&controller, 0, 2);
  EXPECT_FALSE(controller.Load(saved.data(), saved.size() - 1));
  EXPECT_FALSE(controller.Load(saved.data(), 4));
  saved[0] ^= 1;
  EXPECT_FALSE(controller.Load(saved.data(), saved.size()));
}

}  // namespace
}  // namespace morphbus::bridge
