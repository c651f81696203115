#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <morphbus/sim_clock_t.hpp>
#include <string>
#include <vector>

#include "bridge/bus/fault_plan.h"
#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/late_messages.h"
#include "bridge/wire/codec.h"
#include "test/bridge/fake_run.h"
#include "test/support/source_dir.h"

namespace morphbus::bridge {
namespace {

/// The plan of a text; empty after a failure that is reported.
FaultPlan Parse(const std::string& text, const std::vector<std::string>& modules = {}) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("x.faults", text);
  const std::optional<FaultPlan> plan = ParseFaultPlan(sources, file, modules, &diagnostics);
  EXPECT_TRUE(plan) << source::Render(diagnostics, sources, false);
  return plan.value_or(FaultPlan());
}

/// All that is wrong with a text, as people read it.
std::string ErrorsOf(const std::string& text, const std::vector<std::string>& modules = {}) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("x.faults", text);
  EXPECT_FALSE(ParseFaultPlan(sources, file, modules, &diagnostics)) << text;
  return source::Render(diagnostics, sources, false);
}

TEST(FaultPlan, ReadsTheExample) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const Result<int> file = sources.AddFile(test::SourcePath("models/rough.faults"));
  ASSERT_TRUE(file) << file.error().message;
  const auto plan = ParseFaultPlan(sources, *file, {"m3", "m5"}, &diagnostics);
  ASSERT_TRUE(plan) << source::Render(diagnostics, sources, false);
  EXPECT_EQ(plan->seed, 7u);
  ASSERT_EQ(plan->rules.size(), 3u);
  EXPECT_EQ(plan->rules[0].loss, 0.3);
  EXPECT_EQ(plan->rules[0].delay, 8);
  EXPECT_EQ(plan->rules[1].process, "m5");
  EXPECT_EQ(plan->rules[1].from_us, 1'000'000);
  EXPECT_EQ(plan->rules[1].until_us, 1'200'000);
  EXPECT_EQ(plan->rules[2].from_tick, 70);
  EXPECT_EQ(plan->rules[2].until_tick, 73);
}

TEST(FaultPlan, TimesAreInSecondsOrMilliseconds) {
  EXPECT_EQ(Parse("fault late=0.1 by=30ms").rules[0].by_us, 30'000);
  EXPECT_EQ(Parse("fault loss=0.1 from=1500ms until=2s").rules[0].from_us, 1'500'000);
}

TEST(FaultPlan, ChancesMayBePercentages) {
  EXPECT_EQ(Parse("fault loss=20% late=100% by=10ms").rules[0].loss, 0.2);
}

TEST(FaultPlan, SaysWhereAndWhy) {
  // Text, and what is said of it.
  const std::vector<std::array<std::string, 2>> cases = {
      {"fualt loss=1", "x.faults:1:1: error: expected 'seed' or 'fault'"},
      {"\n fault loss=1.5", "x.faults:2:13: error: expected a probability, 0 to 1"},
      {"fault loss=nan", "x.faults:1:12: error: expected a probability, 0 to 1"},
      {"fault los=0.5", "did you mean 'loss'?"},
      {"fault loss = 0.5", "x.faults:1:7: error: expected KEY=VALUE"},
      {"fault loss=0.5 loss=0.6", "x.faults:1:16: error: 'loss' is given twice"},
      {"fault", "x.faults:1:1: error: the rule does nothing"},
      {"fault process=m1", "x.faults:1:1: error: the rule does nothing"},
      {"fault loss=0.1 delay=3", "'delay' needs a 'reorder' above 0"},
      {"fault reorder=0.1 delay=0",
       "x.faults:1:25: error: expected a number of messages, 1 to 256"},
      {"fault late=0.1", "x.faults:1:1: error: 'late' above 0 and 'by' need each other"},
      {"fault loss=0.1 by=1s", "'late' above 0 and 'by' need each other"},
      {"fault late=0.1 by=0.03", "x.faults:1:19: error: expected seconds, 0.000001s to 10s"},
      {"fault late=0.1 by=11s", "expected seconds, 0.000001s to 10s"},
      {"fault loss=0.1 from=2.5", "x.faults:1:21: error: expected a time"},
      {"fault loss=0.1 from=2s until=1s", "the rule ends before it begins"},
      {"fault loss=0.1 from=infs", "expected a time"},
      {"seed", "x.faults:1:1: error: expected one whole number"},
      {"seed 1\nseed 2", "x.faults:2:1: error: the seed is given twice"},
      {"fault loss=0.1 process=", "expected a name or a pattern"},
      {"fault loss=0.1 process=m3", "x.faults:1:24: error: nothing in this run is called 'm3'"},
      {"fault loss=0.1 channel=m2/TRANSFROM", "did you mean 'm2/TRANSFORM'?"},
      {"fault loss=0.1 channel=\xff", "UTF-8"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string errors = ErrorsOf(text, {"m1", "m2"});
    EXPECT_NE(errors.find(expected), std::string::npos) << text << "\n" << errors;
  }
  std::string many;
  for (int i = 0; i <= kMostFaultRules; ++i) many += "fault loss=0.1\n";
  EXPECT_NE(ErrorsOf(many).find("too many rules"), std::string::npos);
}

TEST(FaultPlan, PatternsStandForNames) {
  EXPECT_TRUE(MatchesPattern("*", ""));
  EXPECT_TRUE(MatchesPattern("m?/TRANS*", "m3/TRANSFORM"));
  EXPECT_TRUE(MatchesPattern("*/*M", "m3/TRANSFORM"));
  EXPECT_TRUE(MatchesPattern("*a*b", "xaaab"));
  EXPECT_FALSE(MatchesPattern("m?", "m10"));
  EXPECT_FALSE(MatchesPattern("m1", "m10"));
  EXPECT_FALSE(MatchesPattern("", "m1"));
  // A pattern of many stars takes no time that grows without bound.
  EXPECT_FALSE(MatchesPattern("*a*a*a*a*a*a*a*a*b", std::string(60, 'a')));
}

/// A sender, and a receiver behind faults that notes what comes.
class FaultyBusTest : public testing::Test {
 protected:
  /// Sends CLOCKs of so many ticks through these rules; what is heard, by tick, -1 for damaged
  /// ones.
  std::vector<int64_t> Heard(const std::string& rules, int ticks, const std::string& process = "m1",
                             const std::string& channel = "run/SIM/CLOCK") {
    InprocHub hub;
    const auto sender = hub.Connect(), endpoint = hub.Connect();
    FaultyBus bus(endpoint.get(), Parse(rules), process);
    std::vector<int64_t> heard;
    bus.SubscribePrefix("run/", [&](std::string_view, const uint8_t* data, size_t size) {
      morphbus::sim_clock_t clock;
      heard.push_back(Decode(data, size, {}, &clock) ? clock.header.tick : -1);
    });
    for (int tick = 0; tick < ticks; ++tick) {
      const std::vector<uint8_t> bytes = Clock(tick);
      sender->Publish(channel, bytes.data(), bytes.size());
      hub.HandleAll();
    }
    injected_ = bus.losses();
    return heard;
  }

  static std::vector<uint8_t> Clock(int64_t tick) {
    morphbus::sim_clock_t clock = {};
    clock.header.protocol = morphbus::header_t::PROTOCOL;
    clock.header.tick = clock.header.sequence = tick;
    clock.header.sim_time_us = tick * 20'000;
    clock.header.model_hash = clock.header.program_hash = 0;
    clock.phase = morphbus::sim_clock_t::PHASE_RUN;
    clock.tick_us = 20'000;
    clock.num_modules = clock.num_sensors_parts = 1;
    clock.num_world_parts = clock.num_controls = 0;
    std::vector<uint8_t> bytes;
    Encode(clock, &bytes);
    return bytes;
  }

  BusLosses injected_;
};

TEST_F(FaultyBusTest, EveryFlippedBitIsFoundByTheCrc) {
  constexpr int kSent = 20000;
  const std::vector<int64_t> heard = Heard("fault corrupt=1", kSent);
  EXPECT_EQ(heard, std::vector<int64_t>(kSent, -1));
  EXPECT_EQ(injected_.corrupted, kSent);
}

TEST_F(FaultyBusTest, OvertakenMessagesComeAllTheSame) {
  const std::vector<int64_t> heard = Heard("fault reorder=0.5 delay=3", 1000);
  // Only the last few may still be held back.
  EXPECT_GT(heard.size(), 990u);
  EXPECT_FALSE(std::is_sorted(heard.begin(), heard.end()));
  for (size_t i = 0; i < heard.size(); ++i) {
    EXPECT_LE(std::abs(heard[i] - static_cast<int64_t>(i)), 3) << "more overtook it than may";
  }
  std::vector<int64_t> sorted = heard;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(std::unique(sorted.begin(), sorted.end()), sorted.end()) << "one came twice";
  EXPECT_NEAR(static_cast<double>(injected_.delayed), 500, 60);
}

TEST_F(FaultyBusTest, LateMessagesComeWhenTheirTimeIsOver) {
  InprocHub hub;
  VirtualTime time;
  const auto sender = hub.Connect(), endpoint = hub.Connect();
  FaultyBus bus(endpoint.get(), Parse("fault channel=late late=1 by=0.03s"), "m1",
                [&time] { return time.NowUs(); });
  std::vector<std::string> heard;
  bus.SubscribePrefix("run/", [&](std::string_view channel, const uint8_t*, size_t) {
    heard.emplace_back(channel);
  });
  LateMessages late({&bus});
  EXPECT_TRUE(late.done());
  for (const char* channel : {"run/late", "run/other"}) sender->Publish(channel, nullptr, 0);
  hub.HandleAll();
  EXPECT_EQ(heard, std::vector<std::string>{"run/other"});
  ASSERT_FALSE(late.done());
  const int64_t due = late.next_deadline_us();
  EXPECT_GT(due, 0);
  EXPECT_LE(due, 30'000);
  time.AdvanceTo(due - 1);
  late.OnTime();
  EXPECT_EQ(heard.size(), 1u);
  time.AdvanceTo(due);
  late.OnTime();
  EXPECT_EQ(heard, (std::vector<std::string>{"run/other", "run/late"}));
  EXPECT_TRUE(late.done());
  EXPECT_EQ(bus.losses().delayed, 1);
}

TEST_F(FaultyBusTest, DoubledMessagesComeTwice) {
  const std::vector<int64_t> heard = Heard("fault duplicate=0.25", 1000);
  EXPECT_EQ(static_cast<int64_t>(heard.size()), 1000 + injected_.doubled);
  EXPECT_NEAR(static_cast<double>(injected_.doubled), 250, 50);
  EXPECT_EQ(injected_.discarded + injected_.delayed + injected_.corrupted, 0);
}

TEST_F(FaultyBusTest, RulesHoldForTheirProcessChannelAndTimeOnly) {
  const auto lost = [this](const std::string& rule, const std::string& process = "m1") {
    Heard("fault loss=1 " + rule, 100, process);
    return injected_.discarded;
  };
  EXPECT_EQ(lost(""), 100);
  EXPECT_EQ(lost("process=m2"), 0);
  EXPECT_EQ(lost("process=m*"), 100);
  EXPECT_EQ(lost("process=m*", "SIM"), 0);
  EXPECT_EQ(lost("channel=SIM/SENSORS"), 0);
  EXPECT_EQ(lost("channel=SIM/C*"), 100);
  EXPECT_EQ(lost("from=10"), 90);
  EXPECT_EQ(lost("from=10 until=12"), 2);
  EXPECT_EQ(lost("from=0.2s until=0.3s"), 5);
  EXPECT_EQ(lost("from=0.2s until=12"), 2);
}

TEST_F(FaultyBusTest, SeedAndNameChooseWhatSuffers) {
  const auto heard = [this](const std::string& seed, const std::string& process) {
    return Heard("seed " + seed + "\nfault loss=0.3 duplicate=0.2 reorder=0.3", 200, process);
  };
  EXPECT_EQ(heard("1", "m1"), heard("1", "m1"));
  EXPECT_NE(heard("1", "m1"), heard("2", "m1"));
  EXPECT_NE(heard("1", "m1"), heard("1", "m2"));
}

TEST_F(FaultyBusTest, AHeldMessageIsForWhoListensWhenItComes) {
  InprocHub hub;
  const auto sender = hub.Connect(), endpoint = hub.Connect();
  FaultyBus bus(endpoint.get(), Parse("fault channel=a reorder=1 delay=1"), "m1");
  std::string heard;
  const auto hear = [&heard](const std::string& what) {
    return [&heard, what](std::string_view, const uint8_t*, size_t) { heard += what; };
  };
  const auto send = [&](const std::string& channel) {
    const std::vector<uint8_t> bytes = Clock(0);
    sender->Publish(channel, bytes.data(), bytes.size());
    hub.HandleAll();
  };
  bus.Subscribe("run/a", hear("1"));
  bus.Subscribe("run/b", hear("b"));
  send("run/a");
  bus.Subscribe("run/a", hear("2"));
  send("run/b");
  EXPECT_EQ(heard, "b2");
  send("run/a");
  bus.Unsubscribe("run/a");
  send("run/b");
  EXPECT_EQ(heard, "b2b") << "nobody listens any more";
}

TEST(FaultyRun, AllKindsOfFaultsChangeNoPayloadIn20Seeds) {
  FakeRunOptions options;
  options.modules = 4;
  FakeRun smooth(options);
  ASSERT_TRUE(smooth.Run());
  ASSERT_FALSE(smooth.sim->outcome().run_hash.empty());
  options.faults = Parse("fault loss=0.3 duplicate=0.2 reorder=0.3 delay=8 corrupt=0.1");
  for (options.seed = 1; options.seed <= 20; ++options.seed) {
    FakeRun rough(options);
    ASSERT_TRUE(rough.Run()) << "seed " << options.seed;
    EXPECT_TRUE(rough.sim->outcome().ok) << rough.sim->outcome().error;
    EXPECT_EQ(rough.sim->outcome().run_hash, smooth.sim->outcome().run_hash);
    EXPECT_EQ(rough.sim->outcome().recorded_hash, smooth.sim->outcome().run_hash);
    // They take over what their buses have counted.
    for (Participant* participant : rough.participants()) participant->OnTime();
    for (const Ledger* ledger : rough.ledgers()) {
      EXPECT_GT(ledger->discarded, 0);
      EXPECT_GT(ledger->doubled, 0);
      EXPECT_GT(ledger->delayed, 0);
      EXPECT_GT(ledger->corrupted, 0);
      EXPECT_EQ(ledger->bad, ledger->corrupted) << "each was found, and nothing else was bad";
    }
  }
}

TEST(FaultyRun, ASilenceOfAWholeTickIsMended) {
  FakeRunOptions options;
  FakeRun smooth(options);
  ASSERT_TRUE(smooth.Run());
  // Whatever is sent first for ticks 10 and 11 is lost; what is repeated comes half of the time.
  options.faults = Parse("fault from=10 until=12 loss=0.5 reorder=0.5 delay=64");
  FakeRun rough(options);
  ASSERT_TRUE(rough.Run());
  EXPECT_EQ(rough.sim->outcome().run_hash, smooth.sim->outcome().run_hash);
  EXPECT_GT(rough.sim->ledger().asked, 0);
}

}  // namespace
}  // namespace morphbus::bridge
