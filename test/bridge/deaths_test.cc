// Modules that are killed and resumed, begin anew, or are lost: whole runs on the in-process bus.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>

#include "test/bridge/fake_run.h"
#include "test/bridge/whole_run.h"

namespace morphbus::bridge {
namespace {

TEST(Deaths, AModuleKilledAndResumedAtAnyTickChangesNoPayload) {
  FakeRunOptions options;
  const std::string reference = HashOf(options);
  for (int64_t kill_tick = 0; kill_tick < options.ticks; kill_tick += 3) {
    options.loss = kill_tick % 2 == 0 ? 0 : 0.2;
    FakeRun run(options);
    FakeRun::Module& victim = run.modules[1];
    std::vector<uint8_t> snapshot;
    bool kill = false;
    const auto keep = [&](const std::vector<uint8_t>& bytes) {
      snapshot = bytes;
      kill = kill || static_cast<int64_t>(victim.controller->computed.size()) == kill_tick + 1;
    };
    victim.participant->OnBeforePublish(keep);
    for (Participant* participant : run.participants()) participant->Start();
    std::vector<int64_t> computed;
    while (!run.sim->done()) {
      if (kill) {
        kill = false;
        computed = victim.controller->computed;
        // A new process: new controller, new participant, nothing but the snapshot; its queue is
        // gone, too.
        victim.participant.reset();
        victim.seat = std::make_unique<FakeRun::Seat>(&run, options.loss, 77);
        victim.controller = std::make_unique<FakeController>(1);
        victim.participant = std::make_unique<ModuleParticipant>(
            &victim.seat->bus, victim.controller.get(), &run.time, run.ModuleOptions(1));
        victim.participant->OnBeforePublish(
            [&](const std::vector<uint8_t>& bytes) { snapshot = bytes; });
        ASSERT_TRUE(victim.participant->ResumeFrom(snapshot));
        victim.participant->Start();
      }
      if (run.hub.HandleRound() > 0) continue;
      run.time.AdvanceTo(run.time.NowUs() + 1000);
      for (Participant* participant : run.participants()) participant->OnTime();
    }
    ASSERT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
    EXPECT_EQ(run.sim->outcome().run_hash, reference) << "killed at tick " << kill_tick;
    computed.insert(computed.end(), victim.controller->computed.begin(),
                    victim.controller->computed.end());
    EXPECT_EQ(computed, Upto(options.ticks)) << "nothing is computed twice";
  }
}

/// Puts another process in a module's place, which has heard nothing of what was said to the old
/// one; the old one is gone with all that it knew, but for the snapshot, if there is one.
void Replace(FakeRun* run, size_t module, uint32_t incarnation,
             const std::vector<uint8_t>& snapshot) {
  FakeRun::Module& victim = run->modules[module];
  victim.participant.reset();
  victim.seat = std::make_unique<FakeRun::Seat>(run, run->options.loss, 77);
  victim.controller = std::make_unique<FakeController>(static_cast<uint16_t>(module));
  ModuleParticipantOptions options = run->ModuleOptions(static_cast<int>(module));
  options.incarnation = incarnation;
  options.claim = 555;
  victim.participant = std::make_unique<ModuleParticipant>(
      &victim.seat->bus, victim.controller.get(), &run->time, options);
  if (!snapshot.empty()) {
    ASSERT_TRUE(victim.participant->ResumeFrom(snapshot));
  }
  victim.participant->Start();
}

/// Ticks from one up to another.
std::vector<int64_t> Between(int64_t from, int64_t end) {
  std::vector<int64_t> ticks(static_cast<size_t>(end - from));
  std::iota(ticks.begin(), ticks.end(), from);
  return ticks;
}

TEST(Deaths, AModuleThatBeginsAnewBetweenTwoTicksGoesOnWithNumbersAndHashes) {
  std::string hash;
  for (const double loss : {0.0, 0.3}) {
    FakeRunOptions options;
    options.loss = loss;
    FakeRun run(options);
    std::vector<uint8_t> snapshot;
    run.modules[1].participant->OnBeforePublish(
        [&](const std::vector<uint8_t>& bytes) { snapshot = bytes; });
    run.sim->OnAfterTick([&](int64_t tick) {
      if (tick != 20) return;
      run.sim->SetBarrier([] {});
    });
    ASSERT_TRUE(run.RunUntil([&] { return run.modules[1].participant->tick() == 21; }));
    Replace(&run, 1, 2, snapshot);
    // The next tick is out only now.
    EXPECT_EQ(run.sim->tick(), 20);
    run.sim->PassBarrier();
    ASSERT_TRUE(run.Run());
    EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
    EXPECT_EQ(run.modules[1].controller->computed, Between(21, options.ticks));
    EXPECT_EQ(run.sim->outcome().recorded_hash, run.sim->outcome().run_hash);
    // Where and under which losses makes no difference; that it knew nothing does.
    EXPECT_NE(run.sim->outcome().run_hash, HashOf({}));
    EXPECT_TRUE(hash.empty() || hash == run.sim->outcome().run_hash);
    hash = run.sim->outcome().run_hash;
  }
}

TEST(Deaths, AModuleThatLeftNothingBehindIsReplacedByALaterIncarnationAlone) {
  FakeRunOptions options;
  FakeRun run(options);
  ASSERT_TRUE(run.RunUntil([&] { return run.sim->tick() == 10; }));
  std::vector<std::pair<size_t, int64_t>> replaced;
  run.sim->OnReplaced([&](size_t m, int64_t tick) { replaced.emplace_back(m, tick); });
  // While the module answers, nobody takes its place.
  ModuleParticipantOptions rival = run.ModuleOptions(1);
  rival.incarnation = 9;
  rival.claim = 999;
  FakeController controller(1);
  FakeRun::Seat seat(&run, 0, 1);
  ModuleParticipant usurper(&seat.bus, &controller, &run.time, rival);
  usurper.Start();
  ASSERT_TRUE(run.RunUntil([&] { return run.sim->tick() == 20; }));
  EXPECT_TRUE(replaced.empty());
  EXPECT_TRUE(controller.computed.empty());
  ASSERT_EQ(run.sim->members().turned_away().size(), 1u);
  EXPECT_NE(run.sim->members().turned_away()[0].find("incarnation 9 of m2, which answers"),
            std::string::npos);
  // It dies without a trace in the middle of a tick.
  Replace(&run, 1, 2, {});
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  ASSERT_EQ(replaced.size(), 1u);
  EXPECT_EQ(run.modules[1].controller->computed, Between(replaced[0].second, options.ticks));
  EXPECT_EQ(run.sim->outcome().run_hash, run.log->run_hash())
      << "the logger's word is all there is";
  EXPECT_FALSE(run.sim->outcome().run_hash.empty());
  EXPECT_TRUE(run.log->complete()) << run.log->error();
}

TEST(Deaths, ARunGoesOnWithoutAModuleThatIsLostAndItsHashIsThatOfEveryLoss) {
  std::string hash;
  for (const double loss : {0.0, 0.2, 0.5}) {
    FakeRunOptions options;
    options.loss = loss;
    FakeRun run(options);
    run.sim->OnAfterTick([&](int64_t tick) {
      if (tick == 14) run.sim->Lose(1);
    });
    run.sim->OnBeforeTick([&](int64_t tick) {
      if (tick == 15) run.sim->AnnounceControl("lose m2");
    });
    ASSERT_TRUE(run.Run());
    const SimOutcome& outcome = run.sim->outcome();
    EXPECT_TRUE(outcome.ok) << outcome.error;
    EXPECT_EQ(outcome.reason, "finished, without m2");
    EXPECT_EQ(outcome.ticks, options.ticks);
    EXPECT_EQ(run.modules[1].controller->computed, Upto(15));
    EXPECT_EQ(run.modules[1].participant->error(), "");
    for (const size_t other : {0, 2}) {
      EXPECT_EQ(run.modules[other].controller->computed, Upto(options.ticks));
      EXPECT_EQ(run.modules[other].controller->missing_messages, 0);
    }
    EXPECT_TRUE(run.log->complete()) << run.log->error();
    EXPECT_EQ(outcome.recorded_hash, outcome.run_hash);
    EXPECT_TRUE(hash.empty() || hash == outcome.run_hash) << "loss " << loss;
    hash = outcome.run_hash;
  }
}

TEST(Deaths, InItsLastTickARunLosesNobody) {
  for (const bool realtime : {false, true}) {
    FakeRunOptions options;
    options.realtime = realtime;
    FakeRun run(options);
    run.sim->OnAfterTick([&](int64_t tick) {
      if (tick == options.ticks - 1) run.sim->Lose(1);
    });
    ASSERT_TRUE(run.Run());
    EXPECT_EQ(run.sim->outcome().reason, "finished");
    EXPECT_EQ(run.modules[1].controller->computed, Upto(options.ticks));
  }
}

TEST(Deaths, AModuleThatIsLostAndKilledDoesNotComeBack) {
  FakeRun run({});
  std::vector<uint8_t> snapshot;
  run.modules[1].participant->OnBeforePublish(
      [&](const std::vector<uint8_t>& bytes) { snapshot = bytes; });
  run.sim->OnAfterTick([&](int64_t tick) {
    if (tick == 14) run.sim->Lose(1);
  });
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 15) run.sim->AnnounceControl("lose m2");
  });
  ASSERT_TRUE(run.RunUntil([&] { return run.sim->tick() == 20; }));
  Replace(&run, 1, 1, snapshot);
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_TRUE(run.modules[1].controller->computed.empty());
}

TEST(Deaths, AModuleThatIsKilledAfterItsLastWordEndsWithTheRun) {
  const std::string reference = HashOf({});
  for (const bool sim_has_gone : {false, true}) {
    for (const double loss : {0.0, 0.4}) {
      FakeRunOptions options;
      options.loss = loss;
      FakeRun run(options);
      std::vector<uint8_t> snapshot;
      SnapshotHead head;
      run.modules[1].participant->OnBeforePublish([&](const std::vector<uint8_t>& bytes) {
        snapshot = bytes;
        std::memcpy(&head, bytes.data(), sizeof head);
      });
      ASSERT_TRUE(run.RunUntil(
          [&] { return sim_has_gone ? run.sim->done() : head.told == Farewell::kEnd; }));
      ASSERT_EQ(head.told, Farewell::kEnd);
      Replace(&run, 1, 1, snapshot);
      ASSERT_TRUE(run.Run());
      EXPECT_EQ(run.modules[1].participant->error(), "") << sim_has_gone << loss;
      EXPECT_TRUE(run.modules[1].controller->computed.empty());
      EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
      EXPECT_EQ(run.sim->outcome().run_hash, reference);
    }
  }
}

/// A simulator of two modules and a logger in tick 1, which both have answered, and before tick 2
/// module 1 is to be lost; the logger has tick 0.
SimLockstep AboutToLose() {
  SimLockstep::Config config;
  config.num_modules = 2;
  config.logger = true;
  SimLockstep sim(config);
  SimLockstep::Actions out;
  sim.Begin(0, &out);
  for (int process = 0; process < 3; ++process) sim.OnHello(process, 0, &out);
  for (const int module : {0, 1}) sim.OnActuator(module, 0, 0, &out);
  sim.OnLogAck(0, 0, &out);
  sim.Lose(1, 0, &out);
  for (const int module : {0, 1}) sim.OnActuator(module, 1, 0, &out);
  EXPECT_EQ(sim.tick(), 1);
  return sim;
}

TEST(Deaths, AModuleIsToldToLeaveOnceTheLoggerHasAllThatItSaid) {
  SimLockstep sim = AboutToLose();
  SimLockstep::Actions out;
  // However long that takes, the logger alone is asked.
  for (int i = 0; i < 20; ++i) sim.OnTime(sim.next_deadline_us(), &out);
  EXPECT_GT(std::ranges::count(out, SimAction::Kind::kPollLogger, &SimAction::kind), 10);
  EXPECT_EQ(std::ranges::count(out, SimAction::Kind::kAskToLeave, &SimAction::kind), 0);
  out.clear();
  sim.OnLogAck(1, 1'000'000, &out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].kind, SimAction::Kind::kAskToLeave);
  EXPECT_EQ(out[0].process, 1);
  sim.OnEndAck(1, 1'000'000, &out);
  EXPECT_EQ(sim.tick(), 2);
}

TEST(Deaths, OfLoggerAndLostModuleTheOneIsNamedThatDoesNotAnswer) {
  SimLockstep sim = AboutToLose();
  SimLockstep::Actions out;
  sim.GiveUpOnSilent(0, &out);
  EXPECT_EQ(sim.silent(), std::vector<int>{2});
  sim = AboutToLose();
  sim.OnLogAck(1, 0, &out);
  sim.GiveUpOnSilent(0, &out);
  EXPECT_EQ(sim.silent(), std::vector<int>{1});
}

TEST(Deaths, AModuleThatWillNotLeaveIsNamed) {
  FakeRunOptions options;
  FakeRun run(options);
  run.sim->OnAfterTick([&](int64_t tick) {
    if (tick == 14) run.sim->Lose(1);
  });
  ASSERT_TRUE(run.RunUntil([&] { return run.modules[1].participant->tick() == 15; }));
  // It has answered, and falls silent for good.
  run.modules[1].seat = nullptr;
  while (!run.sim->done()) {
    if (run.hub.HandleRound() > 0) continue;
    run.time.AdvanceTo(run.time.NowUs() + 1000);
    run.sim->OnTime();
    run.log->OnTime();
    run.modules[0].participant->OnTime();
    run.modules[2].participant->OnTime();
  }
  EXPECT_EQ(run.sim->outcome().error, "m2 does not answer");
}

TEST(Deaths, ADamagedSnapshotIsRefused) {
  FakeRun run({});
  std::vector<uint8_t> snapshot;
  run.modules[1].participant->OnBeforePublish(
      [&](const std::vector<uint8_t>& bytes) { snapshot = bytes; });
  ASSERT_TRUE(run.Run());
  ASSERT_GT(snapshot.size(), 1000u);
  const auto resume = [&](const std::vector<uint8_t>& bytes, int module) {
    FakeController controller(static_cast<uint16_t>(module));
    FakeRun::Seat seat(&run, 0, 1);
    ModuleParticipant participant(&seat.bus, &controller, &run.time, run.ModuleOptions(module));
    return participant.ResumeFrom(bytes).has_value();
  };
  EXPECT_TRUE(resume(snapshot, 1));
  EXPECT_FALSE(resume(snapshot, 2)) << "another module's";
  for (size_t size = 0; size < snapshot.size(); size += 97) {
    EXPECT_FALSE(resume({snapshot.begin(), snapshot.begin() + static_cast<long>(size)}, 1)) << size;
  }
}

}  // namespace
}  // namespace morphbus::bridge
