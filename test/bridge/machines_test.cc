// Single participants and their machines, told by a test what nobody of a sound run says, or what
// only a bad bus makes of it: in another order, twice, or of two places at once.

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <morphbus/actuator_t.hpp>
#include <morphbus/admit_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/wire/channels.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

using morphbus::sim_clock_t;

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

TEST(Outbox, RequestsToHoweverManyOthersAreNoPartOfASnapshot) {
  Stage stage;
  stage.Say("m1/ACTUATOR", 0, AnswerOf(0));
  for (int i = 0; i < 50; ++i) {
    stage.Say("m" + std::to_string(i + 2) + "/RESEND", 0, morphbus::resend_t());
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

  /// The sim says that `tick` comes next, to the process of this claim.
  void Admit(int64_t tick, int64_t claim) {
    Say("SIM/ADMIT", tick, morphbus::admit_t{{}, "m1", claim, tick - 1, 0, 0});
  }

  FakeController controller{0};
  std::unique_ptr<Bus> module_bus = hub.Connect();
  std::unique_ptr<ModuleParticipant> module;
  std::vector<uint8_t> snapshot;
  int greetings = 0;
};

TEST(ModuleParticipant, AnAdmissionOfAnotherProcessIsNone) {
  NewcomerStage stage;
  // What the sim said to one that had the place before.
  stage.Admit(100, 99);
  EXPECT_EQ(stage.module->tick(), 0);
  stage.Admit(7, FakeRun{FakeRunOptions()}.ModuleOptions(0).claim);
  EXPECT_EQ(stage.module->tick(), 7);
  // Said once more, or of another tick, it changes nothing.
  stage.Admit(9, FakeRun{FakeRunOptions()}.ModuleOptions(0).claim);
  EXPECT_EQ(stage.module->tick(), 7);
}

}  // namespace
}  // namespace morphbus::bridge
