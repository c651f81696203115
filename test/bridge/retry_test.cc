// When the lockstep's machines ask again, and what they need before they go on.

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "bridge/lockstep/module_lockstep.h"
#include "bridge/lockstep/retry_timer.h"
#include "bridge/lockstep/sim_lockstep.h"

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

TEST(RetryTimer, ThePauseDoublesOnceThreeRequestsWereInVain) {
  RetryTimer timer;
  EXPECT_FALSE(timer.Fire(1'000'000, kTiming));
  timer.Arm(0, 1000);
  std::vector<int64_t> due;
  for (int i = 0; i < 12; ++i) {
    due.push_back(timer.due_us() -
                  (due.empty() ? 0 : std::accumulate(due.begin(), due.end(), int64_t{0})));
    EXPECT_FALSE(timer.Fire(timer.due_us() - 1, kTiming));
    EXPECT_TRUE(timer.Fire(timer.due_us(), kTiming));
  }
  EXPECT_EQ(due, (std::vector<int64_t>{1000, 1000, 1000, 1000, 2000, 4000, 8000, 16000, 32000,
                                       64000, 64000, 64000}));
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

TEST(SimLockstep, LearnsHowLongAnswersTakeHereAndNow) {
  constexpr int kModules = 8;
  SimLockstep::Config config;
  config.num_modules = kModules;
  SimLockstep sim(config);
  SimLockstep::Actions out;
  int64_t now_us = 1000;
  sim.Begin(now_us, &out);
  for (int m = 0; m < kModules; ++m) sim.OnHello(m, now_us, &out);
  for (int m = 0; m < kModules; ++m) sim.OnActuator(m, 0, now_us, &out);
  ASSERT_EQ(sim.tick(), 1);
  // Slower than the first guess: after a few ticks nobody is asked in vain any more.
  CountRequests(&sim, kModules, 30, 30'000, &now_us);
  EXPECT_EQ(CountRequests(&sim, kModules, 50, 30'000, &now_us), 0);
  // The machine becomes four times as slow, and then fast again.
  CountRequests(&sim, kModules, 30, 120'000, &now_us);
  EXPECT_EQ(CountRequests(&sim, kModules, 50, 120'000, &now_us), 0);
  EXPECT_EQ(CountRequests(&sim, kModules, 100, 1000, &now_us), 0);
  // By now a lost answer is asked for soon.
  sim.OnPublished(now_us);
  EXPECT_LT(sim.next_deadline_us() - now_us, 10'000);
}

/// A module that has computed tick 0, of whose SENSORS there are `parts` parts.
ModuleLockstep Started(int parts) {
  ModuleLockstep module({false, {}});
  ModuleLockstep::Actions out;
  module.Begin(0, 0, &out);
  for (int part = 0; part < parts; ++part) module.OnSensors(0, part, parts, part == 1, {}, 0, &out);
  EXPECT_EQ(module.tick(), 1);
  return module;
}

TEST(ModuleLockstep, NeedsAllPartsOnceAndThenItsOwn) {
  ModuleLockstep module({false, {}});
  ModuleLockstep::Actions out;
  module.Begin(0, 0, &out);
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

TEST(ModuleLockstep, LeavesOnlyIfTheRunGoesOnWithoutIt) {
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
  // The sim goes on without our answers: somebody else gives them.
  for (int64_t tick = 21; tick < 24; ++tick) module.OnSensors(tick, 1, 2, true, {}, 0, &out);
  EXPECT_TRUE(module.done());
  EXPECT_EQ(out.back().kind, ModuleAction::Kind::kDuplicateProcess);
}

TEST(ModuleLockstep, WaitsForMatesOnlyWhenTheirMessageIsMissing) {
  ModuleLockstep module = Started(2);
  ModuleLockstep::Actions out;
  EXPECT_FALSE(module.waits_for_mates());
  module.OnSensors(1, 1, 2, true, {7}, 1000, &out);
  EXPECT_TRUE(module.waits_for_mates());
  EXPECT_EQ(module.next_deadline_us(), 1000 + kTiming.ask_lost_after_us);
  module.OnTransform(7, 0, 1100, &out);
  EXPECT_FALSE(module.waits_for_mates());
  EXPECT_EQ(module.tick(), 2);
}

}  // namespace
}  // namespace morphbus::bridge
