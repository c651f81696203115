// When the lockstep's machines ask again, and what they need before they go on.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <morphbus/sim_clock_t.hpp>
#include <numeric>
#include <utility>
#include <vector>

#include "bridge/lockstep/module/module_lockstep.h"
#include "bridge/lockstep/retry_timer.h"
#include "bridge/lockstep/sim/sim_lockstep.h"
#include "test/bridge/fake_run.h"
#include "test/bridge/lossy_bus.h"

namespace morphbus::bridge {
namespace {

constexpr LockstepTiming kTiming;

TEST(ResponseTime, PatienceFollowsTheAnswers) {
  ResponseTime response;
  EXPECT_EQ(response.patience_us(7000, kTiming), 7000) << "nothing is known yet";
  for (int i = 0; i < 200; ++i) response.Measured(1000);
  EXPECT_NEAR(static_cast<double>(response.patience_us(7000, kTiming)), 1000, 20);
  for (int i = 0; i < 200; ++i) response.Measured(20'000);
  EXPECT_NEAR(static_cast<double>(response.patience_us(7000, kTiming)), 20'000, 1000);
  // However fast or slow answers are, patience has bounds.
  for (int i = 0; i < 500; ++i) response.Measured(1);
  EXPECT_EQ(response.patience_us(7000, kTiming), kTiming.ask_at_least_us);
  for (int i = 0; i < 500; ++i) response.Measured(10'000'000);
  EXPECT_EQ(response.patience_us(7000, kTiming), kTiming.ask_slowest_us);
}

TEST(TickPace, TicksBeginAtTheirSpeedFromTheTickThatItCountsFrom) {
  TickPace pace(20'000, 2);
  pace.CountFrom(10, 1'000'000);
  EXPECT_EQ(pace.StartUs(10), 1'000'000);
  EXPECT_EQ(pace.StartUs(13), 1'030'000);
  pace.SetSpeed(0.5);
  EXPECT_EQ(pace.StartUs(13), 1'120'000);
  // The slowest pace there is still makes a time that can be waited for.
  pace.SetSpeed(1e-300);
  EXPECT_GT(pace.StartUs(11), 1'000'000'000);
  pace.SetSpeed(0);
  EXPECT_FALSE(pace.limited());
  EXPECT_LT(pace.StartUs(1000), 0) << "at any time";
}

TEST(AnswerPatience, FewAreAwaitedForLessTimeAndInVainForMore) {
  AnswerPatience patience(8, kTiming);
  for (int64_t tick = 0; tick < 20; ++tick) {
    patience.Published(1'000'000 * tick);
    patience.Answered(0, tick, 1'000'000 * tick + 4000);
    patience.Measure(tick, 8);
    patience.TickOver(tick);
  }
  EXPECT_LT(patience.Of(1, true), patience.Of(8, true));
  EXPECT_LT(patience.Of(8, false), patience.Of(8, true)) << "nothing is known of losses at first";
  // Asked for and then answered once: it had been lost, and the next wait is shorter.
  const int64_t cautious_us = patience.Of(8, true);
  const auto ask = [&](int64_t tick) {
    patience.BeginAsking(tick, 6, true);
    patience.Ask(6, tick);
    patience.Ask(7, tick);
  };
  for (int64_t tick = 20; tick < 30; ++tick) {
    ask(tick);
    patience.TickOver(tick);
  }
  ask(30);
  const int64_t bold_us = patience.Of(8, true);
  EXPECT_LT(bold_us, cautious_us);
  // Both answers came twice: they had only been late.
  for (const int module : {6, 7}) patience.AnsweredAgain(module, 30, true, 1'000'000 * 30);
  EXPECT_TRUE(patience.LearnAtFirstAnswer(31));
  EXPECT_FALSE(patience.LearnAtFirstAnswer(31)) << "there is nothing more to learn";
  EXPECT_GT(patience.Of(8, true), bold_us);
}

TEST(RetryTimer, ThePauseDoublesOnceSixteenRequestsWereInVain) {
  RetryTimer timer;
  EXPECT_FALSE(timer.Fire(1'000'000, kTiming));
  timer.Arm(0, 1000);
  std::vector<int64_t> due;
  for (int i = 0; i < 25; ++i) {
    due.push_back(timer.due_us() -
                  (due.empty() ? 0 : std::accumulate(due.begin(), due.end(), int64_t{0})));
    EXPECT_FALSE(timer.Fire(timer.due_us() - 1, kTiming));
    EXPECT_TRUE(timer.Fire(timer.due_us(), kTiming));
  }
  std::vector<int64_t> expected(17, 1000);
  for (const int64_t pause : {2000, 4000, 8000, 16000, 32000, 64000, 64000, 64000}) {
    expected.push_back(pause);
  }
  EXPECT_EQ(due, expected);
  // Something that comes makes the pauses after the next one short again.
  timer.Progress();
  const int64_t now_us = timer.due_us();
  EXPECT_TRUE(timer.Fire(now_us, kTiming));
  EXPECT_EQ(timer.due_us(), now_us + 1000);
  // A pause that was long from the beginning is not cut.
  timer.Arm(0, 200'000);
  EXPECT_TRUE(timer.Fire(200'000, kTiming));
  EXPECT_EQ(timer.due_us(), 400'000);
}

/// Requests to modules in `ticks` ticks in which every module's answer takes `answer_us`.
int64_t CountRequests(SimLockstep* sim, int modules, int ticks, int64_t answer_us,
                      int64_t* now_us) {
  int64_t requests = 0;
  SimLockstep::Actions out;
  const auto count = [&] {
    const auto asks = std::count_if(out.begin(), out.end(), [](const SimAction& action) {
      return action.kind == SimAction::Kind::kAskModule;
    });
    out.clear();
    return asks;
  };
  for (int i = 0; i < ticks; ++i) {
    const int64_t tick = sim->tick();
    sim->OnPublished(*now_us);
    const int64_t answered_us = *now_us + answer_us;
    int64_t asked = 0;
    while (sim->next_deadline_us() < answered_us) {
      *now_us = std::max(*now_us, sim->next_deadline_us());
      sim->OnTime(*now_us, &out);
      asked += count();
    }
    *now_us = answered_us;
    for (int m = 0; m < modules; ++m) sim->OnActuator(m, tick, *now_us, &out);
    requests += asked + count();
  }
  return requests;
}

/// A simulator whose modules have all joined and answered tick 0, all at this time.
SimLockstep InTickOne(int modules, int64_t now_us) {
  SimLockstep::Config config;
  config.num_modules = modules;
  SimLockstep sim(config);
  SimLockstep::Actions out;
  sim.Begin(now_us, &out);
  for (int m = 0; m < modules; ++m) sim.OnHello(m, now_us, &out);
  for (int m = 0; m < modules; ++m) sim.OnActuator(m, 0, now_us, &out);
  return sim;
}

TEST(SimLockstep, LearnsHowLongAnswersTakeHereAndNow) {
  constexpr int kModules = 8;
  int64_t now_us = 1000;
  SimLockstep sim = InTickOne(kModules, now_us);
  ASSERT_EQ(sim.tick(), 1);
  // Slower than the first guess: after a few ticks nobody is asked in vain any more.
  CountRequests(&sim, kModules, 30, 30'000, &now_us);
  EXPECT_EQ(CountRequests(&sim, kModules, 50, 30'000, &now_us), 0);
  // The machine becomes four times as slow, and then fast again.
  CountRequests(&sim, kModules, 30, 120'000, &now_us);
  EXPECT_EQ(CountRequests(&sim, kModules, 50, 120'000, &now_us), 0);
  EXPECT_EQ(CountRequests(&sim, kModules, 100, 1000, &now_us), 0);

  sim.OnPublished(now_us);
  EXPECT_LT(sim.next_deadline_us() - now_us, 40'000);
}

/// The pause before the first request of a tick.
int64_t PauseOf(SimLockstep* sim, int64_t now_us) {
  sim->OnPublished(now_us);
  return sim->next_deadline_us() - now_us;
}

TEST(SimLockstep, AsksSoonWhereMessagesAreLostAndLateWhereItAskedInVain) {
  constexpr int kModules = 8;
  int64_t now_us = 1000;
  SimLockstep sim = InTickOne(kModules, now_us);
  CountRequests(&sim, kModules, 30, 1000, &now_us);
  const int64_t cautious_us = PauseOf(&sim, now_us);
  SimLockstep::Actions out;
  // In each tick one answer is lost; when it is asked for, it comes, and never twice.
  const auto lose_one = [&](bool twice) {
    const int64_t tick = sim.tick();
    for (int m = 1; m < kModules; ++m) sim.OnActuator(m, tick, now_us += 125, &out);
    now_us = sim.next_deadline_us();
    sim.OnTime(now_us, &out);
    for (int copies = twice ? 2 : 1; copies > 0; --copies) sim.OnActuator(0, tick, now_us, &out);
    EXPECT_EQ(sim.tick(), tick + 1);
  };
  for (int i = 0; i < 30; ++i) lose_one(false);
  const int64_t hasty_us = PauseOf(&sim, now_us);
  EXPECT_LT(5 * hasty_us, cautious_us);
  // It comes twice, so that it had not been lost.
  for (int i = 0; i < 30; ++i) lose_one(true);
  EXPECT_GT(PauseOf(&sim, now_us), 5 * hasty_us);
}

TEST(SimLockstep, AsksSoonWhereMessagesAreLostThoughAllAnswersComeTwice) {
  constexpr int kModules = 8;
  // Because the bus doubles them, say, or somebody says all of them again.
  const auto pause_after = [&](bool twice) {
    int64_t now_us = 1000;
    SimLockstep sim = InTickOne(kModules, now_us);
    CountRequests(&sim, kModules, 30, 1000, &now_us);
    SimLockstep::Actions out;
    const auto answer = [&](int m, int64_t tick) {
      for (int copies = twice ? 3 : 1; copies > 0; --copies) sim.OnActuator(m, tick, now_us, &out);
    };
    for (int i = 0; i < 60; ++i) {
      const int64_t tick = sim.tick();
      for (int m = 1; m < kModules; ++m, now_us += 125) answer(m, tick);
      now_us = sim.next_deadline_us();
      sim.OnTime(now_us, &out);
      answer(0, tick);
      EXPECT_EQ(sim.tick(), tick + 1);
    }
    return PauseOf(&sim, now_us);
  };
  EXPECT_LT(pause_after(true), 2 * pause_after(false));
}

TEST(SimLockstep, ManyLossesInOneTickTeachAtOnce) {
  constexpr int kModules = 8;
  int64_t now_us = 1000;
  SimLockstep sim = InTickOne(kModules, now_us);
  CountRequests(&sim, kModules, 30, 1000, &now_us);
  const int64_t cautious_us = PauseOf(&sim, now_us);
  // Half of the answers must be asked for, and come once.
  SimLockstep::Actions out;
  for (int m = 0; m < kModules / 2; ++m) sim.OnActuator(m, sim.tick(), now_us += 125, &out);
  now_us = sim.next_deadline_us();
  sim.OnTime(now_us, &out);
  const int64_t tick = sim.tick();
  for (int m = kModules / 2; m < kModules; ++m) sim.OnActuator(m, tick, now_us, &out);
  ASSERT_EQ(sim.tick(), tick + 1);
  // With the first answer to the next tick it is known that none came twice.
  sim.OnPublished(now_us);
  sim.OnActuator(0, tick + 1, now_us, &out);
  EXPECT_LT(8 * (sim.next_deadline_us() - now_us), cautious_us);
}

/// The sim's bus, on which the answers of m1 wait until they are let through, or are thrown away.
class DelayingBus : public LossyBus {
 public:
  explicit DelayingBus(Bus* inner) : LossyBus(inner, 0, 1) {}

  void Receive(const Channels& channels, Handler handler) override {
    if (channels.name != "test/m1/ACTUATOR") {
      return LossyBus::Receive(channels, std::move(handler));
    }
    const auto keep = [this, handler = std::move(handler)](std::string_view name,
                                                           const uint8_t* data, size_t size) {
      waiting_.push_back(
          [handler, name = std::string(name), bytes = std::vector<uint8_t>(data, data + size)] {
            handler(name, bytes.data(), bytes.size());
          });
    };
    LossyBus::Receive(channels, keep);
  }

  void LetThrough() {
    for (const std::function<void()>& deliver : std::exchange(waiting_, {})) deliver();
  }
  void ThrowAway() { waiting_.clear(); }

 private:
  std::vector<std::function<void()>> waiting_;
};

TEST(SimParticipant, SoonAsksInVainNoMoreForAnswersThatAreOnlyLate) {
  FakeRunOptions options;
  options.modules = 8;
  options.logger = false;
  options.ticks = 1000;
  FakeRun run(options);
  DelayingBus bus(&run.sim_seat->sealed);
  run.sim = std::make_unique<SimParticipant>(&bus, &run.robot, run.clock, run.SimOptions());
  for (Participant* participant : run.participants()) participant->Start();
  // Requests in a tick in which m1's answer comes late, and again for each of them.
  const auto requests_when_late = [&] {
    constexpr int64_t kLateUs = 1000;
    const int64_t asked = run.sim->ledger().asked;
    const int64_t answer_us = run.time.NowUs() + kLateUs;
    run.hub.HandleAll();
    while (run.time.NowUs() < answer_us) {
      run.time.AdvanceTo(std::min(answer_us, run.sim->next_deadline_us()));
      run.sim->OnTime();
      run.hub.HandleAll();
    }
    bus.LetThrough();
    return run.sim->ledger().asked - asked;
  };
  // In a tick in which it is lost, the one that is asked for is the only one.
  const auto lose_one = [&] {
    run.hub.HandleAll();
    bus.ThrowAway();
    run.time.AdvanceTo(run.sim->next_deadline_us());
    run.sim->OnTime();
    run.hub.HandleAll();
    bus.LetThrough();
  };
  for (int i = 0; i < 30; ++i) lose_one();
  ASSERT_EQ(run.sim->tick(), 30);
  EXPECT_GT(requests_when_late(), 0) << "losses taught it to ask soon";
  for (int i = 0; i < 20; ++i) requests_when_late();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(requests_when_late(), 0);
  EXPECT_EQ(run.sim->tick(), 71) << "every tick was answered once";
}

TEST(SimLockstep, SaysNothingBeforeAllHaveJoinedButOnceASecond) {
  SimLockstep::Config config;
  config.num_modules = 2;
  SimLockstep sim(config);
  SimLockstep::Actions out;
  sim.Begin(0, &out);
  sim.OnHello(0, 1000, &out);
  EXPECT_TRUE(out.empty());
  // Who came too late for the first CLOCK hears the next one.
  sim.OnTime(kTiming.heartbeat_us, &out);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(out[0].kind, SimAction::Kind::kPublishClock);
  EXPECT_EQ(out[1].kind, SimAction::Kind::kSayProgress) << "to ask for HELLO";
  sim.OnTime(2 * kTiming.heartbeat_us, &out);
  ASSERT_EQ(out.size(), 4U);
  EXPECT_EQ(out[2].kind, SimAction::Kind::kRepeatClock);
  EXPECT_EQ(out[3].kind, SimAction::Kind::kSayProgress);
  sim.OnHello(1, 2 * kTiming.heartbeat_us, &out);
  ASSERT_EQ(out.size(), 6U);
  EXPECT_EQ(out[5].kind, SimAction::Kind::kPublishReadings);
}

/// A module that has computed tick 0, of whose SENSORS there are `parts` parts.
ModuleLockstep Started(int parts) {
  ModuleLockstep module({false, {}});
  ModuleLockstep::Actions out;
  module.Begin(0, 0, &out);
  module.OnClock(0, morphbus::sim_clock_t::PHASE_START, 0, &out);
  for (int part = 0; part < parts; ++part) module.OnSensors(0, part, parts, part == 1, {}, 0, &out);
  EXPECT_EQ(module.tick(), 1);
  return module;
}

TEST(ModuleLockstep, NeedsAllPartsOnceAndThenItsOwn) {
  ModuleLockstep module({false, {}});
  ModuleLockstep::Actions out;
  module.Begin(0, 0, &out);
  module.OnClock(0, morphbus::sim_clock_t::PHASE_START, 0, &out);
  module.OnSensors(0, 1, 3, true, {}, 0, &out);
  EXPECT_EQ(module.tick(), 0) << "the other parts name modules";
  EXPECT_FALSE(module.knows_all());
  module.OnSensors(0, 0, 3, false, {}, 0, &out);
  module.OnSensors(0, 2, 3, false, {}, 0, &out);
  EXPECT_EQ(module.tick(), 1);
  EXPECT_TRUE(module.knows_all());
  module.OnSensors(1, 0, 3, false, {}, 0, &out);
  EXPECT_EQ(module.tick(), 1) << "another's part is not enough";
  module.OnSensors(1, 1, 3, true, {}, 0, &out);
  EXPECT_EQ(module.tick(), 2);
}

TEST(ModuleLockstep, LeavesOnlyIfNothingButLaterTicksIsHeard) {
  ModuleLockstep module = Started(2);
  ModuleLockstep::Actions out;
  // Two messages of the future, and then the run's own next tick: those two were made up.
  for (int64_t tick = 1; tick < 20; ++tick) {
    module.OnSensors(tick + 5, 1, 2, true, {}, 0, &out);
    module.OnClock(tick + 7, 1, 0, &out);
    module.OnSensors(tick, 1, 2, true, {}, 0, &out);
    ASSERT_EQ(module.tick(), tick + 1);
  }
  EXPECT_FALSE(module.done());
  // Nine of the future while the run's own next tick takes its time: nobody leaves for them.
  constexpr int64_t kStepUs = 100'000;
  int64_t now_us = 0;
  for (int64_t tick = 100; tick < 109; ++tick) {
    now_us += kStepUs;
    module.OnSensors(tick, 1, 2, true, {}, now_us, &out);
    module.OnTime(now_us, &out);
  }
  EXPECT_FALSE(module.done());
  module.OnSensors(20, 1, 2, true, {}, now_us, &out);
  EXPECT_EQ(module.tick(), 21);
  // The sim goes on without our answers: somebody else gives them, and we hear nothing of our tick.
  const int64_t heard_us = now_us;
  for (int64_t tick = 110; !module.done(); ++tick) {
    ASSERT_LE(now_us - heard_us, kTiming.lost_us);
    now_us += kStepUs;
    module.OnSensors(tick, 1, 2, true, {}, now_us, &out);
    module.OnTime(now_us, &out);
  }
  EXPECT_EQ(out.back().kind, ModuleAction::Kind::kDuplicateProcess);
  EXPECT_EQ(out.back().tick, 110 + kTiming.lost_us / kStepUs - 1);
  EXPECT_EQ(now_us - heard_us, kTiming.lost_us);
}

TEST(ModuleLockstep, ASilentSimIsNoOtherProcess) {
  ModuleLockstep module = Started(2);
  ModuleLockstep::Actions out;
  // What was made up before the sim was last heard is not what the silence means.
  module.OnSensors(50, 1, 2, true, {}, 0, &out);
  module.OnProgress(module.tick(), 0, &out);
  for (int64_t now_us = 0; !module.done(); now_us += 100'000) module.OnTime(now_us, &out);
  EXPECT_EQ(out.back().kind, ModuleAction::Kind::kLostSim);
}

TEST(ModuleLockstep, OnlyWhatIsNewAndOfItsTimeIsASignOfLife) {
  constexpr int64_t kStepUs = 400'000;
  // Until when the module stays to which this is said again and again.
  const auto end_us = [](bool ended, const auto& say) {
    ModuleLockstep module = Started(2);
    ModuleLockstep::Actions out;
    if (ended) module.OnClock(1, morphbus::sim_clock_t::PHASE_END, 0, &out);
    int64_t now_us = 0;
    for (; !module.done() && now_us < 60'000'000; now_us += kStepUs) {
      say(&module, now_us, &out);
      module.OnTime(now_us, &out);
    }
    return now_us - kStepUs;
  };
  using Module = ModuleLockstep;
  using Out = ModuleLockstep::Actions;
  const auto clock = [](Module* m, int64_t us, Out* out) {
    m->OnClock(0, morphbus::sim_clock_t::PHASE_START, us, out);
  };
  const auto end = [](Module* m, int64_t us, Out* out) {
    m->OnClock(1, morphbus::sim_clock_t::PHASE_END, us, out);
  };
  const auto asked = [](Module* m, int64_t us, Out*) { m->OnAsked(1, us); };
  const auto asked_later = [](Module* m, int64_t us, Out*) { m->OnAsked(20, us); };
  const auto lives = [](Module* m, int64_t us, Out* out) { m->OnProgress(1, us, out); };
  const auto is_elsewhere = [](Module* m, int64_t us, Out* out) { m->OnProgress(20, us, out); };
  EXPECT_EQ(end_us(false, clock), kTiming.lost_us);
  EXPECT_EQ(end_us(false, asked_later), kTiming.lost_us);
  EXPECT_EQ(end_us(false, is_elsewhere), kTiming.lost_us);
  EXPECT_GT(end_us(false, asked), 50'000'000);
  EXPECT_GT(end_us(false, lives), 50'000'000);
  // After END who asks shows nothing any more, and END is said once.
  EXPECT_LE(end_us(true, end), kTiming.linger_us + kStepUs);
  EXPECT_LE(end_us(true, asked), kTiming.linger_us + kStepUs);
  EXPECT_GT(end_us(true, lives), 50'000'000);
}

TEST(ModuleLockstep, SensorsBeginTheRunWhereTheFirstClockIsLost) {
  ModuleLockstep::Actions out;
  ModuleLockstep module({false, {}});
  module.Begin(0, 0, &out);
  EXPECT_EQ(module.OnSensors(0, 0, 1, true, {}, 0, &out), ModuleLockstep::Taken::kFresh);
  EXPECT_EQ(module.tick(), 1);
}

TEST(ModuleLockstep, WaitsForMatesOnlyWhenTheirMessageIsMissing) {
  ModuleLockstep module = Started(2);
  ModuleLockstep::Actions out;
  EXPECT_FALSE(module.waits_for_mates());
  module.OnSensors(1, 1, 2, true, {7}, 1000, &out);
  EXPECT_TRUE(module.waits_for_mates());
  EXPECT_EQ(module.next_deadline_us(), 1000 + kTiming.ask_lost_after_us);
  module.OnTransform(7, 0, 0, 1100, &out);
  EXPECT_FALSE(module.waits_for_mates());
  EXPECT_EQ(module.tick(), 2);
}

}  // namespace
}  // namespace morphbus::bridge
