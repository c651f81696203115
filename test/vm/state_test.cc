#include "vm/run/state.h"

#include <gtest/gtest.h>

#include "test/support/compiled.h"
#include "test/support/vm_robot.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;

/// A digest of all that leaves a module in a tick.
uint64_t DigestOf(const TickOutput& output);

TEST(StateTest, SavedAndRestoredByteForByteAtEveryTickARobotGoesOnAsIfNothingHadHappened) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const std::vector<uint8_t> program =
      test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), model);
  const model::Robot& robot = *model.FindRobot("quadruped");
  VmRobot plain(model, robot, program), restored(model, robot, program);
  for (int i = 0; i < 1000; ++i) {
    plain.Tick();
    restored.Tick();
    for (int m = 0; m < 9; ++m) {
      restored.SaveAndRestore(m);
      ASSERT_EQ(DigestOf(plain.output(m)), DigestOf(restored.output(m)))
          << "tick " << i << " module " << m + 1;
    }
  }
  EXPECT_EQ(plain.joints(), restored.joints());
}

TEST(StateTest, EqualInputsGiveEqualOutputs) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const std::vector<uint8_t> program =
      test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), model);
  test::VmRobotOptions options;
  options.loss = 0.2;
  options.grace_ticks = 20;
  VmRobot a(model, *model.FindRobot("quadruped"), program, options);
  VmRobot b(model, *model.FindRobot("quadruped"), program, options);
  for (int i = 0; i < 500; ++i) {
    a.Tick();
    b.Tick();
    for (int m = 0; m < 9; ++m) ASSERT_EQ(DigestOf(a.output(m)), DigestOf(b.output(m)));
  }
}

TEST(StateTest, TheStateFitsAMicrocontroller) {
  // 64 KiB of RAM are common; half of them are for the state.
  EXPECT_LE(sizeof(VmState), 32768u);
}

class Fold {
 public:
  template <typename T>
  void Add(const T& value) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
    for (size_t i = 0; i < sizeof(value); ++i) hash_ = (hash_ ^ bytes[i]) * 0x100000001b3ULL;
  }
  [[nodiscard]] uint64_t value() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325ULL;
};

void AddMessage(const NeighbourMessage& m, Fold* fold) {
  fold->Add(m.tick);
  fold->Add(m.role);
  fold->Add(m.has_pose);
  fold->Add(m.root_sequence);
  fold->Add(m.hops);
  for (int i = 0; i < m.num_links; ++i) fold->Add(m.X_RL[i]);
  fold->Add(m.num_docked);
  for (int i = 0; i < m.num_body_entries; ++i) {
    fold->Add(m.body_entries[i].link);
    fold->Add(m.body_entries[i].joint);
    fold->Add(m.body_entries[i].module);
    fold->Add(m.body_entries[i].stamp);
  }
  for (int i = 0; i < m.num_invocations; ++i) {
    fold->Add(m.invocations[i].origin);
    fold->Add(m.invocations[i].id);
    fold->Add(m.invocations[i].role);
    fold->Add(m.invocations[i].command);
  }
  for (int i = 0; i < m.num_acks; ++i) {
    fold->Add(m.acks[i].origin);
    fold->Add(m.acks[i].id);
    fold->Add(m.acks[i].floor);
  }
}

uint64_t DigestOf(const TickOutput& output) {
  Fold fold;
  AddMessage(output.message, &fold);
  for (const JointCommand& joint : output.joints) {
    fold.Add(joint.mode);
    fold.Add(joint.target);
    fold.Add(joint.speed);
  }
  const StatusReport& status = output.status;
  fold.Add(status.changed);
  fold.Add(status.role);
  fold.Add(status.num_tasks);
  for (int i = 0; i < status.num_tasks; ++i) {
    fold.Add(status.tasks[i].kind);
    fold.Add(status.tasks[i].function);
    fold.Add(status.tasks[i].line);
  }
  for (int i = 0; i < status.num_faults; ++i) fold.Add(status.faults[i].code);
  return fold.value();
}

}  // namespace
}  // namespace morphbus::vm
