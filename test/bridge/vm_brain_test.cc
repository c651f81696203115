// The VM as a module's brain: saved and restored, and with a program deployed from outside.

#include "bridge/vm_brain.h"

#include <gtest/gtest.h>

#include "test/bridge/fake_images.h"
#include "vm/verifier.h"

namespace morphbus::bridge {
namespace {

struct Images {
  std::vector<uint8_t> kinematics_bytes = FakeKinematics();
  std::vector<uint8_t> program_bytes = EmptyProgram();
  vm::VerifiedKinematics kinematics;
  vm::VerifiedProgram program;

  Images() {
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

/// A root module with one joint moving and nobody around.
vm::TickInput InputAt(int64_t tick) {
  vm::TickInput input;
  input.tick = tick;
  input.sim_time_us = tick * 20000;
  input.joint_position[0] = 0.01 * static_cast<double>(tick);
  return input;
}

vm::VmConfig Root() {
  vm::VmConfig config;
  config.module_id = 3;
  config.is_root = true;
  return config;
}

std::vector<uint8_t> SavedAfter(VmBrain* brain, int64_t from, int64_t to) {
  for (int64_t tick = from; tick < to; ++tick) {
    vm::TickOutput output{};
    brain->Tick(InputAt(tick), &output);
  }
  std::vector<uint8_t> saved;
  brain->Save(&saved);
  return saved;
}

/// All pieces of an image, as SENSORS brings them.
void Deploy(VmBrain* brain, const std::vector<uint8_t>& image, uint64_t hash) {
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
    brain->TakePiece(piece);
  }
}

uint64_t HashOf(const std::vector<uint8_t>& image) {
  vm::VerifiedProgram program;
  EXPECT_EQ(
      vm::Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), &program).message,
      nullptr);
  return program.hash();
}

TEST(VmBrainTest, ARestoredBrainGoesOnAsIfNothingHadHappened) {
  const Images images;
  VmBrain whole(Root(), images.kinematics, images.program);
  VmBrain before(Root(), images.kinematics, images.program);
  VmBrain after(Root(), images.kinematics, images.program);
  const std::vector<uint8_t> middle = SavedAfter(&before, 0, 20);
  ASSERT_TRUE(after.Load(middle.data(), middle.size()));
  vm::TickOutput expected{}, resumed{};
  SavedAfter(&whole, 0, 20);
  whole.Tick(InputAt(20), &expected);
  after.Tick(InputAt(20), &resumed);
  EXPECT_TRUE(resumed.message.has_pose);
  EXPECT_EQ(resumed.message.root_sequence, expected.message.root_sequence);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(resumed.message.X_RL[i].q.w, expected.message.X_RL[i].q.w);
    EXPECT_EQ(resumed.message.X_RL[i].p.x, expected.message.X_RL[i].p.x);
  }
}

TEST(VmBrainTest, ADeployedProgramRunsFromTheNextTickAndSurvivesARestore) {
  const Images images;
  const std::vector<uint8_t> next = EmptyProgram(5);
  const uint64_t hash = HashOf(next);
  ASSERT_NE(hash, images.program.hash());
  VmBrain brain(Root(), images.kinematics, images.program);
  SavedAfter(&brain, 0, 3);
  Deploy(&brain, next, hash);
  const std::vector<uint8_t> saved = SavedAfter(&brain, 3, 5);
  EXPECT_EQ(brain.program().hash(), hash);
  vm::TickOutput output{};
  brain.Tick(InputAt(5), &output);
  EXPECT_EQ(output.message.program_hash, hash);
  EXPECT_EQ(output.message.news.hash, hash) << "and the mates hear of it";
  VmBrain restored(Root(), images.kinematics, images.program);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  EXPECT_EQ(restored.program().hash(), hash);
}

TEST(VmBrainTest, ADeploymentSavedHalfwayIsFinishedAfterwards) {
  const Images images;
  const std::vector<uint8_t> next = EmptyProgram(5);
  VmBrain brain(Root(), images.kinematics, images.program),
      restored(Root(), images.kinematics, images.program);
  morphbus::deploy_piece_t piece;
  piece.module_id = 3;
  piece.hash = static_cast<int64_t>(HashOf(next));
  piece.image_size = static_cast<int32_t>(next.size());
  piece.offset = 0;
  piece.size = 10;
  piece.bytes.assign(next.begin(), next.begin() + 10);
  brain.TakePiece(piece);
  const std::vector<uint8_t> saved = SavedAfter(&brain, 0, 2);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  piece.offset = 10;
  piece.size = static_cast<int16_t>(next.size() - 10);
  piece.bytes.assign(next.begin() + 10, next.end());
  restored.TakePiece(piece);
  SavedAfter(&restored, 2, 4);
  EXPECT_EQ(restored.program().hash(), HashOf(next));
}

TEST(VmBrainTest, DamagedOrMisorderedDeploymentsChangeNothing) {
  const Images images;
  std::vector<uint8_t> next = EmptyProgram(5);
  const uint64_t hash = HashOf(next);
  VmBrain brain(Root(), images.kinematics, images.program);
  Deploy(&brain, next, hash + 1);
  next[next.size() / 2] ^= 1;
  Deploy(&brain, next, hash);
  SavedAfter(&brain, 0, 3);
  EXPECT_EQ(brain.program().hash(), images.program.hash());
}

TEST(VmBrainTest, StatesOfOtherSizesAreRefused) {
  const Images images;
  VmBrain brain(Root(), images.kinematics, images.program);
  std::vector<uint8_t> saved = SavedAfter(&brain, 0, 2);
  EXPECT_FALSE(brain.Load(saved.data(), saved.size() - 1));
  EXPECT_FALSE(brain.Load(saved.data(), 4));
  saved[0] ^= 1;
  EXPECT_FALSE(brain.Load(saved.data(), saved.size()));
}

}  // namespace
}  // namespace morphbus::bridge
