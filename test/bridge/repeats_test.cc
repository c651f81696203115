// What a run's own processes said, said again: by the network, or by somebody who has not the key
// and listens. Each message counts once; the log holds it once, and nobody waits, stays or answers
// for it a second time.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <set>
#include <string>
#include <vector>

#include "bridge/bus/fault_plan.h"
#include "bridge/lockstep/repeat_filter.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/health.h"
#include "test/bridge/forger.h"

namespace morphbus::bridge {
namespace {

using morphbus::sim_clock_t;

TEST(NumberWindow, EachNumberIsTakenOnceInWhateverOrderTheyCome) {
  std::mt19937_64 random(3);
  NumberWindow window;
  std::set<int64_t> had;
  int64_t highest = -1;
  for (int i = 0; i < 20'000; ++i) {
    const int64_t number = std::max<int64_t>(
        0, highest + static_cast<int64_t>(random() % 100) - (i % 7 == 0 ? 40 : 97));
    // What is below the window counts as had.
    const bool known = had.contains(number) || highest - number >= 64;
    ASSERT_EQ(window.Take(number), !known) << number << " after " << highest;
    had.insert(number);
    highest = std::max(highest, number);
  }
  EXPECT_TRUE(window.Take(std::numeric_limits<int64_t>::max()));
  EXPECT_FALSE(window.Take(std::numeric_limits<int64_t>::max()));
  EXPECT_FALSE(window.Take(highest));
}

TEST(Outbox, AProcessThatIsStartedAgainBeginsWithHigherNumbers) {
  InprocHub hub;
  const auto bus = hub.Connect(), ears = hub.Connect();
  std::vector<int64_t> numbers;
  RepeatFilter filter;
  ears->SubscribePrefix("r/", [&](std::string_view channel, const uint8_t* data, size_t size) {
    morphbus::header_t header;
    ASSERT_TRUE(DecodeHeader(data, size, &header));
    EXPECT_FALSE(filter.IsRepeat(*ParseChannel(channel), data, size));
    EXPECT_TRUE(filter.IsRepeat(*ParseChannel(channel), data, size));
    numbers.push_back(header.sequence);
  });
  Ledger ledger;
  std::vector<uint8_t> saved;
  // The first process, one that resumes what it saved, one that does so and begins anew, and one
  // that finds nothing.
  for (const uint32_t incarnation : {1u, 1u, 2u, 3u}) {
    Outbox outbox(bus.get(), {"r", "m1", 1, 1}, &ledger);
    outbox.BeginAt(incarnation, 0);
    if (!saved.empty() && incarnation < 3) {
      ASSERT_TRUE(outbox.Load(saved.data(), saved.size()));
    }
    morphbus::resend_t ask{{}, "m1", "r/m2/TRANSFORM", 0, 0};
    for (int i = 0; i < 100; ++i) outbox.Send("r/m2/RESEND", i, i, &ask);
    saved.clear();
    outbox.Save(&saved);
    hub.HandleAll();
  }
  ASSERT_EQ(numbers.size(), 400u);
  EXPECT_EQ(numbers.front(), 0);
  EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end()));
}

/// A run in which everybody tells of its health each tick.
struct TalkativeRun : FakeRun {
  explicit TalkativeRun(const FakeRunOptions& o) : FakeRun(o) {
    sim->OnAfterTick([this](int64_t tick) {
      sim->PublishHealth();
      log->PublishHealth();
      for (FakeRun::Module& module : modules) module.participant->PublishHealth();
      if (tick == 5) sim->Lose(2);
    });
    sim->OnBeforeTick([this](int64_t tick) {
      if (tick == 6) sim->AnnounceControl("lose m3");
    });
  }
};

TEST(Repeats, TheLogHoldsEverythingOnceAndNothingIsSaidAnewHoweverOftenAllIsSaidAgain) {
  FakeRunOptions options;
  options.ticks = 24;
  TalkativeRun alone(options);
  size_t said_alone = 0;
  const Forger ears(&alone, [&](int64_t, const Spoken&) { ++said_alone; });
  const Outcome undisturbed = OutcomeOf(&alone);
  ASSERT_TRUE(undisturbed.sim_ok && undisturbed.log_clean) << undisturbed.error;
  for (const size_t delay : {size_t{0}, size_t{1}, size_t{30}, size_t{200}}) {
    TalkativeRun run(options);
    std::vector<Spoken> said;
    Forger* self = nullptr;
    Forger forger(&run, [&](int64_t, const Spoken& heard) {
      said.push_back(heard);
      if (said.size() <= delay) return;
      for (int i = 0; i < 5; ++i) self->Say(said[said.size() - 1 - delay]);
    });
    self = &forger;
    const Outcome outcome = OutcomeOf(&run);
    run.hub.HandleAll();
    EXPECT_TRUE(outcome.sim_ok && outcome.log_clean) << outcome.error;
    EXPECT_EQ(outcome.published, undisturbed.published);
    EXPECT_EQ(outcome.state, undisturbed.state);
    EXPECT_EQ(run.logged - run.logged_duplicates - run.logged_refused,
              static_cast<int64_t>(said.size()))
        << delay;
    EXPECT_EQ(run.logged_bad, 0);
    EXPECT_LE(said.size(), said_alone) << "nobody says more for it";
    EXPECT_GT(run.log->ledger().duplicates, static_cast<int64_t>(said.size()));
    EXPECT_EQ(outcome.refused.resent, 0);
    EXPECT_LT(outcome.seconds, undisturbed.seconds + 0.1) << "nobody stays longer";
  }
}

TEST(Repeats, AModuleThatIsLostLeavesHoweverOftenItIsToldAgain) {
  FakeRunOptions options;
  options.ticks = 200;
  options.speed = 1;
  TalkativeRun run(options);
  std::vector<Spoken> leave;
  Forger* self = nullptr;
  Forger forger(&run, [&](int64_t, const Spoken& heard) {
    if (heard.channel == "test/SIM/LEAVE") leave = {heard};
    for (const Spoken& message : leave) self->Say(message);
  });
  self = &forger;
  // It was told at the sixth tick; a second later it is gone, long before the run is over.
  ASSERT_TRUE(run.RunUntil([&] { return run.sim->tick() == 80; }));
  EXPECT_FALSE(leave.empty());
  EXPECT_TRUE(run.modules[2].participant->done());
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_EQ(run.modules[2].participant->error(), "");
}

TEST(Repeats, AModuleThatIsLostAtTheLastTickHearsThatEverybodyLeaves) {
  FakeRunOptions options;
  options.ticks = 24;
  FakeRun run(options);
  run.sim->OnAfterTick([&](int64_t tick) {
    if (tick == 22) run.sim->Lose(2);
  });
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 23) run.sim->AnnounceControl("lose m3");
  });
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_EQ(run.modules[2].participant->error(), "");
  EXPECT_LT(run.time.NowUs(), 100'000) << "it waits for no second of silence";
}

TEST(Repeats, WhatADeadModuleSaidKeepsItsPlaceForNobody) {
  FakeRun run({});
  std::vector<std::pair<size_t, int64_t>> replaced;
  run.sim->OnReplaced([&](size_t m, int64_t tick) { replaced.emplace_back(m, tick); });
  Spoken last;
  Forger forger(&run, [&](int64_t, const Spoken& heard) {
    if (heard.channel == "test/m2/ACTUATOR") last = heard;
  });
  ASSERT_TRUE(run.RunUntil([&] { return run.sim->tick() == 10; }));
  // It dies without a trace; another one takes its place, while what it said last is said on.
  ModuleParticipantOptions options = run.ModuleOptions(1);
  options.incarnation = 2;
  options.claim = 999;
  FakeRun::Module& victim = run.modules[1];
  victim.participant.reset();
  victim.seat = std::make_unique<FakeRun::Seat>(&run, 0, 77);
  victim.controller = std::make_unique<FakeController>(1);
  victim.participant = std::make_unique<ModuleParticipant>(
      &victim.seat->bus, victim.controller.get(), &run.time, options);
  victim.participant->Start();
  const int64_t begin_us = run.time.NowUs();
  while (replaced.empty() && run.time.NowUs() < begin_us + 4'000'000) {
    forger.Say(last);
    run.hub.HandleAll();
    run.time.AdvanceTo(run.time.NowUs() + 20'000);
    for (Participant* participant : run.participants()) participant->OnTime();
  }
  EXPECT_EQ(replaced.size(), 1u);
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
}

/// A run of one module whose sim is a test's, until it falls silent.
struct SilentSim {
  explicit SilentSim(bool logger) {
    options.modules = 1;
    options.logger = logger;
    FakeRun pattern(options);
    controller = std::make_unique<FakeController>(0);
    module = std::make_unique<ModuleParticipant>(module_bus.get(), controller.get(), &time,
                                                 pattern.ModuleOptions(0));
    LogParticipantOptions log_options;
    log_options.run = "test";
    log_options.model_hash = kFakeModel;
    log = std::make_unique<LogParticipant>(log_bus.get(), &time, log_options,
                                           [](const LoggedMessage&) {});
    ears->SubscribePrefix("test/",
                          [this](std::string_view channel, const uint8_t* data, size_t size) {
                            said.push_back({std::string(channel), {data, data + size}});
                          });
    log->Start();
    module->Start();
    sim_clock_t clock;
    clock.phase = sim_clock_t::PHASE_RUN;
    clock.tick_us = 20000;
    clock.num_modules = clock.num_sensors_parts = 1;
    clock.num_world_parts = clock.num_controls = 0;
    Say("SIM/CLOCK", 0, clock);
    morphbus::sensors_t sensors;
    sensors.part = 0;
    sensors.num_parts = 1;
    sensors.num_modules = 1;
    sensors.num_requests = sensors.num_pieces = sensors.num_root_poses = sensors.num_inspected = 0;
    FakeRobot robot(1);
    robot.Sense(&sensors.modules);
    Say("SIM/SENSORS", 0, sensors);
    Say("SIM/PROGRESS", 0, morphbus::progress_t{{}, 0, false});
    Say("m1/RESEND", 0, morphbus::resend_t{{}, "SIM", "test/m1/ACTUATOR", 0, 0});
    Say("LOG/RESEND", 0, morphbus::resend_t{{}, "SIM", "test/LOG/PROGRESS", 0, 0});
  }

  template <class M>
  void Say(const std::string& channel, int64_t tick, M message) {
    sim.Send("test/" + channel, tick, tick * 20000, &message);
    hub.HandleAll();
  }

  FakeRunOptions options;
  InprocHub hub;
  VirtualTime time;
  Ledger ledger;
  std::unique_ptr<Bus> bus = hub.Connect(), ears = hub.Connect(), module_bus = hub.Connect(),
                       log_bus = hub.Connect();
  Outbox sim{bus.get(), {"test", "SIM", kFakeModel, 0}, &ledger};
  std::unique_ptr<FakeController> controller;
  std::unique_ptr<ModuleParticipant> module;
  std::unique_ptr<LogParticipant> log;
  std::vector<Spoken> said;
};

TEST(Repeats, NobodyTakesADeadSimForAliveBecauseOfWhatItSaid) {
  SilentSim run(true);
  EXPECT_EQ(run.module->tick(), 1);
  const std::vector<Spoken> all = run.said;
  ASSERT_GE(all.size(), 8u);
  // All that was ever said, twice a second.
  while ((!run.module->done() || !run.log->done()) && run.time.NowUs() < 60'000'000) {
    for (const Spoken& message : all) {
      run.bus->Publish(message.channel, message.bytes.data(), message.bytes.size());
    }
    run.hub.HandleAll();
    run.time.AdvanceTo(run.time.NowUs() + 500'000);
    run.module->OnTime();
    run.log->OnTime();
  }
  EXPECT_LE(run.time.NowUs(), 12'000'000);
  EXPECT_EQ(run.module->error(), "nothing heard from the simulator of run 'test' any more");
  EXPECT_EQ(run.log->error(), "nothing heard from run 'test' any more");
}

TEST(Repeats, NoRequestIsAnsweredTwice) {
  SilentSim run(true);
  const std::vector<Spoken> all = run.said;
  run.said.clear();
  size_t said_again = 0;
  for (int i = 0; i < 50; ++i) {
    for (const Spoken& message : all) {
      run.bus->Publish(message.channel, message.bytes.data(), message.bytes.size());
      ++said_again;
    }
    run.hub.HandleAll();
    run.time.AdvanceTo(run.time.NowUs() + 10'000);
  }
  EXPECT_EQ(run.said.size(), said_again) << "these, and no answer";
}

TEST(Repeats, ASimThatHoldsStillForLongIsNotTakenForDead) {
  FakeRunOptions options;
  options.loss = 0.2;
  FakeRun run(options);
  ASSERT_TRUE(run.RunUntil([&] { return run.sim->tick() == 10; }));
  run.sim->Pause();
  const int64_t begin_us = run.time.NowUs();
  ASSERT_TRUE(run.RunUntil([&] { return run.time.NowUs() > begin_us + 120'000'000; }));
  run.sim->Resume();
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_TRUE(run.log->complete()) << run.log->error();
}

/// Runs with a module that is lost and whose last word the sim hears by chance only.
void LoseUnderFaults(bool realtime, bool pause) {
  for (int seed = 1; seed <= 10; ++seed) {
    FakeRunOptions options;
    options.ticks = 12;
    options.realtime = realtime;
    options.speed = 0.01;
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const int file = sources.AddText(
        "faults", "seed " + std::to_string(seed) + "\nfault channel=TOTALS loss=0.5\n");
    options.faults = ParseFaultPlan(sources, file, {}, &diagnostics).value();
    FakeRun run(options);
    run.sim->OnAfterTick([&](int64_t tick) {
      if (tick == 3) run.sim->Lose(2);
    });
    run.sim->OnBeforeTick([&](int64_t tick) {
      if (tick == 4) run.sim->AnnounceControl("lose m3");
    });
    if (pause) {
      // It has been told to leave; then the run holds, for longer than it waits in silence.
      bool told = false;
      const Forger ears(&run, [&](int64_t, const Spoken& heard) {
        told = told || heard.channel == "test/SIM/LEAVE";
      });
      ASSERT_TRUE(run.RunUntil([&] { return told; }));
      run.sim->Pause();
      const int64_t begin_us = run.time.NowUs();
      ASSERT_TRUE(run.RunUntil([&] { return run.time.NowUs() > begin_us + 5'000'000; }));
      run.sim->Resume();
    }
    ASSERT_TRUE(run.Run());
    EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error << ", seed " << seed;
    EXPECT_EQ(run.modules[2].participant->error(), "");
  }
}

TEST(Realtime, ALostModuleIsHeardThoughItsLastWordIsLostOnce) { LoseUnderFaults(true, false); }

TEST(Realtime, ALostModuleIsHeardInAPauseThatBeginsAsItLeaves) { LoseUnderFaults(true, true); }

TEST(Lockstep, ALostModuleIsHeardInAPauseThatBeginsAsItLeaves) { LoseUnderFaults(false, true); }

TEST(Health, TheFirstMessageWithoutTheKeyIsNamedWhateverWasRefusedBefore) {
  Ledger ledger;
  EXPECT_EQ(FirstRefused(ledger), "");
  ledger.first_refused = "m2/ACTUATOR: tick 9 in tick 70";
  EXPECT_EQ(FirstRefused(ledger), "m2/ACTUATOR: tick 9 in tick 70");
  ledger.unauthentic = 5;
  ledger.unauthentic_channels = {{"SIM/CLOCK", 3}, {"m2/STATUS", 2}};
  EXPECT_EQ(FirstRefused(ledger),
            "SIM/CLOCK: not authentic: of another run, altered or made up; "
            "m2/ACTUATOR: tick 9 in tick 70");
}

}  // namespace
}  // namespace morphbus::bridge
