#include "tools/spy/spy_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <morphbus/actuator_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>

#include "bridge/wire/codec.h"
#include "tools/spy/lcm_sources.h"
#include "tools/spy/spy_pages.h"
#include "tools/spy/spy_text.h"
#include "vm/image/fault.h"

namespace morphbus::tools {
namespace {

class SpyTableTest : public ::testing::Test {
 protected:
  template <class M>
  void Take(const std::string& channel, int64_t sequence, double now_s, M message = {},
            const bridge::RunKey& key = {}) {
    message.header.protocol = morphbus::header_t::PROTOCOL;
    message.header.sequence = sequence;
    std::vector<uint8_t> bytes;
    bridge::Encode(message, &bytes);
    key.Seal(channel, bytes.data(), bytes.size());
    table_.Take(channel, bytes.data(), bytes.size(), At(now_s));
    now_s_ = std::max(now_s_, now_s);
  }
  /// A second of the test on the clock of arrivals.
  static int64_t At(double seconds) { return static_cast<int64_t>(seconds * 1e9) + 1'000'000'000; }
  Json Look(const ChannelFilter& selected = [](const std::string&) { return false; }) {
    return SpyJson(table_, table_.Snapshot(At(now_s_)), selected);
  }
  static ChannelFilter Only(const std::string& name) {
    return [name](const std::string& channel) { return channel == name; };
  }
  Json Row(const std::string& channel, const std::string& selected = "") {
    const Json json = Look(Only(selected));
    for (const Json& row : json["channels"]) {
      if (row["channel"] == channel) return row;
    }
    return nullptr;
  }

  SpyTable table_{*LcmSchema::Parse(LcmSources())};
  double now_s_ = 0.0;  ///< When the figures are looked at.
};

TEST_F(SpyTableTest, WhatHasNotTheKeyOfAKnownRunIsMarked) {
  table_.KnowKey("r", bridge::RunKey(bridge::RunKey::Bytes{1}));
  Take<morphbus::actuator_t>("r/m1/ACTUATOR", 0, 0);
  Take<morphbus::actuator_t>("other/m1/ACTUATOR", 0, 0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["unauthentic"], 1);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["bad"], 1);
  EXPECT_EQ(Row("other/m1/ACTUATOR")["bad"], 0) << "of other runs nobody knows";
}

TEST_F(SpyTableTest, AKeyIsThatOfTheRunWhoseMessagesHaveIt) {
  const bridge::RunKey key(bridge::RunKey::Bytes{1});
  table_.KnowKey("", key);
  Take<morphbus::actuator_t>("r/m1/ACTUATOR", 0, 0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["bad"], 0) << "whose key it is, nobody knows yet";
  Take<morphbus::actuator_t>("r/m2/ACTUATOR", 1, 0, {}, key);
  Take<morphbus::actuator_t>("r/m1/ACTUATOR", 2, 0);
  Take<morphbus::actuator_t>("other/m1/ACTUATOR", 0, 0);
  EXPECT_EQ(Row("r/m2/ACTUATOR")["bad"], 0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["unauthentic"], 1);
  EXPECT_EQ(Row("other/m1/ACTUATOR")["bad"], 0);
}

TEST_F(SpyTableTest, RatesAndJitterAreThoseOfTheArrivals) {
  for (int i = 0; i < 50; ++i) Take<morphbus::actuator_t>("r/m1/ACTUATOR", i, i * 0.02);
  now_s_ = 1.0;
  const Json row = Row("r/m1/ACTUATOR");
  EXPECT_NEAR(row["hz"].get<double>(), 50.0, 1e-3);
  EXPECT_NEAR(row["jitter"]["period_s"].get<double>(), 0.02, 1e-8);
  EXPECT_EQ(row["jitter"]["intervals"], 49);
  EXPECT_EQ(row["type"], "morphbus.actuator_t");
  now_s_ = 3.0;
  EXPECT_EQ(Row("r/m1/ACTUATOR")["hz"], 0.0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["messages"], 50);
}

TEST_F(SpyTableTest, GapsAreLossesUntilTheyAreFilled) {
  for (const int i : {0, 1, 4, 5}) Take<morphbus::actuator_t>("r/m1/ACTUATOR", i, 0.0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["lost"], 2);
  Take<morphbus::actuator_t>("r/m1/ACTUATOR", 2, 0.1);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["lost"], 1);
  Take<morphbus::actuator_t>("r/m1/ACTUATOR", 2, 0.1);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["lost"], 1);
}

TEST_F(SpyTableTest, FaultsOfAStatusHaveTheirSentence) {
  morphbus::status_t status = {};
  morphbus::fault_t fault = {};
  fault.code = static_cast<int16_t>(vm::FaultCode::kStalled);
  fault.function_index = -1;
  fault.ended_task = fault.task_function = -1;
  fault.line = 12;
  fault.joint = 1;
  fault.asked = 36;
  fault.measured = 4;
  fault.limit = 2;
  status.faults = {fault};
  status.num_faults = 1;
  Take("r/m5/STATUS", 0, 0.0, status);
  EXPECT_EQ(
      Row("r/m5/STATUS", "r/m5/STATUS")["last"]["faults"][0]["text"],
      "line 12: joint 1 stalled at 4: 36 was asked for, and within 2 of it counts as arrived");
}

TEST_F(SpyTableTest, RolesComeFromStatus) {
  morphbus::status_t status = {};
  status.role_name = "Junction";
  Take("r/m5/STATUS", 0, 0.0, status);
  EXPECT_EQ(Look()["modules"]["m5"]["role"], "Junction");
}

TEST_F(SpyTableTest, WhatFaultsHaveEndedComesFromTheLastStatus) {
  morphbus::status_t status = {};
  status.ended_behaviors = 2;
  status.startup_ended = true;
  Take("r/m5/STATUS", 0, 0.0, status);
  EXPECT_EQ(Look()["modules"]["m5"]["ended_behaviors"], 2);
  EXPECT_EQ(Look()["modules"]["m5"]["startup_ended"], true);
  // A role that is taken anew begins all of its tasks afresh.
  Take("r/m5/STATUS", 1, 0.1, morphbus::status_t{});
  EXPECT_EQ(Look()["modules"]["m5"]["ended_behaviors"], 0);
  EXPECT_EQ(Look()["modules"]["m5"]["startup_ended"], false);
}

TEST_F(SpyTableTest, WhatAnInspectedModuleHeldIsKeptOnceAllPartsHaveCome) {
  // A field in one part, a call in the next.
  morphbus::status_t status = {};
  morphbus::inspection_t part = {};
  part.num_parts = 2;
  part.fields.push_back({"speed", "float", "2.5"});
  part.num_fields = 1;
  status.inspections = {part};
  status.num_inspections = 1;
  morphbus::status_t second = {};
  part = {};
  part.part = 1;
  part.num_parts = 2;
  morphbus::held_task_t task = {};
  task.routine_name = "Leg.walk";
  morphbus::call_t call = {};
  call.function_name = "Leg.step";
  call.line = 7;
  call.locals.push_back({"angle", "float", "30"});
  call.num_locals = 1;
  task.calls = {call};
  task.num_calls = 1;
  part.tasks = {task};
  part.num_tasks = 1;
  second.inspections = {part};
  second.num_inspections = 1;
  const auto told = [&] { return table_.Snapshot(At(now_s_)).processes.at(0); };
  // A part of another tick belongs to another answer.
  Take("r/m1/STATUS", 0, 0.0, status);
  EXPECT_LT(told().held_us, 0);
  status.header.tick = second.header.tick = 1;
  status.header.sim_time_us = second.header.sim_time_us = 20'000;
  // What was lost and sent again comes later.
  Take("r/m1/STATUS", 2, 0.0, second);
  EXPECT_LT(told().held_us, 0);
  Take("r/m1/STATUS", 1, 0.0, status);
  EXPECT_EQ(told().held_us, 20'000);
  SpyUi ui;
  ui.process = "r/m1";
  const std::string page = PlainText(ProcessLines(table_.Snapshot(At(now_s_)), ui));
  for (const char* line : {"inspected    at 0.02 s", "field speed = 2.5 (float)", "Leg.walk",
                           "  in Leg.step, line 7: angle = 30"}) {
    EXPECT_NE(page.find(line), std::string::npos) << page;
  }
}

TEST_F(SpyTableTest, TheSelectedChannelIsDecoded) {
  morphbus::status_t status = {};
  status.type_name = "MTRAN";
  Take("r/m5/STATUS", 0, 0.0, status);
  EXPECT_EQ(Row("r/m5/STATUS", "r/m5/STATUS")["last"]["type_name"], "MTRAN");
  EXPECT_FALSE(Row("r/m5/STATUS").contains("last"));
}

TEST_F(SpyTableTest, DamagedMessagesAreCountedAndForeignOnesAreNot) {
  const uint8_t junk[] = {1, 2, 3};
  table_.Take("r/m1/ACTUATOR", junk, sizeof junk, At(0));
  table_.Take("EXAMPLE", junk, sizeof junk, At(0));
  EXPECT_EQ(Row("r/m1/ACTUATOR")["bad"], 1);
  EXPECT_EQ(Row("EXAMPLE")["bad"], 0);
  EXPECT_TRUE(Row("EXAMPLE")["type"].is_null());
  // Nobody can decode either of them.
  EXPECT_EQ(Row("r/m1/ACTUATOR")["undecodable"], 1);
  EXPECT_EQ(Row("EXAMPLE")["undecodable"], 1);
}

TEST_F(SpyTableTest, ForeignMessagesAreDecodedByTheirTypesAndCountedIfTheyDoNotFit) {
  std::vector<std::string> warnings;
  SpyTable table(
      *LcmSchema::ParseFiles({{"a.lcm", "package other; struct a_t { int8_t x; }"}}, &warnings));
  const auto fingerprint = static_cast<uint64_t>(
      LcmSchema::Parse("struct a_t { int8_t x; }")->FindByName("a_t")->fingerprint);
  std::vector<uint8_t> bytes(8);
  for (size_t i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(fingerprint >> (56 - 8 * i));
  bytes.push_back(42);
  table.Take("FOREIGN", bytes.data(), bytes.size(), At(0));
  EXPECT_EQ((*table.LastOf("FOREIGN"))["x"], 42);
  bytes.push_back(0);
  table.Take("FOREIGN", bytes.data(), bytes.size(), At(1));
  const ChannelRow row = *table.Snapshot(At(1)).Channel("FOREIGN");
  EXPECT_EQ(row.type, "other.a_t");
  EXPECT_EQ(row.messages, 2);
  EXPECT_EQ(row.bad, 1);
  EXPECT_EQ(row.undecodable, 1);
}

TEST_F(SpyTableTest, AModuleHasPoseAgeFaultsAndTheFiguresOfItsProcess) {
  morphbus::sim_clock_t clock = {};
  clock.tick_us = 20'000;
  clock.header.tick = 100;
  clock.phase = morphbus::sim_clock_t::PHASE_RUN;
  clock.num_modules = 1;
  clock.num_sensors_parts = 1;
  Take("r/SIM/CLOCK", 100, 2.0, clock);
  morphbus::transform_t transform = {};
  transform.header.tick = 100;
  transform.has_pose = 1;
  transform.root_sequence = 97;
  transform.hops = 2;
  transform.body_turns = 1;
  transform.incarnation = transform.root_incarnation = 1;
  Take("r/m1/TRANSFORM", 100, 2.0, transform);
  morphbus::health_t health = {};
  health.process = "m1";
  health.max_rss_kb = 7000;
  health.wall_time_us = 1'000'000;
  health.cpu_us = 500'000;
  Take("r/m1/HEALTH", 0, 2.0, health);
  health.wall_time_us += 1'000'000;
  health.cpu_us += 250'000;
  Take("r/m1/HEALTH", 1, 2.0, health);
  const Json module = Look()["modules"]["m1"];
  EXPECT_NEAR(module["pose_age_s"].get<double>(), 0.06, 1e-12) << module;
  EXPECT_EQ(module["cpu"], 0.25);
  EXPECT_EQ(module["max_rss_kb"], 7000);
}

TEST_F(SpyTableTest, ARepeatedStatusCountsItsFaultsOnce) {
  morphbus::status_t status = {};
  morphbus::fault_t fault = {};
  fault.code = static_cast<int16_t>(vm::FaultCode::kStalled);
  fault.function_index = fault.role = fault.rival_role = fault.keyword = -1;
  fault.ended_task = fault.task_function = -1;
  fault.joint = fault.link = fault.connector = -1;
  status.faults = {fault};
  status.num_faults = 1;
  status.faults_dropped = 2;
  for (int i = 0; i < 3; ++i) Take("r/m5/STATUS", 0, 0.0, status);
  EXPECT_EQ(Look()["modules"]["m5"]["faults"], 3);
}

/// A CLOCK of a run of one module with ticks of 20 ms that is under way, at tick 0.
morphbus::sim_clock_t RunningClock() {
  morphbus::sim_clock_t clock = {};
  clock.tick_us = 20'000;
  clock.phase = morphbus::sim_clock_t::PHASE_RUN;
  clock.num_modules = 1;
  clock.num_sensors_parts = 1;
  return clock;
}

TEST_F(SpyTableTest, ARunHasSpeedAndPauseByItsClock) {
  morphbus::sim_clock_t clock = RunningClock();
  for (int tick = 0; tick <= 100; ++tick) {
    clock.header.tick = tick;
    clock.header.sim_time_us = tick * 20'000;
    if (tick == 100) {
      clock.num_controls = 2;
      clock.controls = {"speed 4", "pause"};
    }
    Take("r/SIM/CLOCK", tick, tick * 0.01, clock);
  }
  const SpySnapshot spy = table_.Snapshot(At(1.0));
  const RunRow& run = *spy.Run("r");
  EXPECT_EQ(run.clock.tick(), 100);
  EXPECT_NEAR(*run.speed, 2.0, 1e-6);
  EXPECT_TRUE(run.clock.paused());
  EXPECT_EQ(run.clock.speed(), 4.0);
  EXPECT_NEAR(*table_.Snapshot(At(3.0)).Run("r")->speed, 0.0, 1e-12);
  clock.controls = {"resume"};
  clock.num_controls = 1;
  clock.header.tick = 101;
  Take("r/SIM/CLOCK", 101, 3.0, clock);
  EXPECT_FALSE(table_.Snapshot(At(3.0)).Run("r")->clock.paused());
}

TEST_F(SpyTableTest, ARunThatIsHeldAtItsBeginningHasTheSpeedZero) {
  morphbus::sim_clock_t clock = RunningClock();
  for (int tick = 0; tick <= 7; ++tick) {
    clock.header.tick = tick;
    clock.header.sim_time_us = tick * 20'000;
    Take("r/SIM/CLOCK", tick, tick * 0.01, clock);
  }
  EXPECT_FALSE(table_.Snapshot(At(0.08)).Run("r")->speed) << "too short to be measured";
  const SpySnapshot held = table_.Snapshot(At(5.0));
  ASSERT_TRUE(held.Run("r")->speed);
  EXPECT_NEAR(*held.Run("r")->speed, 0.0, 1e-12);
}

TEST_F(SpyTableTest, TwoRunsOnOneBusAreToldApart) {
  morphbus::sim_clock_t clock = {};
  clock.tick_us = 20'000;
  clock.num_modules = 1;
  clock.num_sensors_parts = 1;
  morphbus::status_t status = {};
  for (const char* run : {"a", "b"}) {
    Take(std::string(run) + "/SIM/CLOCK", 0, 0.0, clock);
    status.role_name = run;
    Take(std::string(run) + "/m1/STATUS", 0, 0.0, status);
  }
  const Json modules = Look()["modules"];
  EXPECT_EQ(modules["a/m1"]["role"], "a");
  EXPECT_EQ(modules["b/m1"]["role"], "b");
}

TEST_F(SpyTableTest, ThePlainTableHasChannelsModulesAndFields) {
  morphbus::status_t status = {};
  status.role_name = "Junction";
  status.type_name = "MTRAN";
  Take("r/m5/STATUS", 0, 0.0, status);
  const std::string text = SpyText(table_, table_.Snapshot(At(0)), Only("r/m5/STATUS"));
  for (const char* part : {"CHANNEL", "status_t", "Junction", "r/m5/STATUS:", "\"MTRAN\""}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
}

TEST_F(SpyTableTest, ThePlainTableHasTheBytesOfWhatNobodyKnows) {
  const uint8_t foreign[] = {0, 1, 2, 3, 4, 5, 6, 7, 'm', 'o', 'r', 'e'};
  table_.Take("OTHER", foreign, sizeof foreign, At(0));
  const std::string text = SpyText(table_, table_.Snapshot(At(0)), Only("OTHER"));
  EXPECT_NE(text.find("OTHER:\nunknown type, fingerprint 0001020304050607: name its .lcm files by "
                      "--types\n0000  00 01 02 03 04 05 06 07  6d 6f 72 65 "),
            std::string::npos)
      << text;
  EXPECT_NE(text.find(" ........more\n"), std::string::npos) << text;
  // What is damaged, or shorter than a fingerprint, no --types helps to read.
  table_.Take("OTHER", foreign, 3, At(0));
  EXPECT_EQ(table_.LastOf("OTHER").error().message, "shorter than a fingerprint");
}

TEST_F(SpyTableTest, HashesAreInHexadecimalDigits) {
  morphbus::hello_t hello = {};
  hello.process = "m1";
  hello.header.model_hash = 0x0123456789abcdef;
  hello.kinematics_hash = -2;
  hello.claim = -2;
  Take("r/HELLO", 0, 0.0, hello);
  const Json last = Row("r/HELLO", "r/HELLO")["last"];
  EXPECT_EQ(last["header"]["model_hash"], "0123456789abcdef");
  EXPECT_EQ(last["header"]["auth"], "0000000000000000");
  EXPECT_EQ(last["header"]["crc32"].get<std::string>().size(), 8u) << last;
  EXPECT_EQ(last["kinematics_hash"], "fffffffffffffffe");
  EXPECT_EQ(last["claim"], -2) << "a random number is one";
  const std::string text = SpyText(table_, table_.Snapshot(At(0)), Only("r/HELLO"));
  EXPECT_NE(text.find("kinematics_hash     fffffffffffffffe\n"), std::string::npos) << text;
}

TEST_F(SpyTableTest, ControlCharactersDoNotReachTheTerminal) {
  morphbus::status_t status = {};
  status.role_name = "\x1b[2J";
  status.type_name = "\u009b2J";
  Take("r/m1/STATUS", 0, 0.0, status);
  const uint8_t junk[] = {1};
  table_.Take("a\x1b]0;title\x07", junk, sizeof junk, At(0));
  const std::string text = SpyText(table_, table_.Snapshot(At(0)), Only("r/m1/STATUS"));
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\x07'), std::string::npos);
  EXPECT_EQ(text.find("\u009b"), std::string::npos);
  EXPECT_NE(text.find("\\x1b[2J"), std::string::npos) << text;
}

}  // namespace
}  // namespace morphbus::tools
