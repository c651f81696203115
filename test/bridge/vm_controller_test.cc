// The VM as a module's controller: saved and restored, and with a program deployed from outside.

#include "bridge/module/vm_controller.h"

#include <gtest/gtest.h>

#include "bridge/wire/codec.h"
#include "bridge/wire/held_state.h"
#include "bridge/wire/vm_codec.h"
#include "bridge/wire/wire_limits.h"
#include "test/bridge/fake_images.h"
#include "test/vm/image_builder.h"
#include "vm/image/kinematics_verifier.h"
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

uint64_t HashOf(const std::vector<uint8_t>& image) {
  vm::VerifiedProgram program;
  EXPECT_EQ(
      vm::Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), &program).message,
      nullptr);
  return program.hash();
}

/// The package of an image that is to run from this tick of the root's clock on.
std::vector<uint8_t> PackageOf(const std::vector<uint8_t>& image, int64_t switch_tick) {
  std::vector<uint8_t> package(vm::kPackageHeadBytes);
  vm::WritePackageHead({switch_tick, 0}, package.data());
  package.insert(package.end(), image.begin(), image.end());
  return package;
}

/// The pieces of a package, as SENSORS brings them.
std::vector<morphbus::deploy_piece_t> PiecesOf(const std::vector<uint8_t>& package, uint64_t id) {
  std::vector<morphbus::deploy_piece_t> pieces;
  for (size_t at = 0; at < package.size(); at += kMaxDeployPiece) {
    morphbus::deploy_piece_t& piece = pieces.emplace_back();
    piece.module_id = 3;
    piece.hash = static_cast<int64_t>(id);
    piece.image_size = static_cast<int32_t>(package.size());
    piece.offset = static_cast<int32_t>(at);
    const size_t end = std::min(package.size(), at + kMaxDeployPiece);
    piece.bytes.assign(package.begin() + static_cast<long>(at),
                       package.begin() + static_cast<long>(end));
    piece.size = static_cast<int16_t>(end - at);
  }
  return pieces;
}

/// All pieces of an image's package, under the id that is right if the image's hash is `hash`.
void Deploy(VmController* controller, const std::vector<uint8_t>& image, uint64_t hash,
            int64_t switch_tick = 1) {
  const std::vector<uint8_t> package = PackageOf(image, switch_tick);
  for (const auto& piece : PiecesOf(package, vm::PackageId(hash, {switch_tick, 0}))) {
    controller->TakePiece(piece);
  }
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
  for (const morphbus::status_t& status : controller->Describe(output.status, false)) add(status);
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

TEST(VmControllerTest, WhoIsInspectedTellsFieldsTasksAndCallsAndIsNotChangedByIt) {
  const Images images(CountingProgram());
  VmController asked(Root(), images.kinematics, images.program);
  VmController quiet(Root(), images.kinematics, images.program);
  for (int64_t tick = 0; tick < 40; ++tick) {
    vm::TickOutput told{}, untold{};
    asked.Tick(InputAt(tick), &told);
    quiet.Tick(InputAt(tick), &untold);
    const std::vector<morphbus::status_t> messages = asked.Describe(told.status, true);
    ASSERT_EQ(BytesOf(told, &asked), BytesOf(untold, &quiet)) << "tick " << tick;
    ASSERT_EQ(messages.size(), 1U);
    const Result<HeldState> held = JoinHeld(messages.front().inspections);
    ASSERT_TRUE(held);
    // Without a role there is nothing to tell, and that is told.
    const vm::VmState& state = asked.state();
    ASSERT_EQ(held->fields.size(), state.role.role < 0 ? 0U : 1U);
    if (tick < 39) continue;
    ASSERT_EQ(state.role.role, 0);
    EXPECT_EQ(held->fields[0].name, "field");
    EXPECT_EQ(held->fields[0].type, "int");
    EXPECT_EQ(held->fields[0].value, std::to_string(state.role.fields[0].AsInt()));
    EXPECT_GT(state.role.fields[0].AsInt(), 0);
    // The behavior waits until the joint has turned.
    ASSERT_EQ(held->tasks.size(), 1U);
    EXPECT_EQ(held->tasks[0].kind, vm::TaskKind::kBehavior);
    EXPECT_EQ(held->tasks[0].routine, "R.go");
    EXPECT_EQ(held->tasks[0].wait, vm::WaitKind::kMotion);
    EXPECT_EQ(held->tasks[0].joint, "joint_1");
    ASSERT_EQ(held->tasks[0].calls.size(), 1U);
    EXPECT_EQ(held->tasks[0].calls[0].function, "R.go");
  }
}

TEST(VmControllerTest, AControllerThatBeginsAnewIsAsOneThatWasJustMade) {
  const Images images(CountingProgram());
  VmController old(Root(), images.kinematics, images.program);
  Deploy(&old, EmptyProgram(), HashOf(EmptyProgram()));
  SavedAfter(&old, 0, 70);
  ASSERT_NE(old.program().hash(), images.program.hash());
  old.BeginAnew(2);
  vm::VmConfig config = Root();
  config.incarnation = 2;
  VmController fresh(config, images.kinematics, images.program);
  for (int64_t tick = 70; tick < 140; ++tick) {
    vm::TickOutput of_old{}, of_fresh{};
    old.Tick(InputAt(tick), &of_old);
    fresh.Tick(InputAt(tick), &of_fresh);
    ASSERT_EQ(BytesOf(of_old, &old), BytesOf(of_fresh, &fresh)) << tick;
    EXPECT_EQ(of_old.message.incarnation, 2u);
  }
  std::vector<uint8_t> saved_old, saved_fresh;
  old.Save(&saved_old);
  fresh.Save(&saved_fresh);
  // They exchange their states: only bytes of padding, which no code reads, may differ.
  ASSERT_EQ(saved_old.size(), saved_fresh.size());
  ASSERT_TRUE(old.Load(saved_fresh.data(), saved_fresh.size()));
  ASSERT_TRUE(fresh.Load(saved_old.data(), saved_old.size()));
  for (int64_t tick = 140; tick < 180; ++tick) {
    vm::TickOutput of_old{}, of_fresh{};
    old.Tick(InputAt(tick), &of_old);
    fresh.Tick(InputAt(tick), &of_fresh);
    ASSERT_EQ(BytesOf(of_old, &old), BytesOf(of_fresh, &fresh)) << tick;
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
  EXPECT_EQ(output.message.news.hash, vm::PackageId(hash, {1, 0})) << "and the mates hear of it";
  VmController restored(Root(), images.kinematics, images.program);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  EXPECT_EQ(restored.program().hash(), hash);
}

TEST(VmControllerTest, ADeployedProgramWaitsForItsTickWhileMatesGetIt) {
  const Images images;
  const std::vector<uint8_t> next = EmptyProgram(5);
  const uint64_t id = vm::PackageId(HashOf(next), {8, 0});
  VmController controller(Root(), images.kinematics, images.program),
      restored(Root(), images.kinematics, images.program);
  SavedAfter(&controller, 0, 3);
  Deploy(&controller, next, HashOf(next), 8);
  for (int64_t tick = 3; tick < 8; ++tick) {
    vm::TickOutput output{};
    controller.Tick(InputAt(tick), &output);
    EXPECT_EQ(output.message.program_hash, images.program.hash()) << "tick " << tick;
    EXPECT_EQ(output.message.news.hash, id) << "tick " << tick;
  }
  // Killed while it waits, it goes over to it in the same tick all the same.
  const std::vector<uint8_t> saved = SavedAfter(&controller, 8, 8);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  for (VmController* each : {&controller, &restored}) {
    EXPECT_EQ(each->program().hash(), images.program.hash());
    vm::TickOutput output{};
    each->Tick(InputAt(8), &output);
    EXPECT_EQ(output.message.program_hash, HashOf(next));
  }
}

TEST(VmControllerTest, WhoHasNoRootsClockGoesOverAtOnce) {
  const Images images;
  const std::vector<uint8_t> next = EmptyProgram(5);
  vm::VmConfig config = Root();
  config.is_root = false;
  VmController controller(config, images.kinematics, images.program);
  SavedAfter(&controller, 0, 3);
  Deploy(&controller, next, HashOf(next), 1000);
  SavedAfter(&controller, 3, 4);
  EXPECT_EQ(controller.program().hash(), HashOf(next));
}

TEST(VmControllerTest, ANewerDeploymentTakesThePlaceOfOneThatWaits) {
  const Images images;
  const std::vector<uint8_t> first = EmptyProgram(5), second = EmptyProgram(6);
  VmController controller(Root(), images.kinematics, images.program);
  SavedAfter(&controller, 0, 3);
  Deploy(&controller, first, HashOf(first), 8);
  SavedAfter(&controller, 3, 4);
  Deploy(&controller, second, HashOf(second), 12);
  SavedAfter(&controller, 4, 12);
  EXPECT_EQ(controller.program().hash(), images.program.hash());
  SavedAfter(&controller, 12, 13);
  EXPECT_EQ(controller.program().hash(), HashOf(second));
}

TEST(VmControllerTest, PiecesMayComeInAnyOrderAndAgain) {
  const Images images;
  const std::vector<uint8_t> next = CountingProgram();
  VmController controller(Root(), images.kinematics, images.program);
  std::vector<morphbus::deploy_piece_t> pieces =
      PiecesOf(PackageOf(next, 1), vm::PackageId(HashOf(next), {1, 0}));
  ASSERT_GT(pieces.size(), 1u);
  for (size_t i = pieces.size(); i > 0; --i) {
    for (int again = 0; again < 2; ++again) controller.TakePiece(pieces[i - 1]);
  }
  vm::TickOutput output{};
  controller.Tick(InputAt(0), &output);
  controller.Tick(InputAt(1), &output);
  EXPECT_EQ(controller.program().hash(), HashOf(next));
  const uint32_t version = output.message.news.version;
  // What comes after the whole begins nothing anew.
  for (const auto& piece : pieces) controller.TakePiece(piece);
  controller.Tick(InputAt(2), &output);
  EXPECT_EQ(output.message.news.version, version);
}

TEST(VmControllerTest, ADeploymentSavedHalfwayIsFinishedAfterwards) {
  const Images images;
  const std::vector<uint8_t> next = CountingProgram();
  VmController controller(Root(), images.kinematics, images.program),
      restored(Root(), images.kinematics, images.program);
  const std::vector<morphbus::deploy_piece_t> pieces =
      PiecesOf(PackageOf(next, 1), vm::PackageId(HashOf(next), {1, 0}));
  controller.TakePiece(pieces[0]);
  const std::vector<uint8_t> saved = SavedAfter(&controller, 0, 2);
  ASSERT_TRUE(restored.Load(saved.data(), saved.size()));
  for (size_t i = 1; i < pieces.size(); ++i) restored.TakePiece(pieces[i]);
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
  // A package whose head has been damaged: it would run at another tick than it was deployed for.
  const std::vector<uint8_t> sound = EmptyProgram(5);
  const uint64_t id = vm::PackageId(HashOf(sound), {2, 0});
  for (const size_t at : {size_t{0}, size_t{5}, size_t{8}, size_t{15}}) {
    std::vector<uint8_t> package = PackageOf(sound, 2);
    package[at] ^= 1;
    for (const auto& piece : PiecesOf(package, id)) controller.TakePiece(piece);
  }
  SavedAfter(&controller, 0, 3);
  EXPECT_EQ(controller.program().hash(), images.program.hash());
}

TEST(VmControllerTest, PiecesThatDoNotLieOnTheGridAreDropped) {
  const Images images;
  const std::vector<uint8_t> next = CountingProgram();
  VmController controller(Root(), images.kinematics, images.program);
  const auto pieces = PiecesOf(PackageOf(next, 1), vm::PackageId(HashOf(next), {1, 0}));
  for (morphbus::deploy_piece_t piece : pieces) {
    for (const int offset : {piece.offset + 1, piece.image_size, piece.image_size + 1000}) {
      morphbus::deploy_piece_t moved = piece;
      moved.offset = offset;
      controller.TakePiece(moved);
    }
    piece.image_size += 1;
    controller.TakePiece(piece);
    piece.image_size -= 1;
    piece.bytes.pop_back();
    controller.TakePiece(piece);
  }
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
