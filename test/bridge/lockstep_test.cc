// Whole runs on the in-process bus: sim, modules and logger with a fake robot and fake programs.

#include <gtest/gtest.h>

#include <morphbus/sim_clock_t.hpp>

#include "bridge/wire/arithmetic_hash.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/stream_hash.h"
#include "test/bridge/fake_run.h"
#include "test/bridge/whole_run.h"

namespace morphbus::bridge {
namespace {

TEST(Lockstep, EveryTickIsComputedOnceByEveryModule) {
  FakeRunOptions options;
  options.modules = 9;
  FakeRun run(options);
  // In tick 0 the modules come to know their mates; what those said before is asked for once.
  ASSERT_TRUE(run.RunUntil([&run] { return run.sim->tick() == 2; }));
  const int64_t asked = run.sim->ledger().asked, resent = run.sim->ledger().resent;
  const int64_t duplicates = run.logged_duplicates;
  EXPECT_LE(asked, 9);
  ASSERT_TRUE(run.Run());
  ExpectWhole(&run);
  EXPECT_EQ(run.sim->ledger().asked, asked) << "where nothing is lost, nothing is asked";
  EXPECT_EQ(run.sim->ledger().resent, resent);
  EXPECT_EQ(run.logged_duplicates, duplicates);
}

TEST(Lockstep, WhereNothingIsLostNothingIsAskedForOrSentAgain) {
  // Few modules fit into one part of SENSORS; of many, neighbours are named by different parts.
  for (const int modules : {8, 60}) {
    FakeRunOptions options;
    options.modules = modules;
    FakeRun run(options);
    ASSERT_TRUE(run.Run());
    for (const Ledger* ledger : run.ledgers()) {
      EXPECT_EQ(ledger->asked, 0);
      EXPECT_EQ(ledger->resent, 0);
      EXPECT_EQ(ledger->duplicates, 0);
    }
  }
}

TEST(Lockstep, TheNameOfTheRunIsNotInItsHash) {
  FakeRunOptions a, b;
  b.run = "another-name";
  EXPECT_EQ(HashOf(a), HashOf(b));
}

TEST(Lockstep, ADifferentRunHasADifferentHash) {
  FakeRunOptions a, b;
  b.ticks = a.ticks + 1;
  EXPECT_NE(HashOf(a), HashOf(b));
}

/// That a run has the hash that it has without losses, whichever messages are lost of the share.
void ExpectSameUnderLoss(FakeRunOptions options, double loss) {
  const std::string reference = HashOf(options);
  options.loss = loss;
  for (options.seed = 1; options.seed <= 20; ++options.seed) {
    EXPECT_EQ(HashOf(options), reference) << "seed " << options.seed;
  }
}

TEST(Lockstep, LossOfAFifthAtEveryReceiverChangesNoPayload) {
  FakeRunOptions options;
  options.modules = 9;
  options.ticks = 100;
  ExpectSameUnderLoss(options, 0.2);
}

TEST(Lockstep, LossOfHalfAtEveryReceiverChangesNoPayload) { ExpectSameUnderLoss({}, 0.5); }

TEST(Lockstep, RunsWithoutALogger) {
  FakeRunOptions options;
  const std::string with = HashOf(options);
  options.logger = false;
  options.loss = 0.3;
  EXPECT_EQ(HashOf(options), with);
}

TEST(Lockstep, AConnectionThatOpensEndsTheWaitForItsMessages) {
  for (const double loss : {0.0, 0.2}) {
    FakeRunOptions options;
    options.loss = loss;
    FakeRun run(options);
    run.robot.DisconnectAt(10, 1);
    ASSERT_TRUE(run.Run());
    ExpectWhole(&run);
  }
}

TEST(Lockstep, StopEndsTheRunAfterTheTickAndTellsWhy) {
  FakeRunOptions options;
  options.ticks = -1;
  FakeRun run(options);
  run.sim->OnBeforeTick([&run](int64_t tick) {
    if (tick == 25) run.sim->RequestStop("enough");
  });
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok);
  EXPECT_EQ(run.sim->outcome().ticks, 26);
  EXPECT_EQ(run.modules[0].participant->end_reason(), "enough");
  EXPECT_EQ(run.log->end_reason(), "enough");
  EXPECT_TRUE(run.log->complete());
}

TEST(Lockstep, PauseHoldsTheRunAndNobodyAsksMeanwhile) {
  FakeRunOptions options;
  FakeRun run(options);
  run.sim->OnBeforeTick([&run](int64_t tick) {
    if (tick == 5) run.sim->Pause();
  });
  ASSERT_TRUE(run.RunUntil([&run] { return run.sim->paused(); }));
  run.hub.HandleAll();
  EXPECT_EQ(run.sim->tick(), 5);
  const int64_t asked = run.sim->ledger().asked;
  const int64_t sent = run.modules[0].participant->ledger().sent;
  for (int i = 0; i < 60; ++i) {  // A minute.
    run.time.AdvanceTo(run.time.NowUs() + 1'000'000);
    for (Participant* participant : run.participants()) participant->OnTime();
    run.hub.HandleAll();
  }
  EXPECT_EQ(run.sim->tick(), 5);
  EXPECT_EQ(run.modules[0].participant->ledger().sent, sent);
  EXPECT_EQ(run.sim->ledger().asked, asked);
  EXPECT_FALSE(run.modules[0].participant->done()) << "the beat of CLOCK keeps the modules waiting";
  run.sim->Step();
  run.hub.HandleAll();
  EXPECT_EQ(run.sim->tick(), 6);
  run.sim->Resume();
  run.hub.HandleAll();
  EXPECT_TRUE(run.sim->done());
  ExpectWhole(&run);
}

TEST(Lockstep, StepsInRealTimeLeaveModulesTheirTimeAndDoNotCatchUpThePause) {
  SimLockstep::Config config;
  config.num_modules = 1;
  config.realtime = true;
  SimLockstep sim(config);
  SimLockstep::Actions actions;
  sim.Begin(0, &actions);
  sim.OnHello(0, 0, &actions);
  // Every tick is answered while the run goes on; then it holds for a minute.
  int64_t now = 0;
  for (; sim.tick() < 5; now += 1000) {
    sim.OnActuator(0, sim.tick(), now, &actions);
    sim.OnTime(now, &actions);
  }
  sim.OnActuator(0, 5, now, &actions);
  sim.Pause();
  now += 60'000'000;
  const int64_t begin = now;
  sim.Step(3, now, &actions);
  EXPECT_EQ(sim.tick(), 6) << "the first is at once, and no other before the bus was read";
  // From here on time passes as the machine asks for it.
  std::vector<int64_t> begins;
  while (sim.tick() < 8 && now < begin + 1'000'000) {
    sim.OnActuator(0, sim.tick(), now, &actions);
    const int64_t tick = sim.tick();
    now = sim.next_deadline_us();
    sim.OnTime(now, &actions);
    if (sim.tick() > tick) begins.push_back(now - begin);
  }
  EXPECT_EQ(begins, (std::vector<int64_t>{20'000, 40'000}));
  sim.OnTime(begin + 1'000'000, &actions);
  EXPECT_EQ(sim.tick(), 8) << "it holds again";
  EXPECT_EQ(sim.missed_deadlines(), 0);
}

TEST(Lockstep, TheSimIsNeverMoreThanTheWindowAheadOfTheLogger) {
  FakeRunOptions options;
  FakeRun run(options);
  // A logger that says HELLO and then is stopped.
  morphbus::hello_t hello;
  const Sender sender{options.run, "LOG", kFakeModel, 0};
  Ledger ledger;
  Outbox outbox(&run.log_seat->sealed, sender, &ledger);
  hello.process = "LOG";
  hello.pid = 1;
  hello.claim = 1;
  hello.incarnation = 1;
  hello.wire_hash = static_cast<int64_t>(WireHash());
  hello.arithmetic_hash = static_cast<int64_t>(ArithmeticHash());
  std::vector<Participant*> others = run.participants();
  others.erase(others.begin() + 3);
  for (Participant* participant : others) participant->Start();
  outbox.Send("test/HELLO", 0, 0, &hello);
  for (int i = 0; i < 1000; ++i) {
    run.hub.HandleAll();
    run.time.AdvanceTo(run.time.NowUs() + 1000);
    for (Participant* participant : others) participant->OnTime();
  }
  EXPECT_EQ(run.sim->tick(), kKeptTicks - 1) << "ticks 0..15 are out, none is acknowledged";
  // It goes on: what it missed is still kept by everybody.
  run.log->Start();
  run.started = true;
  EXPECT_TRUE(run.Run());
  ExpectWhole(&run);
}

TEST(Lockstep, AModuleStoppedForAnHourGoesOn) {
  // SIGSTOP: m1 neither hears nor polls; time passes for all; then everything arrives at once.
  FakeRunOptions options;
  options.timing.run_silence_us = options.timing.join_silence_us = kNever / 2;
  FakeRun run(options);
  std::vector<Participant*> others = run.participants();
  others.erase(others.begin());
  for (Participant* participant : run.participants()) participant->Start();
  for (int i = 0; i < 7200; ++i) {
    // Only the others' queues are handled: FakeRun's hub has no switch, so m1's bus is asked
    // nothing.
    run.time.AdvanceTo(run.time.NowUs() + 500'000);
    run.sim_seat->endpoint->Handle(0);
    run.modules[1].seat->endpoint->Handle(0);
    run.modules[2].seat->endpoint->Handle(0);
    run.log_seat->endpoint->Handle(0);
    for (Participant* participant : others) participant->OnTime();
  }
  EXPECT_EQ(run.sim->tick(), 0);
  run.modules[0].participant->OnTime();
  EXPECT_FALSE(run.modules[0].participant->done()) << "an hour asleep is not an hour of silence";
  while (!run.sim->done()) {
    if (run.hub.HandleAll() > 0) continue;
    run.time.AdvanceTo(run.time.NowUs() + 2000);
    for (Participant* participant : run.participants()) participant->OnTime();
  }
  run.hub.HandleAll();
  ExpectWhole(&run);
}

// Refusals.

void ExpectRefused(FakeRun* run, const std::string& part_of_error) {
  ASSERT_TRUE(run->Run());
  EXPECT_FALSE(run->sim->outcome().ok);
  EXPECT_NE(run->sim->outcome().error.find(part_of_error), std::string::npos)
      << run->sim->outcome().error;
  EXPECT_EQ(run->robot.ticks, 0);
}

TEST(Lockstep, AnotherProgramIsRefusedByName) {
  FakeRun run({});
  ModuleParticipantOptions options = run.ModuleOptions(1);
  options.program_hash = 5;
  run.modules[1].participant = std::make_unique<ModuleParticipant>(
      &run.modules[1].seat->bus, run.modules[1].controller.get(), &run.time, options);
  ExpectRefused(&run, "m2 has another program (0000000000000005)");
}

/// Runs after a first HELLO of m2 which says that it computes otherwise.
void RunWithAnotherArithmetic(FakeRun* run) {
  const ModuleParticipantOptions options = run->ModuleOptions(1);
  Ledger ledger;
  Outbox outbox(&run->modules[1].seat->sealed,
                {options.run, options.module, kFakeModel, kFakeProgram}, &ledger);
  morphbus::hello_t hello;
  hello.process = options.module;
  hello.pid = 1;
  hello.claim = options.claim;
  hello.incarnation = 1;
  hello.type_name = options.type_name;
  hello.kinematics_hash = static_cast<int64_t>(options.kinematics_hash);
  hello.wire_hash = static_cast<int64_t>(WireHash());
  hello.arithmetic_hash = 5;
  run->sim->Start();
  outbox.Send("test/HELLO", 0, 0, &hello);
  for (const FakeRun::Module& module : run->modules) module.participant->Start();
  run->log->Start();
  run->started = true;
  ASSERT_TRUE(run->Run());
}

TEST(Lockstep, AnotherArithmeticIsRefusedByName) {
  FakeRun run({});
  RunWithAnotherArithmetic(&run);
  EXPECT_FALSE(run.sim->outcome().ok);
  EXPECT_EQ(run.sim->outcome().error,
            "m2 has another arithmetic (0000000000000005) than this run (" +
                HexText(ArithmeticHash()) +
                "): build it with the same options (docs/arithmetic.md), or run with --realtime");
  EXPECT_EQ(run.robot.ticks, 0);
}

TEST(Realtime, AnotherArithmeticIsNoReasonToRefuse) {
  FakeRunOptions options;
  options.realtime = true;
  FakeRun run(options);
  RunWithAnotherArithmetic(&run);
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_EQ(run.robot.ticks, options.ticks);
}

TEST(Lockstep, AnotherModelIsRefusedByName) {
  FakeRun run({});
  run.options.logger = false;
  ModuleParticipantOptions options = run.ModuleOptions(2);
  options.model_hash = 5;
  options.timing.lost_us = 1'000'000;
  run.modules[2].participant = std::make_unique<ModuleParticipant>(
      &run.modules[2].seat->bus, run.modules[2].controller.get(), &run.time, options);
  ExpectRefused(&run, "m3 has another model");
}

TEST(Lockstep, AnotherTypeAndKinematicsAreRefusedByName) {
  {
    FakeRun run({});
    ModuleParticipantOptions options = run.ModuleOptions(0);
    options.type_name = "ATRON";
    run.modules[0].participant = std::make_unique<ModuleParticipant>(
        &run.modules[0].seat->bus, run.modules[0].controller.get(), &run.time, options);
    ExpectRefused(&run, "m1 is a module of type ATRON, but the robot has a FAKE there");
  }
  FakeRun run({});
  ModuleParticipantOptions options = run.ModuleOptions(0);
  options.kinematics_hash = 3;
  run.modules[0].participant = std::make_unique<ModuleParticipant>(
      &run.modules[0].seat->bus, run.modules[0].controller.get(), &run.time, options);
  ExpectRefused(&run, "m1 has another kinematics image");
}

TEST(Lockstep, TwoClaimantsOfOneModuleAreRefusedByName) {
  FakeRun run({});
  ModuleParticipantOptions options = run.ModuleOptions(1);
  options.claim = 999;
  FakeController controller(1);
  FakeRun::Seat seat(&run, 0, 1);
  ModuleParticipant twin(&seat.bus, &controller, &run.time, options);
  std::vector<Participant*> participants = run.participants();
  // Last: the sim, which starts first, has heard m2 before.
  participants.push_back(&twin);
  ASSERT_TRUE(RunInproc(&run.hub, &run.time, participants));
  EXPECT_NE(run.sim->outcome().error.find("claims to be m2"), std::string::npos)
      << run.sim->outcome().error;
}

TEST(Lockstep, AClaimantOfARunningModuleLeavesAndTheRunGoesOn) {
  FakeRun run({});
  ModuleParticipantOptions options = run.ModuleOptions(1);
  options.claim = 999;
  FakeController controller(1);
  FakeRun::Seat seat(&run, 0, 1);
  ModuleParticipant twin(&seat.bus, &controller, &run.time, options);
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 10) twin.Start();
  });
  ASSERT_TRUE(run.Run());
  ExpectWhole(&run);
  // It takes nobody's word for it: it leaves once it has heard nothing else for long.
  EXPECT_FALSE(twin.done());
  ASSERT_TRUE(RunInproc(&run.hub, &run.time, {&twin}));
  EXPECT_NE(twin.error().find("already at tick 39"), std::string::npos) << twin.error();
  EXPECT_NE(twin.error().find("has another m2"), std::string::npos) << twin.error();
  ASSERT_EQ(run.sim->members().turned_away().size(), 1u);
}

TEST(Lockstep, AStrangerIsTurnedAwayWithoutHarm) {
  FakeRun run({});
  ModuleParticipantOptions options = run.ModuleOptions(1);
  options.module = "m77";
  options.module_id = 77;
  FakeController controller(77);
  FakeRun::Seat seat(&run, 0, 1);
  ModuleParticipant stranger(&seat.bus, &controller, &run.time, options);
  stranger.Start();
  ASSERT_TRUE(run.Run());
  ExpectWhole(&run);
  EXPECT_EQ(run.sim->members().turned_away(),
            std::vector<std::string>{"'m77' is not part of this run"});
}

// Orders from outside.

TEST(Lockstep, RequestsAndProgramsReachTheirModuleOnce) {
  for (const double loss : {0.0, 0.3}) {
    FakeRunOptions options;
    options.loss = loss;
    options.ticks = 60;
    FakeRun run(options);
    std::vector<uint8_t> image(3000);
    std::iota(image.begin(), image.end(), 0);
    run.sim->OnBeforeTick([&](int64_t tick) {
      if (tick == 3) run.sim->delivery().Deploy(1, 42, image, 4);
      if (tick != 5) return;
      for (int i = 0; i < 6; ++i) run.sim->orders().Invoke(2, vm::InvokeRequest());
    });
    ASSERT_TRUE(run.Run());
    ExpectWhole(&run);
    EXPECT_EQ(run.modules[1].controller->deployed, image);
    EXPECT_EQ(run.modules[0].controller->requests, 0);
    EXPECT_EQ(run.modules[2].controller->requests, 6) << "four fit into a tick, the rest follows";
  }
}

// Real time.

TEST(Realtime, TheClockRunsWithTheWallAndLossCostsNoTicks) {
  FakeRunOptions options;
  options.realtime = true;
  options.ticks = 200;
  options.loss = 0.2;
  FakeRun run(options);
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_EQ(run.robot.ticks, 200);
  EXPECT_GE(run.time.NowUs(), 200 * 20000);
  EXPECT_LT(run.time.NowUs(), 202 * 20000 + 2'000'000)
      << "200 ticks of 20 ms, and the leave-taking";
  EXPECT_GT(run.sim->ledger().missed_deadlines, 50);
  EXPECT_GT(run.log->ledger().lost, 100);
  EXPECT_TRUE(run.log->complete()) << "loss is counted, and no failure";
  EXPECT_EQ(run.log->error(), "");
  EXPECT_EQ(run.log->complete_ticks(), 200);
  for (const FakeRun::Module& module : run.modules) {
    EXPECT_GT(module.controller->computed.size(), 120u);
    EXPECT_TRUE(
        std::is_sorted(module.controller->computed.begin(), module.controller->computed.end()));
  }
}

TEST(Realtime, WithoutLossNoDeadlineIsMissed) {
  FakeRunOptions options;
  options.realtime = true;
  FakeRun run(options);
  ASSERT_TRUE(run.Run());
  EXPECT_EQ(run.sim->outcome().missed_deadlines, 0);
  EXPECT_EQ(run.log->run_hash(), run.sim->outcome().run_hash);
}

TEST(Lockstep, PacingAddsNoTicksAndChangesNoPayload) {
  FakeRunOptions options;
  const std::string reference = HashOf(options);
  options.speed = 2;
  FakeRun run(options);
  ASSERT_TRUE(run.Run());
  ExpectWhole(&run);
  EXPECT_EQ(run.sim->outcome().run_hash, reference);
  EXPECT_GE(run.time.NowUs(), options.ticks * 10000);
  EXPECT_LT(run.time.NowUs(), (options.ticks + 1) * 10000);
}

TEST(LogLockstep, WhatComesAfterItWasGivenUpInRealTimeIsNew) {
  LogLockstep::Config config;
  config.realtime = true;
  LogLockstep log(config);
  LogLockstep::Actions actions;
  log.Begin(0, &actions);
  const auto clock = [&](int64_t tick) {
    return log.OnClock(tick, tick, morphbus::sim_clock_t::PHASE_RUN, 1, 1, 0, 0, &actions) ==
           LogLockstep::Taken::kFresh;
  };
  for (int64_t tick = 0; tick < 200; ++tick) {
    if (tick == 10) continue;
    EXPECT_TRUE(clock(tick)) << tick;
  }
  EXPECT_EQ(log.complete_tick(), 199) << "the gap was given up";
  EXPECT_TRUE(clock(10));
  EXPECT_FALSE(clock(10));
  EXPECT_FALSE(clock(9));
}

}  // namespace
}  // namespace morphbus::bridge
