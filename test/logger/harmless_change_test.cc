// What may differ between two logs of the same walk: order, repetitions, wall time, losses on the
// way, the mounting of modules.
#include <gtest/gtest.h>

#include <algorithm>
#include <morphbus/sim_clock_t.hpp>
#include <random>

#include "logger/compare/comparer.h"
#include "test/logger/recorded_walk.h"
#include "test/logger/temp_log.h"
#include "test/support/doctored_log.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;
using test::DoctoredLog;
using test::SyntheticEvent;

/// One change that means nothing.
struct Harmless {
  const char* name;
  void (*alter)(std::vector<SyntheticEvent>* events);
};

const Harmless kHarmless[] = {
    {"Nothing", [](std::vector<SyntheticEvent>*) {}},
    {"MessagesTwice",
     [](std::vector<SyntheticEvent>* events) {
       for (size_t i = 10; i < events->size(); i += 7) {
         events->insert(events->begin() + static_cast<long>(i), (*events)[i - 5]);
       }
     }},
    {"AnotherOrder",
     [](std::vector<SyntheticEvent>* events) {
       std::mt19937 random(7);
       for (size_t i = 20; i + 60 < events->size(); i += 50) {
         const auto begin = events->begin() + static_cast<long>(i);
         std::shuffle(begin, begin + 50, random);
       }
     }},
    {"AnotherWallTime",
     [](std::vector<SyntheticEvent>* events) {
       for (SyntheticEvent& event : *events) event.timestamp_us += 86'400'000'000;
     }},
    {"WallTimeThatStandsStill",
     [](std::vector<SyntheticEvent>* events) {
       for (SyntheticEvent& event : *events) event.timestamp_us = 1;
     }},
    {"ForeignChannelsBetween",
     [](std::vector<SyntheticEvent>* events) {
       for (size_t i = 10; i < events->size(); i += 100) {
         events->insert(events->begin() + static_cast<long>(i), {1, "LCM_SELF_TEST", {1, 2, 3}});
       }
     }},
    {"NoLedgers",
     [](std::vector<SyntheticEvent>* events) {
       std::erase_if(*events, [](const SyntheticEvent& event) {
         const auto name = bridge::ParseChannel(event.channel);
         return name && (name->topic == Topic::kHealth || name->topic == Topic::kHello);
       });
     }},
};

class HarmlessChangeTest : public ::testing::TestWithParam<Harmless> {};

TEST_P(HarmlessChangeTest, IsEquivalent) {
  DoctoredLog changed(walk->path);
  GetParam().alter(&changed.events());
  const TempFile file;
  changed.Write(file.path());
  const Comparison comparison = Compare(*walk->log, Load(file.path()));
  EXPECT_EQ(comparison.verdict, Verdict::kEquivalent) << ComparisonText(comparison, true);
}

INSTANTIATE_TEST_SUITE_P(Any, HarmlessChangeTest, ::testing::ValuesIn(kHarmless),
                         [](const auto& change) { return std::string(change.param.name); });

void ExpectEquivalentToTheWalk(const std::string& robot, double loss) {
  const std::string path = Record(robot, loss);
  const Comparison comparison = Compare(*walk->log, Load(path));
  std::remove(path.c_str());
  EXPECT_EQ(comparison.verdict, Verdict::kEquivalent) << ComparisonText(comparison, true);
}

TEST(HarmlessRunTest, WithAFifthOfAllMessagesLostIsEquivalent) {
  ExpectEquivalentToTheWalk("quadruped", 0.2);
}

TEST(HarmlessRunTest, OfACongruentRobotIsEquivalent) {
  ExpectEquivalentToTheWalk("equivalent_quadruped", 0.0);
}

TEST(LeftOutTest, ALogWithoutWorldIsEquivalentIfSimulatedPosesAreLeftOut) {
  DoctoredLog doctored(walk->path);
  doctored.DropChannels(Topic::kWorld, "");
  doctored.Change<sim_clock_t>(Topic::kClock, "", [](sim_clock_t* c) { c->num_world_parts = 0; });
  const TempFile file;
  doctored.Write(file.path());
  const RunLog log = Load(file.path());
  CompareOptions options;
  const Comparison all = Compare(*walk->log, log, options);
  EXPECT_EQ(all.verdict, Verdict::kUnusable);
  EXPECT_NE(ComparisonText(all, true).find("not compared: simulated poses: B"), std::string::npos);
  options.without = {"simulated"};
  EXPECT_EQ(Compare(*walk->log, log, options).verdict, Verdict::kEquivalent);
}

}  // namespace
}  // namespace morphbus::logger
