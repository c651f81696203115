// Explores the lockstep's state machines exhaustively: one sim, two mated modules, with and without
// a logger, over a network that may lose, repeat, delay and reorder everything, with modules killed
// and resumed at any moment.
//
// The network is the set of all messages ever sent, any of which may arrive at any time, any number
// of times, or never: that is loss, duplication and reordering without bound. A timer may fire at
// any time. Time itself is left out of the states. Safety holds in every reachable state. For
// progress, each reachable combination of nodes is put on an empty network (everything under way is
// lost) that behaves from then on; the run must end well. Where a module may stop for good, the run
// must end without it, and the logger must know that it did not end well.

#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <string>
#include <unordered_set>
#include <utility>

#include "test/bridge/explored_world.h"

namespace morphbus::bridge {
namespace {

using States = std::unordered_set<std::string>;

/// From here on the network loses nothing: does the run end well? `known` holds nodes that do so
/// from an empty network; it grows.
bool CompletesOnAGoodNetwork(World world, States* known) {
  constexpr int kMostRounds = 400;
  constexpr int kPatientRounds = 100;  // Then the sim gives up who does not answer.
  world.fresh.clear();
  std::vector<std::string> path;
  bool ends = false;
  for (int round = 0; round < kMostRounds && !ends; ++round) {
    world.PrintNodes(&path.emplace_back());
    if (known->contains(path.back())) break;
    world.AdvanceTo(world.NextDeadline());
    if (world.anyone_dead() && round % kPatientRounds == kPatientRounds - 1) world.WaitInVain();
    while (!world.fresh.empty()) {
      const Message message = world.fresh.front();
      world.fresh.pop_front();
      world.DeliverToAll(message);
    }
    ends = world.EndedWell() || world.EndedWithoutTheDead();
    if (!world.Violation().empty()) return false;
  }
  if (!ends && !known->contains(path.back())) return false;
  known->insert(path.begin(), path.end());
  return true;
}

/// Messages whose arrival changes nothing but causes a resend, which the set holds already.
bool IsMereRequest(const Message& m) {
  return m.kind == Kind::kAskActuator || m.kind == Kind::kAskTransform || m.kind == Kind::kAskGap;
}

struct Findings {
  size_t states = 0, node_states = 0;
  std::string violation;
};

Findings Explore(const Settings& settings) {
  Findings result;
  States seen, seen_nodes, completing;
  std::deque<World> open;
  // The same memory over and over: most states are known, and are looked at by the million.
  std::string print;
  World next(settings);
  const auto visit = [&](World& world) {
    // Requests only ever bring back what is in the set.
    std::erase_if(world.sent, IsMereRequest);
    world.fresh.clear();
    world.Print(&print);
    if (!result.violation.empty() || seen.contains(print)) return;
    seen.insert(print);
    result.violation = world.Violation();
    world.PrintNodes(&print);
    if (result.violation.empty() && seen_nodes.insert(print).second && !world.EndedWell() &&
        !world.EndedWithoutTheDead() && !CompletesOnAGoodNetwork(world, &completing)) {
      result.violation = "stuck in " + print;
    }
    open.push_back(world);
  };
  next.Begin();
  visit(next);
  while (!open.empty() && result.violation.empty()) {
    const World world = std::move(open.front());
    open.pop_front();
    for (int node = -1; node < settings.modules + (settings.logger ? 1 : 0); ++node) {
      for (const Message& message : world.sent) {
        next = world;
        next.Deliver(message, node);
        visit(next);
      }
      next = world;
      next.FireTimer(node);
      visit(next);
      if (settings.deaths && node >= 0 && node < settings.modules && !world.anyone_dead()) {
        next = world;
        next.Die(node);
        visit(next);
      }
      if (!settings.kills || node < 0 || node == settings.modules) continue;
      next = world;
      next.KillAndResume(node);
      visit(next);
    }
  }
  result.states = seen.size();
  result.node_states = seen_nodes.size();
  return result;
}

void ExpectSound(const Settings& settings, size_t least_states) {
  const Findings findings = Explore(settings);
  EXPECT_EQ(findings.violation, "");
  EXPECT_GT(findings.states, least_states) << "the explorer explores less than it did";
  std::printf("%zu states, %zu of the nodes alone\n", findings.states, findings.node_states);
}

TEST(Exploration, SimAndTwoModulesNeverErrAndNeverStick) {
  Settings settings;
  settings.ticks = 5;
  ExpectSound(settings, 2000);
}

TEST(Exploration, WithALoggerNothingIsLostAndTheWindowHolds) {
  Settings settings;
  settings.modules = 1;
  settings.ticks = 3;
  settings.logger = true;
  ExpectSound(settings, 10000);
}

TEST(Exploration, TwoModulesAndALoggerNeverErrAndNeverStick) {
  Settings settings;
  settings.ticks = 1;
  settings.logger = true;
  settings.kills = false;
  ExpectSound(settings, 1000);
}

TEST(Exploration, WithoutAModuleThatStoppedTheRunEndsAndIsNeverCalledClean) {
  Settings settings;
  settings.modules = 1;
  settings.ticks = 2;
  settings.logger = true;
  settings.kills = false;
  settings.deaths = true;
  ExpectSound(settings, 1000);
}

TEST(Exploration, OneOfTwoModulesStopsAndTheOtherIsNotBlamed) {
  Settings settings;
  settings.ticks = 8;
  settings.kills = false;
  settings.deaths = true;
  ExpectSound(settings, 1000);
}

TEST(Exploration, AModuleIsLostAtItsTickWhateverHappensAndTheOtherGoesOn) {
  Settings settings;
  settings.ticks = 4;
  settings.lose_tick = 2;
  ExpectSound(settings, 1000);
}

TEST(Exploration, ALoggerHasAllOfARunThatLosesItsOnlyModule) {
  Settings settings;
  settings.modules = 1;
  settings.ticks = 4;
  settings.lose_tick = 1;
  settings.logger = true;
  settings.kills = false;
  ExpectSound(settings, 1000);
}

TEST(Exploration, FindsAPlantedError) {
  // The explorer itself: a window of no tick makes progress impossible, since the logger cannot
  // have a tick before it begins.
  Settings settings;
  settings.modules = 1;
  settings.window = 0;
  settings.logger = true;
  EXPECT_NE(Explore(settings).violation, "");
}

}  // namespace
}  // namespace morphbus::bridge
