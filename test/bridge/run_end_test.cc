// How whole runs on the in-process bus end when somebody is missing, falls silent or disagrees: who
// is named, how soon, and what the logger may say of it. All in virtual time.

#include <gtest/gtest.h>

#include <algorithm>

#include "bridge/lockstep/sim/run_ending.h"
#include "bridge/wire/codec.h"
#include "test/bridge/fake_run.h"
#include "test/bridge/lossy_bus.h"

namespace morphbus::bridge {
namespace {

/// A run after so many ticks, in which these kept silent and those were lost.
RunEnding::Facts After(int64_t ticks, const std::vector<std::string>& silent,
                       const std::vector<std::string>& gone = {}) {
  RunEnding::Facts facts;
  facts.ticks = ticks;
  facts.silent = silent;
  facts.gone = gone;
  return facts;
}

TEST(RunEnding, TheFirstReasonHoldsAndTellsOfThoseThatAreGone) {
  const auto reason = [](const RunEnding::Facts& facts, const std::string& planned,
                         const std::vector<std::string>& asked) {
    RunEnding ending(2, true, false, planned);
    for (const std::string& each : asked) ending.AskFor(each);
    return ending.ChooseReason(facts);
  };
  EXPECT_EQ(reason({}, "", {}), "finished");
  EXPECT_EQ(reason({}, "stopped by hand", {}), "stopped by hand") << "as the first run did";
  EXPECT_EQ(reason(After(3, {}, {"m1", "m2"}), "", {}), "finished, without m1, without m2");
  EXPECT_EQ(reason(After(3, {"m1"}), "planned", {"interrupted", "later"}), "interrupted");
  EXPECT_EQ(reason(After(3, {"m1"}), "planned", {}), "m1 does not answer");
}

TEST(RunEnding, TheSilentAreNamedTheLoggerFirst) {
  RunEnding ending(5, true, false, "");
  ending.Conclude(After(3, {"m1", "m2", "LOG", "m3", "m5"}), {});
  EXPECT_EQ(ending.outcome().error, "LOG, m1, m2 and 2 more do not answer");
  // What refused the run is the reason for their silence.
  ending.Refuse("the robot broke");
  ending.Refuse("and then more");
  ending.Conclude(After(3, {"m1"}), {});
  EXPECT_EQ(ending.outcome().error, "the robot broke");
  EXPECT_FALSE(ending.outcome().ok);
}

/// What a member tells of one channel.
morphbus::totals_t Told(const std::string& process, int64_t count, int64_t hash) {
  const std::vector<ChannelTotal> totals = {{"test/m1/ACTUATOR", count, hash, true}};
  return SplitTotals(process, 9, totals).front();
}

TEST(RunEnding, TheHashIsOfWhatAllHaveToldAndTheLogMustHoldIt) {
  RunEnding::Facts facts = After(10, {});
  facts.all_acknowledged = true;
  for (const bool same : {true, false}) {
    RunEnding ending(1, true, false, "");
    EXPECT_TRUE(ending.Take(0, Told("m1", 10, 77)));
    EXPECT_FALSE(ending.Take(0, Told("m1", 10, 77))) << "it was had before";
    EXPECT_TRUE(ending.Take(1, Told("LOG", 10, same ? 77 : 78)));
    ending.Conclude(facts, {});
    const SimOutcome& outcome = ending.outcome();
    EXPECT_EQ(outcome.messages, 10);
    EXPECT_EQ(outcome.run_hash == outcome.recorded_hash, same);
    EXPECT_EQ(outcome.ok, same);
    EXPECT_EQ(outcome.error.empty(), same) << outcome.error;
  }
}

TEST(RunEnding, WhatTheDeadHavePublishedOnlyTheLoggerKnows) {
  RunEnding ending(1, true, false, "");
  ending.Take(1, Told("LOG", 10, 77));
  RunEnding::Facts facts = After(10, {});
  facts.all_acknowledged = true;
  facts.unvouched = {"m1"};
  ending.Conclude(facts, {});
  EXPECT_FALSE(ending.outcome().run_hash.empty());
  EXPECT_EQ(ending.outcome().run_hash, ending.outcome().recorded_hash);
  ending.Conclude(After(10, {}), {});
  EXPECT_EQ(ending.outcome().run_hash, "") << "a module has not acknowledged END";
}

/// Wall time of the run in seconds, in the run's virtual time.
double SecondsOf(const FakeRun& run) { return static_cast<double>(run.time.NowUs()) * 1e-6; }

TEST(RunEnd, WhoNeverJoinsIsReportedMeanwhileAndNamedAtTheEnd) {
  FakeRunOptions options;
  options.timing.join_silence_us = 12'000'000;
  FakeRun run(options);
  std::vector<std::vector<std::string>> reports;
  run.sim->OnMissing(
      [&reports](const std::vector<std::string>& missing) { reports.push_back(missing); });
  std::vector<Participant*> participants = run.participants();
  participants.erase(participants.begin() + 1);  // m2
  ASSERT_TRUE(RunInproc(&run.hub, &run.time, participants));
  const std::vector<std::string> m2 = {"m2"};
  EXPECT_EQ(reports, (std::vector<std::vector<std::string>>{m2, m2})) << "every five seconds";
  EXPECT_FALSE(run.sim->outcome().ok);
  EXPECT_EQ(run.sim->outcome().error, "m2 does not answer (the run had not begun)");
  EXPECT_EQ(run.sim->missing_processes(), m2);
  EXPECT_EQ(run.log->error(), run.sim->outcome().error) << "the log's END is not clean";
  EXPECT_EQ(run.log->end_reason(), run.sim->outcome().error);
  EXPECT_LT(SecondsOf(run), 12 + 3);
}

TEST(RunEnd, ARunStoppedBeforeAllHaveJoinedEndsAtOnceAsPlanned) {
  FakeRun run({});
  std::vector<Participant*> participants = run.participants();
  participants.erase(participants.begin() + 1);  // m2
  for (Participant* participant : participants) participant->Start();
  run.hub.HandleAll();
  run.sim->RequestStop("interrupted");
  while (!run.sim->done() || !run.log->done()) {
    if (run.hub.HandleRound() > 0) continue;
    run.time.AdvanceTo(run.time.NowUs() + 10'000);
    for (Participant* participant : participants) participant->OnTime();
  }
  EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
  EXPECT_EQ(run.log->error(), "");
  EXPECT_EQ(run.log->end_reason(), "interrupted");
  EXPECT_LT(SecondsOf(run), 2);
}

TEST(RunEnd, ThoseThatJoinedAreNotBlamedForThoseThatDidNot) {
  FakeRunOptions options;
  options.modules = 5;
  FakeRun run(options);
  // Only m1, m2 and the sim are started.
  ASSERT_TRUE(RunInproc(
      &run.hub, &run.time,
      {run.modules[0].participant.get(), run.modules[1].participant.get(), run.sim.get()}));
  EXPECT_EQ(run.sim->outcome().error,
            "LOG, m3, m4 and 1 more do not answer (the run had not begun)");
}

TEST(RunEnd, WhoDoesNotAcknowledgeTheEndIsNamedAfterFiveSeconds) {
  FakeRunOptions options;
  FakeRun run(options);
  run.sim->OnBeforeTick([&run](int64_t tick) {
    // From its last answer on m3 hears nothing.
    if (tick == run.options.ticks - 1) run.modules[2].seat->endpoint->Unsubscribe("test/SIM/CLOCK");
  });
  std::vector<Participant*> participants = run.participants();
  ASSERT_TRUE(RunInproc(&run.hub, &run.time, participants));
  EXPECT_FALSE(run.sim->outcome().ok);
  EXPECT_EQ(run.sim->outcome().error, "m3 does not answer");
  EXPECT_EQ(run.sim->outcome().run_hash, "") << "nobody knows what m3 published";
  EXPECT_NE(run.modules[2].participant->error(), "");
  EXPECT_TRUE(run.log->complete());
  EXPECT_EQ(run.log->end_reason(), "finished") << "that was the plan";
  EXPECT_EQ(run.log->error(), "m3 does not answer") << "this is what came of it";
}

TEST(RunEnd, ASilentModuleIsNamedWithinSecondsAndTheLogKnowsIt) {
  for (const double loss : {0.0, 0.2}) {
    FakeRunOptions options;
    options.loss = loss;
    FakeRun run(options);
    // Stopped for good (SIGSTOP): once tick 7 has begun, m2 neither hears nor polls.
    double stopped_s = -1;
    run.sim->OnBeforeTick([&](int64_t tick) {
      if (tick != 7) return;
      stopped_s = SecondsOf(run);
      for (const char* channel : {"test/SIM/SENSORS", "test/SIM/CLOCK", "test/m1/TRANSFORM",
                                  "test/m3/TRANSFORM", "test/m2/RESEND", "test/SIM/LEAVE"}) {
        run.modules[1].seat->endpoint->Unsubscribe(channel);
      }
    });
    const std::vector<Participant*> all = run.participants();
    for (Participant* participant : all) participant->Start();
    while (!run.sim->done() || !run.log->done()) {
      if (run.hub.HandleRound() > 0) continue;
      run.time.AdvanceTo(run.time.NowUs() + 1000);
      for (Participant* participant : all) {
        if (stopped_s < 0 || participant != run.modules[1].participant.get()) {
          participant->OnTime();
        }
      }
    }
    EXPECT_EQ(run.sim->outcome().error, "m2 does not answer");
    EXPECT_EQ(run.sim->outcome().ticks, 7);
    // Where m2's last words were lost, its neighbours were silent, too, until they heard END.
    EXPECT_NE(run.sim->outcome().reason.find("not answer"), std::string::npos);
    EXPECT_EQ(run.sim->outcome().run_hash, "") << "nobody knows what m2 published";
    EXPECT_EQ(run.modules[0].participant->end_reason(), run.sim->outcome().reason);
    EXPECT_EQ(run.modules[0].participant->error(), "") << "m1 did all it had to";
    EXPECT_EQ(run.log->error(), "m2 does not answer") << "not clean";
    // Five seconds of silence, and then some for the others to say what they have.
    EXPECT_LT(SecondsOf(run), stopped_s + (loss == 0 ? 7.5 : 12)) << "loss " << loss;
  }
}

TEST(RunEnd, AStoppedLoggerIsNamedAndNoModuleIsBlamed) {
  FakeRunOptions options;
  FakeRun run(options);
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 7) run.log_seat->endpoint->Unsubscribe("test/");
  });
  run.log->Start();
  std::vector<Participant*> others = run.participants();
  others.erase(others.begin() + 3);
  ASSERT_TRUE(RunInproc(&run.hub, &run.time, others));
  EXPECT_EQ(run.sim->outcome().error, "LOG does not answer");
  for (const FakeRun::Module& module : run.modules) EXPECT_EQ(module.participant->error(), "");
  // It goes on later and finds nobody.
  for (int i = 0; i < 100 && !run.log->done(); ++i) {
    run.time.AdvanceTo(run.time.NowUs() + 500'000);
    run.log->OnTime();
  }
  EXPECT_TRUE(run.log->done());
  EXPECT_NE(run.log->error(), "");
}

TEST(RunEnd, ALoggerThatNeverHearsTheVerdictDoesNotCallTheRunClean) {
  FakeRun run({});
  // The sim falls silent for good once the logger has acknowledged END.
  std::vector<Participant*> all = run.participants();
  for (Participant* participant : all) participant->Start();
  bool ended = false;
  run.sim_seat->endpoint->Subscribe("test/TOTALS", [](std::string_view, const uint8_t*, size_t) {});
  while (!run.log->done()) {
    if (run.hub.HandleRound() > 0) continue;
    run.time.AdvanceTo(run.time.NowUs() + 100'000);
    ended = ended || run.sim->tick() == run.options.ticks;
    for (Participant* participant : all) {
      if (!ended || participant != run.sim.get()) participant->OnTime();
    }
  }
  EXPECT_TRUE(run.log->complete());
  EXPECT_NE(run.log->error(), "") << "whether everybody acknowledged was never told";
}

/// A bus on which m2's command of tick 6 arrives as another, just as sound one.
class AlteringBus : public LossyBus {
 public:
  explicit AlteringBus(Bus* inner) : LossyBus(inner, 0, 1) {}
  void Receive(const Channels& channels, Handler handler) override {
    LossyBus::Receive(channels, [handler = std::move(handler)](std::string_view channel,
                                                               const uint8_t* data, size_t size) {
      morphbus::actuator_t command;
      std::vector<uint8_t> bytes(data, data + size);
      if (channel == "test/m2/ACTUATOR" && Decode(data, size, {}, &command) &&
          command.header.tick == 6) {
        command.joints[0].target_si += 0.001;
        Encode(command, &bytes);
      }
      handler(channel, bytes.data(), bytes.size());
    });
  }
};

TEST(RunEnd, ALogThatHoldsAnotherRunThanIsPublishedEndsItWhileItGoesOn) {
  FakeRunOptions long_run;
  long_run.ticks = 10'000;
  FakeRun run(long_run);
  AlteringBus bus(&run.log_seat->sealed);
  LogParticipantOptions options;
  options.run = run.options.run;
  options.model_hash = kFakeModel;
  run.log = std::make_unique<LogParticipant>(&bus, run.clock, options, nullptr);
  run.sim->OnAfterTick([&](int64_t tick) {
    if (tick % 10 == 0) run.modules[1].participant->PublishHealth();
  });
  ASSERT_TRUE(run.Run());
  EXPECT_EQ(run.log->error(), "LOG recorded other messages on m2/ACTUATOR than m2 published");
  EXPECT_FALSE(run.sim->outcome().ok);
  // With the next report, but for what the sim may be ahead of the log.
  EXPECT_LT(run.robot.ticks, 100);
}

TEST(RunEnd, ALogThatHoldsAnotherRunThanWasPublishedIsNotClean) {
  FakeRun run({});
  AlteringBus bus(&run.log_seat->sealed);
  LogParticipantOptions options;
  options.run = run.options.run;
  options.model_hash = kFakeModel;
  run.log = std::make_unique<LogParticipant>(&bus, run.clock, options, nullptr);
  ASSERT_TRUE(run.Run());
  EXPECT_NE(run.sim->outcome().error.find("LOG recorded other messages"), std::string::npos)
      << run.sim->outcome().error;
  EXPECT_EQ(run.log->error(), run.sim->outcome().error);
}

}  // namespace
}  // namespace morphbus::bridge
