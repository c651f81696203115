// Single participants and their machines, told by a test what nobody of a sound run says, or what
// only a bad bus makes of it: in another order, twice, or of two places at once.

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <morphbus/actuator_t.hpp>
#include <morphbus/ask_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/wire/channels.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

using morphbus::ask_t;
using morphbus::sim_clock_t;
using Taken = LogLockstep::Taken;

TEST(ModuleLockstep, HasNothingOfAWrongTickOnceItBeginsAgain) {
  ModuleLockstep module({false, {}});
  ModuleLockstep::Actions out;
  module.Begin(ModuleLockstep::kUnknownTick, 0, &out);
  module.OnAdmit(40, 0);
  // Of tick 40 it has its own reading, in the first of two parts.
  module.OnSensors(40, 0, 2, true, {}, 0, &out);
  ASSERT_EQ(module.tick(), 40);
  module.Begin(ModuleLockstep::kUnknownTick, 0, &out);
  module.OnAdmit(7, 0);
  module.OnSensors(7, 1, 2, false, {}, 0, &out);
  EXPECT_EQ(module.tick(), 7) << "it lacks its own reading";
  module.OnSensors(7, 0, 2, true, {}, 0, &out);
  EXPECT_EQ(module.tick(), 8);
}

/// A logger's machine that has heard CLOCK of so many ticks of a run without modules.
LogLockstep Listening(int64_t ticks, LogLockstep::Actions* out) {
  LogLockstep log(LogLockstep::Config{});
  log.Begin(0, out);
  for (int64_t tick = 0; tick < ticks; ++tick) {
    EXPECT_EQ(log.OnClock(tick, tick, sim_clock_t::PHASE_RUN, 0, 0, 0, 0, out), Taken::kFresh);
  }
  return log;
}

TEST(LogLockstep, OnlyWhatIsBelievedContradictsTheFirstClock) {
  LogLockstep::Actions out;
  LogLockstep log = Listening(5, &out);
  // Under a number that was had, of a tick out of reach, under a number that is not its tick's.
  log.OnClock(3, 3, sim_clock_t::PHASE_RUN, 9, 9, 9, 0, &out);
  log.OnClock(900, 900, sim_clock_t::PHASE_RUN, 9, 9, 9, 0, &out);
  log.OnClock(6, 5, sim_clock_t::PHASE_RUN, 9, 9, 9, 0, &out);
  EXPECT_FALSE(log.contradicted());
  log.OnClock(5, 5, sim_clock_t::PHASE_RUN, 9, 0, 0, 0, &out);
  EXPECT_TRUE(log.contradicted());
}

TEST(LogLockstep, AnotherEndTakesThePlaceOfTheFirst) {
  LogLockstep::Actions out;
  LogLockstep log = Listening(5, &out);
  const auto end = [&](int64_t tick) {
    return log.OnClock(tick, tick, sim_clock_t::PHASE_END, 0, 0, 0, 0, &out);
  };
  EXPECT_EQ(end(5), Taken::kFresh);
  EXPECT_EQ(end(5), Taken::kKnown);
  EXPECT_EQ(log.end_tick(), 5);
  // The sim repeats its own, so that the last one is the sim's.
  EXPECT_EQ(end(6), Taken::kFresh);
  EXPECT_EQ(log.end_tick(), 6);
}

/// A bus with somebody on it who says what a test wants, in the sim's name.
struct Stage {
  InprocHub hub;
  VirtualTime time;
  Ledger ledger;
  std::unique_ptr<Bus> bus = hub.Connect();
  Outbox sim{bus.get(), {"test", "SIM", kFakeModel, 0}, &ledger};

  /// Sends on a channel of the run, of a tick; everybody then takes what there is.
  template <class M>
  void Say(const std::string& channel, int64_t tick, M message) {
    sim.Send("test/" + channel, tick, tick * 20000, &message);
    hub.HandleAll();
  }
};

/// A request with nothing in it but its kind.
ask_t RequestOfSim(int8_t kind) {
  ask_t ask;
  ask.kind = kind;
  ask.sender = "SIM";
  ask.first_sequence = ask.last_sequence = 0;
  ask.acknowledged_tick = -1;
  ask.part = ask.num_parts = 0;
  ask.num_totals = ask.num_taken = 0;
  return ask;
}

/// A logger that has heard the CLOCK of tick 0 of a run of one module, and no more.
struct LoggerStage : Stage {
  LoggerStage() {
    LogParticipantOptions options;
    options.run = "test";
    options.model_hash = kFakeModel;
    log = std::make_unique<LogParticipant>(log_bus.get(), &time, options, nullptr);
    log->Start();
    sim_clock_t clock;
    clock.phase = sim_clock_t::PHASE_RUN;
    clock.tick_us = 20000;
    clock.num_modules = clock.num_sensors_parts = 1;
    clock.num_world_parts = clock.num_controls = 0;
    Say("SIM/CLOCK", 0, clock);
    EXPECT_EQ(Channels(), "test/SIM/CLOCK ");
  }

  /// The channels of which the logger tells how much came.
  [[nodiscard]] std::string Channels() const {
    std::string channels;
    for (const ChannelTotal& total : log->totals()) channels += total.channel + " ";
    return channels;
  }

  std::unique_ptr<Bus> log_bus = hub.Connect();
  std::unique_ptr<LogParticipant> log;
};

/// What the module answers to a tick.
morphbus::actuator_t AnswerOf(uint16_t module) {
  morphbus::actuator_t answer;
  answer.module_id = static_cast<int16_t>(module);
  answer.status_count = 0;
  answer.num_joints = answer.num_connectors = 0;
  return answer;
}

/// SENSORS of one module.
morphbus::sensors_t SensorsOf(const std::string& name) {
  morphbus::sensors_t sensors;
  sensors.part = 0;
  sensors.num_parts = 1;
  sensors.num_modules = 1;
  sensors.num_requests = sensors.num_pieces = sensors.num_root_poses = 0;
  sensors.num_inspected = 0;
  sensors.modules.resize(1);
  morphbus::module_sensors_t& reading = sensors.modules[0];
  reading.module_id = 0;
  reading.name = name;
  reading.num_joints = reading.num_sensor_values = reading.num_docked = 0;
  return sensors;
}

TEST(LogParticipant, WhoSpeaksBeforeSensorsNamesAllHasNoChannelYet) {
  LoggerStage stage;
  // SENSORS of tick 0 is late. The module is one of the run, which the logger cannot know; the
  // other one is not.
  for (const char* process : {"m1", "m9"}) {
    stage.Say(std::string(process) + "/ACTUATOR", 0, AnswerOf(process[1] == '1' ? 0 : 8));
  }
  EXPECT_EQ(stage.Channels(), "test/SIM/CLOCK ");
  stage.Say("SIM/SENSORS", 0, SensorsOf("m1"));
  // What was said too soon is said again.
  EXPECT_EQ(stage.sim.Resend("test/m1/ACTUATOR", 0, 0), 1);
  EXPECT_EQ(stage.sim.Resend("test/m9/ACTUATOR", 0, 0), 1);
  stage.hub.HandleAll();
  EXPECT_EQ(stage.Channels(), "test/SIM/CLOCK test/SIM/SENSORS test/m1/ACTUATOR ");
}

TEST(LogParticipant, AReportOfAllTicksThereAreIsNone) {
  LoggerStage stage;
  stage.Say("SIM/SENSORS", 0, SensorsOf("m1"));
  // Their number fits into no integer.
  ask_t report = RequestOfSim(ask_t::KIND_TAKEN);
  report.last_sequence = std::numeric_limits<int64_t>::max();
  report.num_taken = 1;
  report.taken.resize(1);
  report.taken[0].channel = "test/SIM/SENSORS";
  report.taken[0].part = 0;
  report.taken[0].taker = "SIM";
  report.taken[0].count = 1;
  report.taken[0].sum = 1;
  for (int i = 0; i < 2; ++i) stage.Say("LOG/ASK", 0, report);
  EXPECT_EQ(stage.log->ledger().bad, 0) << "the message itself is sound";
  EXPECT_EQ(stage.log->error(), "");
  EXPECT_FALSE(stage.log->done());
}

TEST(Outbox, RequestsToHoweverManyOthersAreNoPartOfASnapshot) {
  Stage stage;
  stage.Say("m1/ACTUATOR", 0, AnswerOf(0));
  for (int i = 0; i < 50; ++i) {
    stage.Say("m" + std::to_string(i + 2) + "/ASK", 0, RequestOfSim(ask_t::KIND_RESEND));
  }
  std::vector<uint8_t> saved;
  stage.sim.Save(&saved);
  Outbox resumed(stage.bus.get(), {"test", "m1", kFakeModel, 0}, &stage.ledger);
  const Result<size_t> used = resumed.Load(saved.data(), saved.size());
  ASSERT_TRUE(used) << used.error().message;
  EXPECT_EQ(*used, saved.size());
  EXPECT_EQ(resumed.count("test/m1/ACTUATOR"), 1);
}

/// A module that takes another's place, and what it says on HELLO.
struct NewcomerStage : Stage {
  NewcomerStage() {
    bus->Subscribe("test/HELLO", [this](std::string_view, const uint8_t*, size_t) { ++greetings; });
    Begin({});
  }

  /// The process begins, from what its predecessor saved if that is not empty.
  void Begin(const std::vector<uint8_t>& from) {
    module.reset();
    const FakeRun run{FakeRunOptions()};
    ModuleParticipantOptions options = run.ModuleOptions(0);
    options.incarnation = 2;
    module = std::make_unique<ModuleParticipant>(module_bus.get(), &controller, &time, options);
    module->OnBeforePublish([this](const std::vector<uint8_t>& bytes) { snapshot = bytes; });
    if (!from.empty()) {
      EXPECT_TRUE(module->ResumeFrom(from));
    }
    module->Start();
    hub.HandleAll();
  }

  /// The sim, or somebody in its name, says that `tick` comes next; believed at the second word.
  void Admit(int64_t tick) {
    ask_t ask = RequestOfSim(ask_t::KIND_ADMIT);
    ask.acknowledged_tick = tick - 1;
    for (int i = 0; i < 2; ++i) Say("m1/ASK", tick, ask);
  }

  FakeController controller{0};
  std::unique_ptr<Bus> module_bus = hub.Connect();
  std::unique_ptr<ModuleParticipant> module;
  std::vector<uint8_t> snapshot;
  int greetings = 0;
};

TEST(ModuleParticipant, WhoWasAdmittedToAWrongTickAndKilledStillFindsOut) {
  NewcomerStage stage;
  stage.Admit(100);
  ASSERT_EQ(stage.module->tick(), 100);
  const std::vector<uint8_t> saved = stage.snapshot;
  stage.Begin(saved);
  ASSERT_EQ(stage.module->tick(), 100);
  const int greetings = stage.greetings;
  // The sim waits for the answer to tick 5: it was not the sim that spoke of tick 100.
  ask_t wanted = RequestOfSim(ask_t::KIND_RESEND);
  wanted.channel = "test/m1/ACTUATOR";
  wanted.first_sequence = wanted.last_sequence = 5;
  stage.Say("m1/ASK", 5, wanted);
  EXPECT_EQ(stage.greetings, greetings + 1);
  EXPECT_EQ(stage.module->ledger().false_ends, 1);
  stage.Admit(5);
  EXPECT_EQ(stage.module->tick(), 5);
}

}  // namespace
}  // namespace morphbus::bridge
