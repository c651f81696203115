#include "tools/spy/spy_table.h"

#include <gtest/gtest.h>

#include <morphbus/actuator_t.hpp>
#include <morphbus/status_t.hpp>

#include "bridge/wire/codec.h"
#include "tools/spy/lcm_sources.h"
#include "vm/image/fault.h"

namespace morphbus::tools {
namespace {

class SpyTableTest : public ::testing::Test {
 protected:
  template <class M>
  void Take(const std::string& channel, int64_t sequence, double now_s, M message = {}) {
    message.header.protocol = morphbus::header_t::PROTOCOL;
    message.header.sequence = sequence;
    std::vector<uint8_t> bytes;
    bridge::Encode(message, &bytes);
    table_.Take(channel, bytes.data(), bytes.size(), now_s);
  }
  static ChannelFilter Only(const std::string& name) {
    return [name](const std::string& channel) { return channel == name; };
  }
  Json Row(const std::string& channel, const std::string& selected = "") {
    const Json json = table_.ToJson(Only(selected));
    for (const Json& row : json["channels"]) {
      if (row["channel"] == channel) return row;
    }
    return nullptr;
  }

  SpyTable table_{*LcmSchema::Parse(LcmSources())};
};

TEST_F(SpyTableTest, RatesAreThoseOfTheInterval) {
  for (int i = 0; i < 50; ++i) Take<morphbus::actuator_t>("r/m1/ACTUATOR", i, i * 0.02);
  table_.Roll(1.0);
  EXPECT_DOUBLE_EQ(Row("r/m1/ACTUATOR")["hz"], 50.0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["type"], "morphbus.actuator_t");
  table_.Roll(2.0);
  EXPECT_DOUBLE_EQ(Row("r/m1/ACTUATOR")["hz"], 0.0);
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
  EXPECT_EQ(table_.ToJson(Only(""))["modules"]["m5"]["role"], "Junction");
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
  table_.Take("r/m1/ACTUATOR", junk, sizeof junk, 0.0);
  table_.Take("EXAMPLE", junk, sizeof junk, 0.0);
  EXPECT_EQ(Row("r/m1/ACTUATOR")["bad"], 1);
  EXPECT_EQ(Row("EXAMPLE")["bad"], 0);
  EXPECT_TRUE(Row("EXAMPLE")["type"].is_null());
}

TEST_F(SpyTableTest, TheTextFitsTheTerminal) {
  for (int i = 0; i < 100; ++i)
    Take<morphbus::actuator_t>("r/m" + std::to_string(i) + "/ACTUATOR", 0, 0.0);
  const std::string text = SpyText(table_.ToJson(Only("")), "", 40, 10);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
  EXPECT_LE(text.find('\n'), 40u);
}

TEST_F(SpyTableTest, ALowTerminalShowsChannelsRolesAndFields) {
  for (int m = 1; m <= 20; ++m) {
    const std::string module = "r/m" + std::to_string(m);
    for (const char* topic : {"/SENSORS", "/TRANSFORM", "/HEALTH"}) {
      Take<morphbus::actuator_t>(module + topic, 0, 0.0);
    }
    morphbus::status_t status = {};
    status.role_name = "Leg";
    status.type_name = "MTRAN";
    Take(module + "/STATUS", 0, 0.0, status);
  }
  const std::string text = SpyText(table_.ToJson(Only("r/m7/STATUS")), "r/m7/STATUS", 100, 23);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 23) << text;
  for (const char* part :
       {"channel  ", "r/m1/HEALTH", "m1       Leg", "r/m7/STATUS:", "\"header\""}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
  // 81 lines of channels, 20 of roles: what is left out is counted.
  EXPECT_NE(text.find("more (a taller terminal shows them)"), std::string::npos) << text;
}

TEST_F(SpyTableTest, APatternThatNothingMatchesIsSaid) {
  EXPECT_NE(SpyText(table_.ToJson(Only("")), "r/.*", 80, 24).find("r/.*: nothing heard"),
            std::string::npos);
}

TEST_F(SpyTableTest, ControlCharactersDoNotReachTheTerminal) {
  morphbus::status_t status = {};
  status.role_name = "\x1b[2J";
  status.type_name = "\u009b2J";
  Take("r/m1/STATUS", 0, 0.0, status);
  const uint8_t junk[] = {1};
  table_.Take("a\x1b]0;title\x07", junk, sizeof junk, 0.0);
  const std::string text = SpyText(table_.ToJson(Only("r/m1/STATUS")), "r/m1/STATUS", 0, 0);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\x07'), std::string::npos);
  EXPECT_EQ(text.find("\u009b"), std::string::npos);
  EXPECT_NE(text.find("\\x1b[2J"), std::string::npos) << text;
}

}  // namespace
}  // namespace morphbus::tools
