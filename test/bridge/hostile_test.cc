// Somebody on the bus of a run who wants no good: each attack that once stalled, ended, multiplied
// or falsified a run, with counts. All in virtual time; test/e2e/hostile.py has them over LCM.

#include <gtest/gtest.h>

#include <algorithm>
#include <morphbus/ask_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/lockstep/run_totals.h"
#include "bridge/wire/channels.h"
#include "test/bridge/forger.h"

namespace morphbus::bridge {
namespace {

using morphbus::ask_t;

/// What a run comes to that nobody disturbs.
Outcome Undisturbed(const FakeRunOptions& options) {
  FakeRun run(options);
  return OutcomeOf(&run);
}

void ExpectUnharmed(const Outcome& outcome, const Outcome& reference) {
  EXPECT_TRUE(outcome.sim_ok) << outcome.error;
  EXPECT_TRUE(outcome.log_clean) << outcome.error;
  EXPECT_EQ(outcome.published, reference.published);
  EXPECT_EQ(outcome.recorded, reference.published);
  EXPECT_EQ(outcome.state, reference.state);
  EXPECT_EQ(outcome.moves, reference.moves);
  EXPECT_LT(outcome.seconds, reference.seconds + 0.1);
}

/// A run in which `attack` is called with each message that is heard.
Outcome Attacked(const FakeRunOptions& options,
                 const std::function<void(FakeRun*, Forger*, const Spoken&)>& attack) {
  FakeRun run(options);
  Forger* self = nullptr;
  Forger forger(&run, [&](int64_t, const Spoken& message) { attack(&run, self, message); });
  self = &forger;
  return OutcomeOf(&run);
}

/// The first message of a channel that an undisturbed run has.
Spoken FirstOn(const FakeRunOptions& options, const std::string& channel) {
  for (const Spoken& message : Overhear(options)) {
    if (message.channel == channel) return message;
  }
  ADD_FAILURE() << "nothing on " << channel;
  return {};
}

/// A message of this kind to `to`, in `sender`'s name.
Spoken AskOf(int8_t kind, const std::string& sender, const std::string& to, int64_t tick) {
  static const Spoken pattern = FirstOn(Open(), "test/SIM/ASK");
  Spoken forged = Altered<ask_t>(pattern, [&](ask_t* ask) {
    ask->kind = kind;
    ask->sender = sender;
    ask->header.tick = tick;
  });
  forged.channel = "test/" + to + "/ASK";
  return forged;
}

TEST(Hostile, ACommandFromTheFutureIsNeitherObeyedNorLogged) {
  const FakeRunOptions options = Open();
  const Outcome reference = Undisturbed(options);
  for (const int64_t ahead : {2, 17, 20, 50, 100}) {
    int said = 0;
    const Outcome outcome = Attacked(options, [&](FakeRun*, Forger* forger, const Spoken& heard) {
      if (heard.channel != "test/m2/ACTUATOR" || said > 0) return;
      ++said;
      forger->Say(Altered<morphbus::actuator_t>(heard, [&](morphbus::actuator_t* command) {
        command->header.tick += ahead;
        command->header.sequence += ahead;
        command->joints[0].target_si += 0.25;
      }));
    });
    EXPECT_EQ(said, 1);
    ExpectUnharmed(outcome, reference);
    // The sim knows at which tick it is; the logger may be a window behind.
    EXPECT_EQ(outcome.refused.outside_window, ahead > kKeptTicks ? 2 : 1);
  }
}

TEST(Hostile, WhoSpeaksBeforeTheModuleIsNamedWithTheProcessThatBelievedIt) {
  const FakeRunOptions options = Open();
  const std::vector<Spoken> said = Overhear(options);
  FakeRun run(options);
  Forger forger(&run, [](int64_t, const Spoken&) {});
  // As soon as a tick is out, and before its module has answered.
  run.sim->OnAfterTick([&](int64_t tick) {
    for (const Spoken& message : said) {
      morphbus::actuator_t command;
      if (tick != 9 || message.channel != "test/m2/ACTUATOR" ||
          !Decode(message.bytes.data(), message.bytes.size(), {}, &command) ||
          command.header.tick != tick) {
        continue;
      }
      command.joints[0].target_si += 0.25;
      Spoken forged = message;
      Encode(command, &forged.bytes);
      forger.Say(forged);
    }
  });
  const Outcome outcome = OutcomeOf(&run);
  EXPECT_FALSE(outcome.sim_ok);
  EXPECT_FALSE(outcome.log_clean);
  EXPECT_NE(
      outcome.error.find("LOG recorded other messages on m2/ACTUATOR than m2 published (40 of "
                         "40), and 1 more such differences"),
      std::string::npos)
      << outcome.error;
  EXPECT_EQ(outcome.refused.conflicts, 2) << "m2's own command, at sim and logger";
}

TEST(Hostile, AnEndThatIsNoneEndsNothing) {
  const FakeRunOptions options = Open();
  const Outcome reference = Undisturbed(options);
  for (const int64_t ahead : {-5, 0, 1, 2, 5, 16, 20, 1000}) {
    int said = 0;
    const Outcome outcome = Attacked(options, [&](FakeRun*, Forger* forger, const Spoken& heard) {
      morphbus::sim_clock_t clock;
      if (heard.channel != "test/SIM/CLOCK" || said > 0) return;
      if (!Decode(heard.bytes.data(), heard.bytes.size(), {}, &clock) || clock.header.tick != 9) {
        return;
      }
      ++said;
      forger->Say(Altered<morphbus::sim_clock_t>(heard, [&](morphbus::sim_clock_t* end) {
        end->phase = morphbus::sim_clock_t::PHASE_END;
        end->end_reason = "forged";
        end->header.tick += ahead;
        end->header.sequence += ahead;
      }));
      // And nobody is let go by whoever says so.
      for (const char* process : {"m1", "m2", "m3", "LOG"}) {
        forger->Say(AskOf(ask_t::KIND_BYE, "SIM", process, 3));
        forger->Say(AskOf(ask_t::KIND_BYE, "m1", process, 9 + ahead));
      }
    });
    EXPECT_EQ(said, 1);
    ExpectUnharmed(outcome, reference);
    EXPECT_GT(outcome.refused.false_ends, 0) << ahead;
  }
}

TEST(Hostile, ASecondSimThatIsStoppedLeavesTheRunAlone) {
  const FakeRunOptions options = Open();
  const Outcome reference = Undisturbed(options);
  // While both are at their first tick, nobody can tell which one the run's is.
  for (const int64_t at : {2, 20}) {
    FakeRun run(options);
    FakeRobot robot(options.modules);
    FakeRun::Seat seat(&run, 0, 1);
    SimParticipant second(&seat.bus, &robot, &run.time, run.SimOptions());
    run.sim->OnBeforeTick([&](int64_t tick) {
      if (tick != at) return;
      second.Start();
      second.RequestStop("interrupted");
    });
    const Outcome outcome = OutcomeOf(&run);
    EXPECT_TRUE(outcome.sim_ok) << outcome.error;
    EXPECT_TRUE(outcome.log_clean) << outcome.error;
    EXPECT_EQ(outcome.published, reference.published);
    EXPECT_EQ(outcome.state, reference.state);
    EXPECT_GT(outcome.refused.false_ends + outcome.refused.conflicts, 0);
  }
}

TEST(Hostile, APollFromTheFutureBringsNoResends) {
  const FakeRunOptions options = Open();
  const Outcome reference = Undisturbed(options);
  int said = 0;
  const Outcome outcome = Attacked(options, [&](FakeRun*, Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/m2/ACTUATOR" || said > 0) return;
    ++said;
    forger->Say(AskOf(ask_t::KIND_POLL, "SIM", "LOG", int64_t{1} << 62));
  });
  ExpectUnharmed(outcome, reference);
  EXPECT_EQ(outcome.refused.resent, reference.refused.resent);
  EXPECT_EQ(outcome.refused.outside_window, 1);
}

TEST(Hostile, AMessageIsSentAgainOnceHoweverOftenItIsAskedFor) {
  InprocHub hub;
  const auto bus = hub.Connect(), ears = hub.Connect();
  int heard = 0;
  ears->SubscribePrefix("r/", [&heard](std::string_view, const uint8_t*, size_t) { ++heard; });
  Ledger ledger;
  Outbox outbox(bus.get(), {"r", "m1", 1, 1}, &ledger);
  morphbus::world_t world;
  world.part = 0;
  world.num_parts = 1;
  world.num_bodies = world.num_contacts = 0;
  for (int64_t tick = 0; tick < 40; ++tick) outbox.Send("r/SIM/WORLD", tick, tick, &world);
  hub.HandleAll();
  heard = 0;
  for (int64_t now_us = 1'000'000; now_us < 1'010'000; now_us += 10) {
    outbox.Answer("r/SIM/WORLD", 0, int64_t{1} << 62, now_us);
    hub.HandleAll();
  }
  EXPECT_EQ(heard, 16 * 5) << "sixteen are kept, and ten milliseconds have passed";
  EXPECT_EQ(ledger.resent, heard);
  EXPECT_EQ(ledger.hasty_requests, 16 * 1000 - heard);
}

TEST(Hostile, InAQuickRunAnswersComeSoonAndNotWithoutEnd) {
  InprocHub hub;
  const auto bus = hub.Connect();
  Ledger ledger;
  Outbox outbox(bus.get(), {"r", "m1", 1, 1}, &ledger);
  morphbus::world_t world;
  world.part = 0;
  world.num_parts = 1;
  world.num_bodies = world.num_contacts = 0;
  // Ticks of two milliseconds: an answer that was lost is given again after an eighth of one.
  int64_t now_us = 1'000'000;
  for (int64_t tick = 0; tick < 40; ++tick) {
    now_us += 2000;
    outbox.TickBegun(now_us);
    outbox.Send("r/SIM/WORLD", tick, tick, &world);
  }
  EXPECT_EQ(outbox.Answer("r/SIM/WORLD", 39, 39, now_us), 1);
  EXPECT_EQ(outbox.Answer("r/SIM/WORLD", 39, 39, now_us + 50), 0);
  EXPECT_EQ(outbox.Answer("r/SIM/WORLD", 39, 39, now_us + 250), 1);
  // Whoever asks on and on gets as many as a tick may hold, and then one in two milliseconds.
  int64_t sent = 0;
  for (int64_t us = now_us + 1000; us < now_us + 101'000; us += 10) {
    sent += outbox.Answer("r/SIM/WORLD", 38, 38, us);
  }
  EXPECT_LE(sent, 17 + 50);
  EXPECT_GE(sent, 17 + 45);
  EXPECT_EQ(ledger.resent, sent + 2);
}

TEST(Hostile, InventedChannelsCostACountAndNothingElse) {
  const FakeRunOptions options = Open();
  const Outcome reference = Undisturbed(options);
  Spoken health = FirstOn(options, "test/SIM/ASK");
  bool said = false;
  const Outcome outcome = Attacked(options, [&](FakeRun* run, Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/m2/ACTUATOR" || said) return;
    said = true;
    const int64_t before = run->logged - run->logged_refused;
    for (int i = 0; i < 40'000; ++i) {
      health.channel = "test/x" + std::to_string(i) + "/HEALTH";
      forger->Say(health);
      if (i % 1000 == 999) run->hub.HandleRound();
    }
    EXPECT_LT(run->logged - run->logged_refused, before + 1000) << "only the run's own";
  });
  ExpectUnharmed(outcome, reference);
  EXPECT_EQ(outcome.refused.foreign, 40'000);
}

TEST(Hostile, ARunWhoseLogHasAForgeryEndsWhileItGoesOn) {
  FakeRunOptions options = Open();
  options.ticks = 1000;
  // Where the module's own ACTUATOR is lost, an altered copy comes first.
  options.loss = 0.3;
  FakeRun run(options);
  Forger* self = nullptr;
  int64_t commands = 0;
  Forger forger(&run, [&](int64_t, const Spoken& heard) {
    if (heard.channel != "test/m2/ACTUATOR") return;
    if (++commands > 20 && commands <= 60) {
      self->Say(Altered<morphbus::actuator_t>(
          heard, [](morphbus::actuator_t* command) { command->joints[0].target_si += 0.25; }));
    }
    // A report now and then, as once a second of wall time.
    if (commands % 10 == 0) run.modules[1].participant->PublishHealth();
  });
  self = &forger;
  const Outcome outcome = OutcomeOf(&run);
  EXPECT_FALSE(outcome.sim_ok);
  EXPECT_FALSE(outcome.log_clean);
  EXPECT_EQ(run.log->error(),
            "LOG recorded other messages on m2/ACTUATOR than m2 published: "
            "somebody else speaks on this bus");
  // Some reports later it is over, but for the ticks that the sim may be ahead of the log.
  EXPECT_LT(run.robot.ticks, 300);
}

TEST(Hostile, OneForgedReportOfWhatWasPublishedEndsNothing) {
  const FakeRunOptions options = Open();
  int64_t reports = 0;
  const auto attack = [&](FakeRun* run, Forger* forger, const Spoken& heard) {
    if (heard.channel == "test/m2/ACTUATOR") run->modules[1].participant->PublishHealth();
    if (heard.channel != "test/m2/HEALTH" || ++reports % 2 == 0) return;
    forger->Say(Altered<morphbus::health_t>(heard, [](morphbus::health_t* health) {
      for (morphbus::topic_total_t& total : health->totals) ++total.chained_hash;
    }));
  };
  ExpectUnharmed(Attacked(options, attack), Undisturbed(options));
  EXPECT_GT(reports, 20);
}

TEST(Hostile, AReportWithABadBodyIsRefused) {
  FakeRunOptions options = Open();
  const Outcome reference = Undisturbed(options);
  const Spoken pattern = FirstOn(options, "test/SIM/ASK");
  // An ASK on a channel of HEALTH: its header is sound, and its body is not one of HEALTH.
  bool said = false;
  FakeRun run(options);
  Forger* self = nullptr;
  Forger forger(&run, [&](int64_t, const Spoken& heard) {
    if (heard.channel != "test/m2/ACTUATOR" || said) return;
    said = true;
    self->Say({"test/m2/HEALTH", pattern.bytes});
  });
  self = &forger;
  const Outcome outcome = OutcomeOf(&run);
  ExpectUnharmed(outcome, reference);
  EXPECT_EQ(run.logged_bad, 1);
}

TEST(Hostile, AVerdictThatIsNotTheSimsIsNotBelieved) {
  FakeRunOptions options = Open();
  int said = 0;
  const Outcome outcome = Attacked(options, [&](FakeRun*, Forger* forger, const Spoken& heard) {
    if (!heard.channel.ends_with("/ACTUATOR")) return;
    ++said;
    forger->Say(AskOf(ask_t::KIND_VERDICT, "SIM", "LOG", 9));
  });
  ExpectUnharmed(outcome, Undisturbed(options));
  EXPECT_EQ(outcome.refused.false_ends, said);
}

TEST(Hostile, SensorsFromAheadMakeNobodyLeaveUnlessTheRunGoesOnWithoutThem) {
  const FakeRunOptions options = Open();
  const Outcome outcome = Attacked(options, [&](FakeRun*, Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/SIM/SENSORS") return;
    for (int i = 0; i < 5; ++i) {
      forger->Say(Altered<morphbus::sensors_t>(heard, [](morphbus::sensors_t* sensors) {
        sensors->header.tick += 30;
        sensors->header.sequence += 30 * sensors->num_parts;
      }));
    }
  });
  ExpectUnharmed(outcome, Undisturbed(options));
  EXPECT_GT(outcome.refused.outside_window, 5 * 30);
}

// The comparison of totals itself.

TEST(RunTotals, SaysNothingWhereAllAgreeAndNamesWhoDoesNot) {
  RunTotals totals;
  for (const char* process : {"SIM", "LOG", "m1", "m2"}) totals.Reported(process);
  totals.Given("r/m1/TRANSFORM", -1, "m2", {3, 30});
  totals.Taken("r/m1/TRANSFORM", -1, "m2", {3, 30});
  totals.Given("r/SIM/SENSORS", 1, "m2", {4, 40});
  totals.Taken("r/SIM/SENSORS", 1, "m2", {4, 40});
  EXPECT_EQ(totals.Disagreement(), "");
  totals.Taken("r/m1/TRANSFORM", -1, "m2", {3, 31});
  EXPECT_EQ(totals.Disagreement(),
            "m2 took other messages on m1/TRANSFORM than m1 published (3 of 3)");
  totals.Taken("r/m2/STATUS", -1, "LOG", {2, 1});
  EXPECT_EQ(totals.Disagreement(),
            "m2 took other messages on m1/TRANSFORM than m1 published (3 of 3), and 1 more such "
            "differences");
}

TEST(RunTotals, ComparesNothingOfAProcessThatToldNothing) {
  RunTotals totals;
  totals.Reported("SIM");
  totals.Given("r/SIM/SENSORS", 0, "m1", {4, 40});
  EXPECT_EQ(totals.Disagreement(), "") << "m1 has died";
  totals.Reported("m1");
  EXPECT_EQ(totals.Disagreement(),
            "m1 took other messages on SIM/SENSORS than SIM published (0 of 4)");
}

TEST(RunTotals, AReportOfManyChannelsComesInPartsThatFitTheirDatagrams) {
  ask_t pattern;
  pattern.sender = std::string(28, 'm');
  pattern.kind = ask_t::KIND_END_ACK;
  pattern.first_sequence = pattern.last_sequence = 0;
  pattern.acknowledged_tick = 7;
  pattern.run_hash = std::string(32, 'f');
  pattern.part = pattern.num_parts = 0;
  pattern.num_totals = pattern.num_taken = 0;
  TotalsReport report;
  for (int i = 0; i < 300; ++i) {
    report.totals.push_back({std::string(40, 'c') + std::to_string(i), i, i * 7, 1});
    morphbus::taken_total_t taken;
    taken.channel = std::string(60, 'c');
    taken.taker = std::to_string(i);
    taken.part = -1;
    taken.count = taken.sum = i;
    report.taken.push_back(taken);
  }
  std::vector<ask_t> parts = SplitReport(pattern, report);
  ASSERT_GT(parts.size(), 20u);
  ReportParts collected;
  // In another order, and some twice.
  std::reverse(parts.begin(), parts.end());
  for (size_t i = 0; i < parts.size(); ++i) {
    std::vector<uint8_t> bytes;
    parts[i].header = morphbus::header_t();
    Encode(parts[i], &bytes);
    EXPECT_LE(bytes.size(), kMaxPayloadBytes);
    const bool last = i + 1 == parts.size();
    EXPECT_EQ(collected.Take(parts[i]),
              last ? ReportParts::Kind::kComplete : ReportParts::Kind::kPart);
    EXPECT_EQ(collected.Take(parts[i]), ReportParts::Kind::kRepeated);
  }
  EXPECT_EQ(collected.report().totals.size(), 300u);
  EXPECT_EQ(collected.report().taken.size(), 300u);
  // The same part with another content, or of another number of parts.
  ask_t other = parts[3];
  if (!other.totals.empty()) other.totals[0].count += 1;
  if (!other.taken.empty()) other.taken[0].count += 1;
  EXPECT_EQ(collected.Take(other), ReportParts::Kind::kContradicts);
  other = parts[3];
  other.num_parts = static_cast<int16_t>(other.num_parts + 1);
  EXPECT_EQ(collected.Take(other), ReportParts::Kind::kContradicts);
  // Of an earlier tick nothing is news; of a later one everything is.
  other.acknowledged_tick = 6;
  EXPECT_EQ(collected.Take(other), ReportParts::Kind::kRepeated);
  other.acknowledged_tick = 8;
  EXPECT_EQ(collected.Take(other), ReportParts::Kind::kPart);
}

}  // namespace
}  // namespace morphbus::bridge
