#include "logger/log/docking_changes.h"

#include <gtest/gtest.h>

#include "logger/log/run_facts.h"

namespace morphbus::logger {
namespace {

struct End {
  int connector = 0;
  int mate = 0;
  int mate_connector = 0;
};

morphbus::module_sensors_t Reading(int id, const std::vector<End>& ends) {
  morphbus::module_sensors_t reading;
  reading.module_id = static_cast<int16_t>(id);
  reading.name = "m" + std::to_string(id);
  for (const End& end : ends) {
    morphbus::docked_connector_t docked;
    docked.connector = static_cast<int8_t>(end.connector);
    docked.mate_module = static_cast<int16_t>(end.mate);
    docked.mate_connector = static_cast<int8_t>(end.mate_connector);
    reading.docked.push_back(docked);
  }
  return reading;
}

/// What a log without a description is told of, `lost` being the modules that it went on without.
LogFacts Told(const DockingChanges& changes, const std::map<std::string, int64_t>& lost = {}) {
  LogFacts facts;
  facts.lost_modules = lost;
  changes.Tell(nullptr, nullptr, &facts);
  return facts;
}

TEST(DockingChanges, AreToldOnceForBothModules) {
  DockingChanges changes;
  changes.Take(Reading(1, {{0, 2, 5}}), 0);
  changes.Take(Reading(2, {{5, 1, 0}}), 0);
  EXPECT_EQ(Told(changes).num_dockings, 0);  // So it begins.
  changes.Take(Reading(1, {}), 20'000);
  changes.Take(Reading(2, {}), 20'000);
  changes.Take(Reading(1, {{3, 2, 4}}), 40'000);
  changes.Take(Reading(2, {{4, 1, 3}}), 40'000);
  const LogFacts told = Told(changes);
  const std::vector<DockingFact>& facts = told.dockings;
  ASSERT_EQ(facts.size(), 2u);
  EXPECT_EQ(facts[0].time_us, 20'000);
  EXPECT_FALSE(facts[0].docked);
  EXPECT_EQ(facts[1].time_us, 40'000);
  EXPECT_TRUE(facts[1].docked);
  EXPECT_EQ(facts[1].connector + " " + facts[1].mate, "m1.3 m2.4");
  EXPECT_EQ(DockingsText(facts, told.num_dockings),
            "2 changes of connectors:\n"
            "  0.020 s m1.0 and m2.5 parted\n"
            "  0.040 s m1.3 and m2.4 docked\n");
}

TEST(DockingChanges, WhoIsLostPartsFromNobody) {
  DockingChanges changes;
  changes.Take(Reading(1, {{0, 2, 5}, {1, 3, 0}}), 0);
  changes.Take(Reading(2, {{5, 1, 0}}), 0);
  changes.Take(Reading(3, {{0, 1, 1}}), 0);
  // Only the third one opens its connector.
  changes.Take(Reading(1, {}), 20'000);
  changes.Take(Reading(2, {}), 20'000);
  changes.Take(Reading(3, {}), 20'000);
  const LogFacts told = Told(changes, {{"m2", 20'000}});
  EXPECT_EQ(told.num_dockings, 1);
  const std::vector<DockingFact>& facts = told.dockings;
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_EQ(facts[0].connector + " " + facts[0].mate, "m1.1 m3.0");
}

TEST(DockingChanges, ReadingsThatComeLateOrAgainTellNothing) {
  DockingChanges changes;
  changes.Take(Reading(1, {{0, 2, 5}}), 40'000);
  changes.Take(Reading(1, {}), 20'000);
  changes.Take(Reading(1, {}), 40'000);
  EXPECT_EQ(Told(changes).num_dockings, 0);
  EXPECT_EQ(DockingsText({}, 0), "");
}

TEST(DockingChanges, OfAnyLengthAndWithAnyNumbersAreCounted) {
  DockingChanges changes;
  for (int i = 0; i < 3000; ++i) {
    changes.Take(Reading(-7, i % 2 == 0 ? std::vector<End>{} : std::vector<End>{{-1, 999, -1}}),
                 i * 20'000);
  }
  const LogFacts told = Told(changes);
  EXPECT_EQ(told.num_dockings, 2999);
  const std::vector<DockingFact>& facts = told.dockings;
  EXPECT_EQ(facts.size(), 1000u);
  EXPECT_EQ(facts[0].connector + " " + facts[0].mate, "m-7.-1 module 999.-1");
}

}  // namespace
}  // namespace morphbus::logger
