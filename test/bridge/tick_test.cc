// What a tick of the simulator consists of: the robot's readings, the messages that tell of them,
// and the commands that answer.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/sim/robot_readings.h"
#include "bridge/lockstep/sim/tick_commands.h"
#include "bridge/lockstep/sim/tick_publisher.h"
#include "bridge/wire/codec.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

RobotReadings ReadingsOf(FakeRobot* robot) {
  RobotReadings readings;
  readings.Sense(robot, nullptr);
  return readings;
}

TEST(RobotReadings, HopsAreCountedAlongTheChainAsItIsDocked) {
  FakeRobot robot(5);
  EXPECT_EQ(ReadingsOf(&robot).HopsFrom(0), 4);
  EXPECT_EQ(ReadingsOf(&robot).HopsFrom(2), 2);
  robot.DisconnectAt(0, 2);
  EXPECT_EQ(ReadingsOf(&robot).HopsFrom(0), 2) << "nothing leads to the other half";
  EXPECT_EQ(RobotReadings().HopsFrom(0), 0) << "before the first tick";
}

TEST(RobotReadings, NothingConnectsAModuleThatIsLost) {
  FakeRobot robot(4);
  RobotReadings readings = ReadingsOf(&robot);
  readings.HideLost([](int id) { return id == 1; });
  EXPECT_EQ(readings.modules()[0].num_docked, 0);
  EXPECT_EQ(readings.modules()[1].num_docked, 0);
  ASSERT_EQ(readings.modules()[2].num_docked, 1);
  EXPECT_EQ(readings.modules()[2].docked[0].mate_module, 3);
}

/// A robot that has one reading spoiled.
class SpoiltRobot : public FakeRobot {
 public:
  explicit SpoiltRobot(std::function<void(std::vector<morphbus::module_sensors_t>*)> spoil)
      : FakeRobot(3), spoil_(std::move(spoil)) {}
  void Sense(std::vector<morphbus::module_sensors_t>* out) override {
    FakeRobot::Sense(out);
    spoil_(out);
  }

 private:
  std::function<void(std::vector<morphbus::module_sensors_t>*)> spoil_;
};

TEST(RobotReadings, WhatNobodyCouldUseIsNamed) {
  const auto why = [](const std::function<void(std::vector<morphbus::module_sensors_t>*)>& spoil) {
    SpoiltRobot robot(spoil);
    return ReadingsOf(&robot).WhyUnusable(3);
  };
  EXPECT_EQ(why([](auto*) {}), "");
  EXPECT_EQ(why([](auto* readings) { readings->pop_back(); }),
            "the simulator senses 2 modules instead of 3");
  EXPECT_EQ(why([](auto* readings) { (*readings)[1].joint_position_si[0] = std::nan(""); }),
            "the simulation became unstable: m2 has joints that are nowhere");
  EXPECT_EQ(why([](auto* readings) {
              (*readings)[2].joint_effort_si[1] = std::numeric_limits<float>::infinity();
            }),
            "the simulation became unstable: m3 exerts more than can be measured");
  EXPECT_EQ(why([](auto* readings) { (*readings)[0].num_docked = vm::kMaxNeighbours + 1; }),
            "m1 has more than " + std::to_string(vm::kMaxNeighbours) +
                " mated connectors, the most a module can handle");
}

/// Notes the targets of its commands.
class MovedRobot : public FakeRobot {
 public:
  explicit MovedRobot(std::vector<double>* targets) : FakeRobot(3), targets_(targets) {}
  void Actuate(const morphbus::actuator_t& command) override {
    targets_->push_back(command.joints[0].target_si);
  }

 private:
  std::vector<double>* targets_;
};

TEST(TickCommands, TheFirstOneOfATickCountsAndTheyMoveTheRobotInOrder) {
  TickCommands commands(3);
  const auto keep = [&](int16_t module, double target, int64_t program) {
    morphbus::actuator_t command;
    command.header.program_hash = program;
    command.module_id = module;
    command.joints.resize(2);
    command.joints[0].target_si = command.joints[1].target_si = target;
    return commands.Keep(static_cast<size_t>(module), &command);
  };
  EXPECT_EQ(commands.program_of(2), 0u);
  EXPECT_TRUE(keep(2, 0.25, 77));
  EXPECT_TRUE(keep(0, 0.5, 78));
  EXPECT_FALSE(keep(2, 0.75, 79));
  std::vector<double> moved;
  MovedRobot robot(&moved);
  std::vector<size_t> missing;
  commands.Actuate(&robot, [&](size_t module) { missing.push_back(module); });
  EXPECT_EQ(moved, (std::vector<double>{0.5, 0.25}));
  EXPECT_EQ(missing, std::vector<size_t>{1});
  EXPECT_EQ(commands.program_of(2), 77u) << "as it was heard of last";
  EXPECT_TRUE(keep(2, 1, 80)) << "the next tick has none";
}

/// A publisher whose messages are heard.
class TickPublisherTest : public ::testing::Test {
 protected:
  TickPublisherTest() {
    for (int i = 0; i < kModules; ++i) {
      const std::string name = "m" + std::to_string(i + 1);
      modules_.push_back({name, static_cast<uint16_t>(i), "FAKE", 0, 2});
    }
    publisher_ = std::make_unique<TickPublisher>(&outbox_, modules_, 20000);
    ear_->SubscribePrefix("test/", [this](std::string_view channel, const uint8_t* data, size_t n) {
      heard_[std::string(channel)].emplace_back(data, data + n);
    });
    readings_.Sense(&robot_, nullptr);
  }

  /// The messages on one of the simulator's channels since it was asked last, decoded.
  template <class M>
  std::vector<M> Heard(const std::string& topic) {
    hub_.HandleAll();
    std::vector<M> messages;
    for (const std::vector<uint8_t>& bytes : std::exchange(heard_["test/SIM/" + topic], {})) {
      EXPECT_TRUE(Decode(bytes.data(), bytes.size(), {}, &messages.emplace_back()));
    }
    return messages;
  }
  void PublishReadings(int64_t tick) {
    publisher_->PublishReadings(tick, readings_, [](const auto&, morphbus::sensors_t* part) {
      part->num_requests = part->num_inspected = part->num_pieces = 0;
    });
  }

  static constexpr int kModules = 60;
  InprocHub hub_;
  std::unique_ptr<Bus> mouth_ = hub_.Connect(), ear_ = hub_.Connect();
  Ledger ledger_;
  Outbox outbox_ = Outbox(mouth_.get(), {"test", "SIM", kFakeModel, 0}, &ledger_);
  std::vector<ExpectedModule> modules_;
  std::unique_ptr<TickPublisher> publisher_;
  FakeRobot robot_ = FakeRobot(kModules);
  RobotReadings readings_;
  std::map<std::string, std::vector<std::vector<uint8_t>>> heard_;
};

TEST_F(TickPublisherTest, ClockTellsHowManyPartsFollowAndTheyHoldAll) {
  publisher_->PublishClock(0, false, readings_);
  PublishReadings(0);
  const auto clocks = Heard<morphbus::sim_clock_t>("CLOCK");
  ASSERT_EQ(clocks.size(), 1u);
  EXPECT_EQ(clocks[0].phase, morphbus::sim_clock_t::PHASE_START);
  EXPECT_EQ(clocks[0].num_modules, kModules);
  const auto sensors = Heard<morphbus::sensors_t>("SENSORS");
  EXPECT_GT(sensors.size(), 1u);
  EXPECT_EQ(sensors.size(), static_cast<size_t>(clocks[0].num_sensors_parts));
  int modules = 0;
  for (const morphbus::sensors_t& part : sensors) modules += part.num_modules;
  EXPECT_EQ(modules, kModules);
  const auto worlds = Heard<morphbus::world_t>("WORLD");
  EXPECT_EQ(worlds.size(), static_cast<size_t>(clocks[0].num_world_parts));
  int bodies = 0;
  for (const morphbus::world_t& part : worlds) bodies += part.num_bodies;
  EXPECT_EQ(bodies, kModules);
}

TEST_F(TickPublisherTest, FiveAnnouncementsFitIntoAClockAndTheFirstHasNone) {
  for (int i = 0; i < 7; ++i) publisher_->Announce("control " + std::to_string(i));
  std::vector<size_t> carried;
  for (int64_t tick = 0; tick < 3; ++tick) publisher_->PublishClock(tick, tick > 0, readings_);
  publisher_->PublishEnd(3, "finished");
  for (const auto& clock : Heard<morphbus::sim_clock_t>("CLOCK")) {
    carried.push_back(clock.controls.size());
    EXPECT_EQ(clock.end_reason, clock.header.tick == 3 ? "finished" : "");
  }
  EXPECT_EQ(carried, (std::vector<size_t>{0, 5, 2, 0}));
  // END has a number of its own, the last one.
  publisher_->RepeatEnd();
  const auto repeated = Heard<morphbus::sim_clock_t>("CLOCK");
  ASSERT_EQ(repeated.size(), 1u);
  EXPECT_EQ(repeated[0].phase, morphbus::sim_clock_t::PHASE_END);
}

TEST_F(TickPublisherTest, OnlyPartsOfModulesThatLackThemAreRepeatedButTheFirstTickAndAfterAWhile) {
  for (int64_t tick = 0; tick < 2; ++tick) {
    publisher_->PublishClock(tick, tick > 0, readings_);
    PublishReadings(tick);
  }
  const size_t parts = Heard<morphbus::sensors_t>("SENSORS").size() / 2;
  const auto repeat = [&](int64_t tick) {
    publisher_->RepeatSensors(tick, [](size_t module) { return module == 0; });
    return Heard<morphbus::sensors_t>("SENSORS");
  };
  EXPECT_EQ(repeat(0).size(), parts) << "they name all modules";
  for (int i = 0; i < 4; ++i) {
    const auto repeated = repeat(1);
    ASSERT_EQ(repeated.size(), 1u);
    EXPECT_EQ(repeated[0].modules[0].name, "m1");
  }
  EXPECT_EQ(repeat(1).size(), parts) << "one that has begun anew does not know the names";
}

TEST_F(TickPublisherTest, TheRootGetsItsPoseWithItsOwnReading) {
  morphbus::root_pose_t pose = {};
  pose.module_id = kModules - 1;
  pose.pose.orientation_wxyz[0] = 1;
  readings_.Sense(&robot_, [&] { return pose; });
  publisher_->PublishClock(0, false, readings_);
  PublishReadings(0);
  const auto sensors = Heard<morphbus::sensors_t>("SENSORS");
  for (const morphbus::sensors_t& part : sensors) {
    EXPECT_EQ(part.root_poses.size(), part.modules.back().name == "m60" ? 1u : 0u);
  }
}

}  // namespace
}  // namespace morphbus::bridge
