// A stranger on the bus of a run, who has not its key: every kind of message of every kind of
// channel, of ticks around the present one, altered, displaced or on other channels, and a whole
// old run beside this one. Every run is what it would have been without.

#include <gtest/gtest.h>

#include <morphbus/info_part_t.hpp>
#include <string>
#include <vector>

#include "bridge/wire/channels.h"
#include "bridge/wire/health.h"
#include "test/bridge/forger.h"

namespace morphbus::bridge {
namespace {

constexpr int64_t kTicks = 24;

FakeRunOptions Keyed() {
  FakeRunOptions options;
  options.ticks = kTicks;
  return options;
}

/// Everybody tells of its health, and the logger describes the run.
void Prepare(FakeRun* run) {
  run->sim->OnAfterTick([run](int64_t tick) {
    run->sim->PublishHealth();
    run->log->PublishHealth();
    for (FakeRun::Module& module : run->modules) module.participant->PublishHealth();
    morphbus::info_part_t info;
    info.part = 0;
    info.num_parts = 2;
    info.size = info.total_bytes = 0;
    run->log->outbox().Send("test/INFO", tick, tick * 20000, &info);
  });
}

/// What the run comes to that nobody disturbs.
const Outcome& Undisturbed() {
  static const Outcome outcome = [] {
    FakeRun run(Keyed());
    Prepare(&run);
    return OutcomeOf(&run);
  }();
  return outcome;
}

void ExpectUnharmed(const Outcome& outcome, const std::string& what) {
  EXPECT_TRUE(outcome.sim_ok && outcome.log_clean) << what << ": " << outcome.error;
  EXPECT_EQ(outcome.published, Undisturbed().published) << what;
  EXPECT_EQ(outcome.recorded, Undisturbed().published) << what;
  EXPECT_EQ(outcome.state, Undisturbed().state) << what;
  EXPECT_EQ(outcome.moves, Undisturbed().moves) << what;
  EXPECT_LT(outcome.seconds, Undisturbed().seconds + 0.1) << what;
  EXPECT_EQ(outcome.refused.bad + outcome.refused.conflicts + outcome.refused.outside_window, 0)
      << what << ": it goes no further than the key";
}

/// A run in which `speak` is called with each message that is heard.
Outcome Beside(const std::function<void(Forger*, const Spoken&)>& speak, Ledger* log_ledger) {
  FakeRun run(Keyed());
  Prepare(&run);
  Forger* self = nullptr;
  Forger forger(&run, [&](int64_t, const Spoken& heard) { speak(self, heard); });
  self = &forger;
  const Outcome outcome = OutcomeOf(&run);
  *log_ledger = run.log->ledger();
  return outcome;
}

TEST(Stranger, NoneOf144KindsOfForgeriesHarmsARun) {
  const std::vector<std::string> channels = {
      "SIM/CLOCK", "SIM/SENSORS", "SIM/WORLD", "m2/TRANSFORM", "m2/ACTUATOR", "m2/STATUS",
      "m2/HEALTH", "HELLO",       "INFO",      "LOG/PROGRESS", "TOTALS",      "SIM/LEAVE"};
  // What everybody may be made to believe is somebody else's word: content, tick and place.
  const std::vector<std::string> ways = {"altered", "displaced", "elsewhere"};
  std::mt19937_64 random(7);
  int kinds = 0;
  for (const std::string& channel : channels) {
    for (const int64_t ahead : {-1, 0, 1, 2}) {
      for (const std::string& way : ways) {
        ++kinds;
        int said = 0;
        Ledger log;
        const Outcome outcome = Beside(
            [&](Forger* forger, const Spoken& heard) {
              // What is said at the end only is made up before.
              const bool rare = channel == "TOTALS" || channel == "SIM/LEAVE";
              if (heard.channel != (rare ? "test/m2/ACTUATOR" : "test/" + channel) || said > 200)
                return;
              const Topic topic = ParseChannel("test/" + channel)->topic;
              Spoken forged = Displaced(rare ? MadeUp(topic, heard, &random) : heard, ahead);
              if (way == "altered") forged = AlteredContent(forged, &random);
              if (way == "elsewhere") {
                forged.channel = channel == "m2/ACTUATOR" ? "test/m1/ACTUATOR" : "test/m2/ACTUATOR";
              }
              // Displaced by nothing it is the message itself, once more.
              ++said;
              forger->Say(forged);
            },
            &log);
        const std::string what = channel + " " + way + " " + std::to_string(ahead);
        EXPECT_GT(said, 0) << what;
        ExpectUnharmed(outcome, what);
        // The logger hears every channel. What differs in nothing is no forgery.
        const bool same = way == "displaced" && ahead == 0;
        EXPECT_TRUE(same || log.unauthentic > 0) << what;
      }
    }
  }
  EXPECT_EQ(kinds, 144);
}

TEST(Stranger, AnOldRunOfTheSameNameBesideThisOneHarmsNothing) {
  // The same robot and program, another key; and one of which all is over.
  FakeRunOptions old = Keyed();
  old.key = RunKey(RunKey::Bytes{9});
  const std::vector<Spoken> said = Overhear(old, Prepare);
  for (const size_t lead : {size_t{0}, size_t{40}, said.size()}) {
    size_t next = 0;
    Ledger log;
    const Outcome outcome = Beside(
        [&](Forger* forger, const Spoken&) {
          // As fast as the run itself, some messages ahead, or all of it at once.
          for (size_t i = 0; (next < lead || i < 1) && next < said.size(); ++i) {
            forger->Say(said[next++]);
          }
        },
        &log);
    ExpectUnharmed(outcome, "old run");
    EXPECT_GT(log.unauthentic, 300);
    EXPECT_EQ(log.unauthentic_channels.size(), size_t{kMostUnauthenticChannels});
    EXPECT_NE(FirstRefused(log).find(": not authentic"), std::string::npos) << FirstRefused(log);
  }
}

TEST(Stranger, WhatTheRunItselfSaidIsTakenOnceHoweverOftenItIsSaidAgain) {
  // The stranger has no key, but ears: it says everything again, somewhat later.
  for (const size_t delay : {size_t{1}, size_t{30}, size_t{200}}) {
    std::vector<Spoken> said;
    FakeRun run(Keyed());
    Prepare(&run);
    Forger* self = nullptr;
    Forger forger(&run, [&](int64_t, const Spoken& heard) {
      said.push_back(heard);
      if (said.size() > delay) self->Say(said[said.size() - 1 - delay]);
    });
    self = &forger;
    const Outcome outcome = OutcomeOf(&run);
    EXPECT_TRUE(outcome.sim_ok && outcome.log_clean) << outcome.error;
    EXPECT_EQ(outcome.published, Undisturbed().published);
    EXPECT_EQ(outcome.recorded, Undisturbed().published);
    EXPECT_EQ(outcome.state, Undisturbed().state);
    EXPECT_LT(outcome.seconds, Undisturbed().seconds + 0.5);
  }
}

}  // namespace
}  // namespace morphbus::bridge
