// Real time: who answers too late, and how that is told.

#include <gtest/gtest.h>

#include <map>
#include <morphbus/health_t.hpp>
#include <string>

#include "bridge/bus/fault_plan.h"
#include "bridge/lockstep/sim/sim_lockstep.h"
#include "bridge/wire/codec.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

/// A run in real time with these faults, and what the sim's HEALTH says of its modules in the end.
class LatenessTest : public testing::Test {
 protected:
  void Run(int modules, const std::string& faults) {
    FakeRunOptions options;
    options.modules = modules;
    options.ticks = 200;
    options.realtime = true;
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const int file = sources.AddText("faults", faults);
    options.faults = ParseFaultPlan(sources, file, {}, &diagnostics).value();
    FakeRun run(options);
    ASSERT_TRUE(run.Run());
    EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
    missed_ = run.sim->outcome().missed_deadlines;
    for (const Ledger* ledger : run.ledgers()) {
      EXPECT_EQ(ledger->outside_window + ledger->conflicts, 0) << ledger->first_refused;
    }
    const auto ear = run.hub.Connect();
    ear->Subscribe("test/SIM/HEALTH", [this](std::string_view, const uint8_t* data, size_t size) {
      morphbus::health_t health;
      ASSERT_TRUE(Decode(data, size, {}, &health));
      EXPECT_LE(size, kMaxPayloadBytes);
      ++messages_;
      for (const morphbus::lateness_t& l : health.lateness) lateness_[l.module_name] = l;
    });
    run.sim->PublishHealth();
    run.hub.HandleAll();
  }

  int64_t missed_ = 0;
  int messages_ = 0;
  std::map<std::string, morphbus::lateness_t> lateness_;
};

TEST_F(LatenessTest, WhoIsPunctualIsNotTold) {
  Run(3, "");
  EXPECT_EQ(messages_, 1);
  EXPECT_TRUE(lateness_.empty());
}

TEST_F(LatenessTest, AnswersThatNeverComeAreMissedByTheirModule) {
  Run(3, "fault channel=m2/ACTUATOR from=10 until=20 loss=1\n");
  EXPECT_EQ(missed_, 10);
  ASSERT_EQ(lateness_.size(), 1u);
  EXPECT_EQ(lateness_.at("m2").missed, 10);
  EXPECT_EQ(lateness_.at("m2").late, 0);
  EXPECT_EQ(lateness_.at("m2").worst_us, 0);
}

TEST_F(LatenessTest, AnswersThatComeLaterAreLate) {
  // Three answers a tick reach the sim, so that one which 6 and more overtake is ticks late.
  Run(3, "seed 5\nfault channel=m3/ACTUATOR from=30 until=34 reorder=1 delay=36\n");
  ASSERT_EQ(lateness_.size(), 1u);
  const morphbus::lateness_t& m3 = lateness_.at("m3");
  EXPECT_EQ(m3.missed, missed_);
  EXPECT_GE(m3.missed, 3);
  EXPECT_EQ(m3.late, m3.missed) << "all of them came in the end";
  EXPECT_GE(m3.worst_us, 20'000);
  EXPECT_LE(m3.worst_us, 16 * 20'000);
}

TEST_F(LatenessTest, AnswersThatComeWithinTheTickKeepTheirDeadline) {
  Run(3, "fault channel=m3/ACTUATOR late=1 by=0.02s\n");
  EXPECT_EQ(missed_, 0);
  EXPECT_TRUE(lateness_.empty());
}

TEST_F(LatenessTest, AnswersThatAreLateBySomeTimeAreLateByNoMore) {
  Run(3, "fault channel=m3/ACTUATOR from=30 until=130 late=1 by=0.05s\n");
  ASSERT_EQ(lateness_.size(), 1u);
  const morphbus::lateness_t& m3 = lateness_.at("m3");
  EXPECT_EQ(m3.missed, missed_);
  // Of a hundred three fifths are late by more than a tick of 20 ms, each by chance.
  EXPECT_GT(m3.missed, 40);
  EXPECT_LT(m3.missed, 80);
  EXPECT_EQ(m3.late, m3.missed);
  EXPECT_GT(m3.worst_us, 20'000);
  EXPECT_LE(m3.worst_us, 30'000);
}

TEST_F(LatenessTest, WhoIsManyTicksBehindIsLateAndNotRefused) {
  // By far more ticks than anybody keeps; what neighbours say comes as late, and to the logger,
  // too.
  Run(3,
      "fault channel=m3/ACTUATOR from=30 until=130 late=1 by=1s\n"
      "fault channel=m2/TRANSFORM from=30 until=130 late=1 by=1s\n");
  const morphbus::lateness_t& m3 = lateness_.at("m3");
  EXPECT_EQ(m3.late, m3.missed) << "all of them came in the end";
  EXPECT_GT(m3.worst_us, 2 * kKeptTicks * 20'000);
}

TEST_F(LatenessTest, ALoggerThatHasMoreWhenItIsAskedAgainHasNotContradictedItself) {
  // The logger hears of the last ticks while END is repeated for those whose answer was lost.
  for (int seed = 1; seed <= 20; ++seed) {
    Run(3, "seed " + std::to_string(seed) +
               "\nfault channel=*/TRANSFORM from=185 until=200 late=1 by=0.3s\n"
               "fault channel=TOTALS loss=0.7\n");
  }
}

TEST(Realtime, AStepOrAStopLeavesATickThatHasOnlyBegunItsTime) {
  SimLockstep::Config config;
  config.num_modules = 1;
  config.realtime = true;
  for (const bool stops : {false, true}) {
    for (const bool answers : {false, true}) {
      SCOPED_TRACE(testing::Message() << stops << answers);
      SimLockstep sim(config);
      SimLockstep::Actions actions;
      sim.Begin(0, &actions);
      sim.OnHello(0, 0, &actions);
      // In the same moment in which the tick begins.
      if (stops) {
        sim.Stop(false, 0, &actions);
      } else {
        sim.Pause();
        sim.Step(1, 0, &actions);
      }
      EXPECT_LE(sim.next_deadline_us(), 20'000);
      sim.OnTime(19'000, &actions);
      EXPECT_EQ(sim.tick(), 0) << "it may still be answered";
      if (answers) sim.OnActuator(0, 0, 19'000, &actions);
      // A run that ends waits for no more than the answers.
      EXPECT_EQ(sim.tick(), stops && answers ? 1 : 0);
      sim.OnTime(20'000, &actions);
      EXPECT_EQ(sim.tick(), 1);
      EXPECT_EQ(sim.missed_deadlines(), answers ? 0 : 1);
    }
  }
}

TEST(Realtime, AReportInTheMiddleOfATickSpeaksOfNoTickButThoseItNames) {
  // One answer comes too late for the simulator, and the logger has it all the same: if the answer
  // to the tick that is not over yet were counted, the report would seem to be of all of them.
  FakeRunOptions options;
  options.modules = 3;
  options.ticks = 120;
  options.realtime = true;
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText(
      "faults", "seed 5\nfault channel=m3/ACTUATOR from=10 until=11 reorder=1 delay=36\n");
  options.faults = ParseFaultPlan(sources, file, {}, &diagnostics).value();
  FakeRun run(options);
  // Everybody has taken the answers of a tick once this comes back to whoever says it when he hears
  // the last one.
  const auto ear = run.hub.Connect();
  int reports = 0;
  ear->Subscribe("later", [&](std::string_view, const uint8_t*, size_t) {
    ++reports;
    run.sim->PublishHealth();
  });
  ear->Subscribe("test/m3/ACTUATOR", [&](std::string_view, const uint8_t* data, size_t size) {
    ear->Publish("later", data, size);
  });
  ASSERT_TRUE(run.Run());
  EXPECT_EQ(run.sim->outcome().missed_deadlines, 1);
  EXPECT_GE(reports, 100);
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_EQ(run.log->error(), "");
}

TEST_F(LatenessTest, ManyModulesShareSeveralMessages) {
  Run(20, "fault channel=*/ACTUATOR from=10 until=11 loss=1\n");
  EXPECT_EQ(messages_, 3);
  EXPECT_EQ(lateness_.size(), 20u);
  for (const auto& [module, l] : lateness_) EXPECT_EQ(l.missed, 1) << module;
}

}  // namespace
}  // namespace morphbus::bridge
