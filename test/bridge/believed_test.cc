// Who is believed when somebody tells a module to leave or where to begin, or says in CLOCK that it
// is lost; and what shows, while a run goes on or in real time, of those who were told something
// else. All in virtual time; test/e2e/hostile.py has some of it over LCM.

#include <gtest/gtest.h>

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/ask_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>

#include "bridge/wire/channels.h"
#include "test/bridge/forger.h"

namespace morphbus::bridge {
namespace {

using morphbus::ask_t;

/// A request in `sender`'s name, at a tick.
Spoken RequestOf(int8_t kind, const std::string& sender, const std::string& to, int64_t tick,
                 const std::function<void(ask_t*)>& change = {}) {
  ask_t ask;
  ask.header = morphbus::header_t();
  ask.header.crc32 = 0;
  ask.header.protocol = morphbus::header_t::PROTOCOL;
  ask.header.tick = tick;
  ask.header.sequence = 77;
  ask.header.sim_time_us = tick * 20000;
  ask.header.model_hash = static_cast<int64_t>(kFakeModel);
  ask.header.program_hash = 0;
  ask.kind = kind;
  ask.sender = sender;
  ask.first_sequence = ask.last_sequence = 0;
  ask.acknowledged_tick = -1;
  ask.part = ask.num_parts = 0;
  ask.num_totals = ask.num_taken = 0;
  if (change) change(&ask);
  Spoken made{"test/" + to + "/ASK", {}};
  Encode(ask, &made.bytes);
  return made;
}

/// The tick that a message speaks of.
int64_t TickOf(const Spoken& message) {
  morphbus::header_t header;
  EXPECT_TRUE(DecodeHeader(message.bytes.data(), message.bytes.size(), &header));
  return header.tick;
}

/// The run comes to what it comes to undisturbed.
void ExpectSame(const Outcome& outcome, const Outcome& reference) {
  EXPECT_TRUE(outcome.sim_ok) << outcome.error;
  EXPECT_TRUE(outcome.log_clean) << outcome.error;
  EXPECT_EQ(outcome.published, reference.published);
  EXPECT_EQ(outcome.recorded, reference.published);
  EXPECT_EQ(outcome.state, reference.state);
  EXPECT_EQ(outcome.moves, reference.moves);
}

Outcome CalmRun(const FakeRunOptions& options) {
  FakeRun run(options);
  return OutcomeOf(&run);
}

/// A run in which `attack` hears every message.
Outcome Attacked(FakeRun* run, const std::function<void(Forger*, const Spoken&)>& attack) {
  Forger* self = nullptr;
  Forger forger(run, [&](int64_t, const Spoken& message) { attack(self, message); });
  self = &forger;
  return OutcomeOf(run);
}

TEST(Believed, WhoeverTellsAModuleToLeaveIsBeliedByTheSim) {
  for (const double loss : {0.0, 0.2}) {
    FakeRunOptions options = Open();
    options.loss = loss;
    const Outcome reference = CalmRun(options);
    FakeRun run(options);
    const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
      if (heard.channel != "test/m2/ACTUATOR") return;
      // Of the tick that it has answered, and of others, again and again.
      for (const int64_t tick : {-1, 0, 0, 1, 30}) {
        forger->Say(
            RequestOf(ask_t::KIND_LEAVE, "SIM", "m2", std::max<int64_t>(0, TickOf(heard) + tick)));
      }
      forger->Say(RequestOf(ask_t::KIND_LEAVE, "m1", "m2", TickOf(heard)));
    });
    ExpectSame(outcome, reference);
    EXPECT_LT(outcome.seconds, reference.seconds + 3);
    EXPECT_GT(run.modules[1].participant->ledger().false_ends, options.ticks);
    EXPECT_NE(run.modules[1].participant->ledger().first_refused.find("m2/ASK: LEAVE"),
              std::string::npos);
  }
}

TEST(Believed, AModuleThatDiesAfterAForgedLeaveGoesOnAllTheSame) {
  const FakeRunOptions options = Open();
  const Outcome reference = CalmRun(options);
  FakeRun run(options);
  std::vector<uint8_t> snapshot;
  FakeRun::Module& victim = run.modules[1];
  const auto keep = [&](const std::vector<uint8_t>& bytes) { snapshot = bytes; };
  victim.participant->OnBeforePublish(keep);
  bool left = false;
  Forger* self = nullptr;
  Forger forger(&run, [&](int64_t, const Spoken& heard) {
    if (heard.channel == "test/m2/ACTUATOR" && TickOf(heard) == 9) {
      self->Say(RequestOf(ask_t::KIND_LEAVE, "SIM", "m2", 9));
    }
    if (heard.channel != "test/SIM/ASK") return;
    ask_t ask;
    ASSERT_TRUE(Decode(heard.bytes.data(), heard.bytes.size(), {}, &ask));
    left |= ask.kind == ask_t::KIND_END_ACK && ask.sender == "m2";
  });
  self = &forger;
  ASSERT_TRUE(run.RunUntil([&] { return left; }));
  // What it saved says that it was told to leave.
  const std::vector<uint8_t> saved = snapshot;
  victim.participant.reset();
  victim.seat = std::make_unique<FakeRun::Seat>(&run, 0, 1);
  victim.controller = std::make_unique<FakeController>(1);
  victim.participant = std::make_unique<ModuleParticipant>(
      &victim.seat->bus, victim.controller.get(), &run.time, run.ModuleOptions(1));
  victim.participant->OnBeforePublish(keep);
  ASSERT_TRUE(victim.participant->ResumeFrom(saved));
  victim.participant->Start();
  ExpectSame(OutcomeOf(&run), reference);
}

/// What the sim says on SENSORS of the first tick, with a change.
Spoken FirstSensors(const std::function<void(morphbus::sensors_t*)>& change) {
  for (const Spoken& said : Overhear(Open())) {
    if (said.channel == "test/SIM/SENSORS") return Altered<morphbus::sensors_t>(said, change);
  }
  ADD_FAILURE() << "the sim says no SENSORS";
  return {};
}

TEST(Believed, SensorsOfFarLaterTicksSendNobodyAway) {
  const FakeRunOptions options = Open();
  const Outcome reference = CalmRun(options);
  FakeRun run(options);
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    // Three times three, while everybody has answered and waits for the next tick.
    const int64_t tick = TickOf(heard);
    if (heard.channel != "test/m2/ACTUATOR" || tick < 10 || tick > 12) return;
    for (int64_t i = 1; i <= 3; ++i) {
      forger->Say(FirstSensors([&](morphbus::sensors_t* sensors) {
        sensors->header.tick = sensors->header.sequence = 1000 * tick + i;
      }));
    }
  });
  ExpectSame(outcome, reference);
  for (const FakeRun::Module& module : run.modules) {
    EXPECT_EQ(module.participant->error(), "");
    EXPECT_EQ(module.participant->ledger().outside_window, 9);
  }
}

TEST(Believed, WhoeverSaysSensorsBeforeTheFirstClockIsNotTheSim) {
  const Spoken forged = FirstSensors([](morphbus::sensors_t* sensors) {
    sensors->modules[0].joint_position_si[0] += 0.25;
    sensors->modules[1].name = "m9";
  });
  for (const double loss : {0.0, 0.2}) {
    FakeRunOptions options = Open();
    options.loss = loss;
    const Outcome reference = CalmRun(options);
    FakeRun run(options);
    // The modules' first HELLO comes before the sim listens, so that CLOCK comes after the second.
    const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
      if (run.time.NowUs() > 0) return;
      EXPECT_EQ(heard.channel, "test/HELLO");
      forger->Say(forged);
    });
    ExpectSame(outcome, reference);
  }
}

/// The module m2 is lost from tick 15 on, at the sim's own word.
void LoseM2(FakeRun* run) {
  run->sim->OnAfterTick([run](int64_t tick) {
    if (tick == 14) run->sim->Lose(1);
  });
  run->sim->OnBeforeTick([run](int64_t tick) {
    if (tick == 15) run->sim->AnnounceControl("lose m2");
  });
}

TEST(Believed, WhoeverCallsALostModuleBackChangesNothing) {
  const FakeRunOptions options = Open();
  FakeRun calm(options);
  LoseM2(&calm);
  const Outcome reference = OutcomeOf(&calm);
  ASSERT_TRUE(reference.sim_ok) << reference.error;
  FakeRun run(options);
  LoseM2(&run);
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/SIM/CLOCK" || TickOf(heard) < 15) return;
    forger->Say(RequestOf(ask_t::KIND_RESEND, "SIM", "m2", TickOf(heard), [&](ask_t* ask) {
      ask->channel = "test/m2/ACTUATOR";
      ask->first_sequence = ask->last_sequence = TickOf(heard);
    }));
  });
  ExpectSame(outcome, reference);
}

TEST(Believed, AClockThatComesSecondLosesNobody) {
  const FakeRunOptions options = Open();
  const Outcome reference = CalmRun(options);
  FakeRun run(options);
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/SIM/CLOCK") return;
    morphbus::sim_clock_t clock;
    ASSERT_TRUE(Decode(heard.bytes.data(), heard.bytes.size(), {}, &clock));
    if (clock.phase != morphbus::sim_clock_t::PHASE_RUN) return;
    forger->Say(Altered<morphbus::sim_clock_t>(heard, [](morphbus::sim_clock_t* forged) {
      forged->controls = {"lose m2"};
      forged->num_controls = 1;
    }));
  });
  ExpectSame(outcome, reference);
  EXPECT_GT(run.log->ledger().conflicts, 30);
  EXPECT_NE(run.log->ledger().first_refused.find("SIM/CLOCK: other bytes"), std::string::npos);
}

TEST(Believed, AClockThatComesFirstEndsTheRunSoonAndByName) {
  FakeRunOptions options = Open();
  options.ticks = 100'000;
  FakeRun run(options);
  run.sim->OnAfterTick([&](int64_t tick) {
    if (tick % 10 == 0) run.sim->PublishHealth();
  });
  bool said = false;
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/SIM/SENSORS" || TickOf(heard) != 20 || said) return;
    said = true;
    // Of the tick that comes next.
    Spoken forged{"test/SIM/CLOCK", {}};
    morphbus::sim_clock_t clock;
    clock.header = morphbus::header_t();
    DecodeHeader(heard.bytes.data(), heard.bytes.size(), &clock.header);
    clock.header.tick = clock.header.sequence = 21;
    clock.phase = morphbus::sim_clock_t::PHASE_RUN;
    clock.tick_us = 20000;
    clock.num_modules = 3;
    clock.num_sensors_parts = clock.num_world_parts = 1;
    clock.controls = {"lose m2"};
    clock.num_controls = 1;
    Encode(clock, &forged.bytes);
    forger->Say(forged);
  });
  EXPECT_TRUE(said);
  EXPECT_FALSE(outcome.sim_ok);
  EXPECT_FALSE(outcome.log_clean);
  EXPECT_EQ(run.log->error(),
            "LOG recorded other messages on SIM/CLOCK than SIM published: "
            "somebody else speaks on this bus");
  // Two reports later it is over, but for what the sim may be ahead of the log.
  EXPECT_LT(run.robot.ticks, 100);
}

/// A long run with losses, in which whoever lost a message takes an altered one for it: the logger
/// has mostly the true one.
std::string ErrorOfDeceived(const std::string& channel, uint64_t seed,
                            const std::function<Spoken(const Spoken&)>& alter, int64_t* ticks) {
  FakeRunOptions options = Open();
  options.ticks = 2000;
  options.loss = 0.1;
  options.seed = seed;
  FakeRun run(options);
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel == channel && TickOf(heard) >= 20) forger->Say(alter(heard));
  });
  EXPECT_FALSE(outcome.sim_ok);
  EXPECT_FALSE(outcome.log_clean);
  *ticks = run.robot.ticks;
  return run.log->error();
}

TEST(Believed, WhatOnlyAModuleWasToldShowsWhileTheRunGoesOn) {
  int64_t ticks = 0;
  const auto sensors = [](const Spoken& heard) {
    return Altered<morphbus::sensors_t>(heard, [](morphbus::sensors_t* m) {
      for (auto& reading : m->modules) reading.joint_position_si[0] += 0.25;
    });
  };
  EXPECT_NE(ErrorOfDeceived("test/SIM/SENSORS", 1, sensors, &ticks)
                .find(" took other messages on SIM/SENSORS than LOG recorded"),
            std::string::npos);
  EXPECT_LT(ticks, 300);
  const auto transform = [](const Spoken& heard) {
    return Altered<morphbus::transform_t>(heard,
                                          [](morphbus::transform_t* m) { m->root_sequence ^= 5; });
  };
  EXPECT_NE(ErrorOfDeceived("test/m2/TRANSFORM", 1, transform, &ticks)
                .find(" took other messages on m2/TRANSFORM than LOG recorded"),
            std::string::npos);
  EXPECT_LT(ticks, 300);
}

TEST(Believed, WhatOnlyTheSimWasToldShowsWhileTheRunGoesOn) {
  int64_t ticks = 0;
  const auto alter = [](const Spoken& heard) {
    return Altered<morphbus::actuator_t>(
        heard, [](morphbus::actuator_t* m) { m->joints[0].target_si += 0.25; });
  };
  EXPECT_EQ(
      ErrorOfDeceived("test/m2/ACTUATOR", 1, alter, &ticks),
      "SIM took other messages on m2/ACTUATOR than LOG recorded: somebody else speaks on this "
      "bus");
  EXPECT_LT(ticks, 300);
}

TEST(Believed, OneForgedReportOfWhatWasTakenEndsNothing) {
  const FakeRunOptions options = Open();
  FakeRun run(options);
  int reports = 0;
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    ask_t ask;
    if (heard.channel != "test/LOG/ASK" ||
        !Decode(heard.bytes.data(), heard.bytes.size(), {}, &ask) ||
        ask.kind != ask_t::KIND_TAKEN) {
      return;
    }
    ++reports;
    forger->Say(Altered<ask_t>(heard, [](ask_t* forged) { forged->taken[0].sum ^= 5; }));
  });
  ExpectSame(outcome, CalmRun(options));
  EXPECT_GE(reports, 4) << "the sim's and each module's, of the first 32 ticks";
}

// Real time: messages may be lost, but none may be two.

/// What becomes of a run in real time of which a message of the channel is said once more, altered,
/// before the true one (of the next tick) or behind it.
template <class M>
Outcome RealtimeWith(const std::string& channel, int64_t ahead,
                     const std::function<void(M*)>& alter) {
  FakeRunOptions options = Open();
  options.realtime = true;
  options.ticks = 150;
  FakeRun run(options);
  bool said = false;
  Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel != channel || TickOf(heard) < 50 || said) return;
    said = true;
    forger->Say(Altered<M>(heard, [&](M* message) {
      message->header.tick += ahead;
      message->header.sequence += ahead;
      message->header.sim_time_us += 20000 * ahead;
      alter(message);
    }));
  });
  EXPECT_TRUE(said) << channel;
  // A logger that has found out is gone before the end, and the launcher tells why.
  outcome.error += "; " + run.log->error();
  return outcome;
}

void ExpectNamed(const Outcome& outcome, const std::string& channel) {
  EXPECT_FALSE(outcome.sim_ok) << channel;
  EXPECT_FALSE(outcome.log_clean) << channel;
  EXPECT_NE(outcome.error.find(channel), std::string::npos) << outcome.error;
}

TEST(Believed, InRealTimeNoNumberHasTwoMessages) {
  for (const int64_t ahead : {0, 1}) {
    ExpectNamed(RealtimeWith<morphbus::actuator_t>(
                    "test/m2/ACTUATOR", ahead,
                    [](morphbus::actuator_t* m) { m->joints[0].target_si += 0.25; }),
                "m2/ACTUATOR");
    ExpectNamed(RealtimeWith<morphbus::sensors_t>(
                    "test/SIM/SENSORS", ahead,
                    [](morphbus::sensors_t* m) { m->modules[0].joint_position_si[0] += 0.25; }),
                "SIM/SENSORS");
    ExpectNamed(
        RealtimeWith<morphbus::transform_t>(
            "test/m2/TRANSFORM", ahead, [](morphbus::transform_t* m) { m->root_sequence ^= 5; }),
        "m2/TRANSFORM");
  }
  ExpectNamed(RealtimeWith<morphbus::status_t>("test/m2/STATUS", 0,
                                               [](morphbus::status_t* m) { m->role_name = "F"; }),
              "m2/STATUS");
}

TEST(Believed, InRealTimeANumberThatNobodySaidShowsInTheTotals) {
  // The number of a STATUS that is never said: nothing is missing, and one is too many.
  FakeRunOptions options = Open();
  options.realtime = true;
  options.ticks = 60;
  FakeRun run(options);
  Spoken last;
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel == "test/m2/STATUS") last = heard;
    if (heard.channel != "test/m2/ACTUATOR" || TickOf(heard) != 59 || last.bytes.empty()) return;
    forger->Say(Altered<morphbus::status_t>(last, [](morphbus::status_t* m) {
      ++m->header.sequence;
      m->role_name = "F";
    }));
  });
  ExpectNamed(outcome, "m2/STATUS");
}

TEST(Believed, InRealTimeLossIsNoLie) {
  FakeRunOptions options = Open();
  options.realtime = true;
  options.ticks = 150;
  options.loss = 0.1;
  const Outcome outcome = CalmRun(options);
  EXPECT_TRUE(outcome.sim_ok) << outcome.error;
  EXPECT_TRUE(outcome.log_clean) << outcome.error;
}

TEST(Believed, InRealTimeWhoeverTellsAModuleToLeaveIsBeliedByTheSim) {
  FakeRunOptions options = Open();
  options.realtime = true;
  options.ticks = 150;
  FakeRun run(options);
  bool said = false;
  const Outcome outcome = Attacked(&run, [&](Forger* forger, const Spoken& heard) {
    if (heard.channel != "test/m2/ACTUATOR" || TickOf(heard) < 50 || said) return;
    said = true;
    forger->Say(RequestOf(ask_t::KIND_LEAVE, "SIM", "m2", TickOf(heard)));
  });
  EXPECT_TRUE(outcome.sim_ok) << outcome.error;
  EXPECT_GT(outcome.refused.false_ends, 0);
  EXPECT_GE(run.modules[1].controller->computed.size(), 140u) << "it has gone on";
}

}  // namespace
}  // namespace morphbus::bridge
