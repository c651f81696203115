#include "tools/spy_table.h"

#include <gtest/gtest.h>

#include <morphbus/actuator_t.hpp>
#include <morphbus/status_t.hpp>

#include "bridge/codec.h"
#include "tools/lcm_sources.h"

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
  Json Row(const std::string& channel, const std::string& selected = "") {
    const Json json = table_.ToJson(selected);
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

TEST_F(SpyTableTest, RolesComeFromStatus) {
  morphbus::status_t status = {};
  status.role_name = "Junction";
  Take("r/m5/STATUS", 0, 0.0, status);
  EXPECT_EQ(table_.ToJson("")["modules"]["m5"]["role"], "Junction");
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
  const std::string text = SpyText(table_.ToJson(""), "", 40, 10);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
  EXPECT_LE(text.find('\n'), 40u);
}

}  // namespace
}  // namespace morphbus::tools
