// What keeps the spy's memory bounded, and its counts right, whatever is sent.

#include <gtest/gtest.h>

#include <string>

#include "tools/spy/field_history.h"
#include "tools/spy/heard_names.h"
#include "tools/spy/spy_table.h"

namespace morphbus::tools {
namespace {

constexpr int64_t kOneSecond = 1'000'000'000;

TEST(HeardNamesTest, AFloodOfNamesKeepsOutNothingThatIsThereToStay) {
  HeardNames<int> names(100);
  int64_t now = kOneSecond;
  for (int i = 0; i < 50; ++i) {
    for (int n = 0; n < 3; ++n) ASSERT_NE(names.Take("real" + std::to_string(i), now), nullptr);
  }
  for (int i = 0; i < 10'000; ++i) names.Take("flood" + std::to_string(i), now);
  EXPECT_EQ(names.size(), 100u);
  EXPECT_GT(names.refused(), 9000);
  for (int i = 0; i < 50; ++i) EXPECT_NE(names.Find("real" + std::to_string(i)), nullptr) << i;
  // A new one finds a place once what was heard but once has been silent for ten seconds.
  EXPECT_EQ(names.Take("late", now + 9 * kOneSecond), nullptr);
  EXPECT_NE(names.Take("late", now + 10 * kOneSecond), nullptr);
  EXPECT_EQ(names.size(), 100u);
  EXPECT_EQ(names.dropped(), 1);
}

TEST(HeardNamesTest, WhatWasHeardOftenGoesAfterAMinute) {
  HeardNames<int> names(10);
  for (int i = 0; i < 10; ++i) {
    for (int n = 0; n < 5; ++n) names.Take("old" + std::to_string(i), kOneSecond);
  }
  EXPECT_EQ(names.Take("new", 50 * kOneSecond), nullptr);
  EXPECT_NE(names.Take("new", 62 * kOneSecond), nullptr);
  EXPECT_EQ(names.size(), 1u);
}

TEST(SpyBoundsTest, InventedChannelsAreCountedAndNotKept) {
  SpyTable table(*LcmSchema::Parse(""));
  const std::vector<uint8_t> payload(1000, 0xAB);
  for (int i = 0; i < 20'000; ++i) {
    const std::string name = "run/m" + std::to_string(i) + (i % 2 == 0 ? "/STATUS" : "/FORGED");
    table.Take(name, payload.data(), payload.size(), kOneSecond);
  }
  const SpySnapshot spy = table.Snapshot(2 * kOneSecond);
  EXPECT_EQ(spy.channels.size(), ChannelTable::kMostChannels);
  EXPECT_EQ(spy.untold_messages, 20'000 - static_cast<int64_t>(ChannelTable::kMostChannels));
  EXPECT_TRUE(spy.processes.empty());
}

TEST(SpyBoundsTest, LastMessagesAreKeptWithinBoundsAndThatOfTheWatchedChannelAlways) {
  SpyTable table(*LcmSchema::Parse(""));
  const std::vector<uint8_t> payload(size_t{1} << 20, 0);
  for (int i = 0; i < 100; ++i) {
    table.Take("c" + std::to_string(i), payload.data(), payload.size(), kOneSecond);
  }
  // The first ones have their places; for the others there was none.
  EXPECT_NE(table.LastOf("c0").error().message, table.LastOf("c99").error().message);
  EXPECT_EQ(table.LastOf("c99").error().message, "too long to be kept beside all others");
  table.Watch("c99");
  table.Take("c99", payload.data(), payload.size(), kOneSecond);
  EXPECT_EQ(table.LastOf("c99").error().message, table.LastOf("c0").error().message);
}

TEST(FieldHistoryTest, FieldsHaveTheirPathsAndHistories) {
  FieldHistory history;
  for (int i = 0; i < 5; ++i) {
    history.Take(FieldsOf({{"n", i},
                           {"pose", {{"p", {0.5 * i, 1.0}}}},
                           {"name", "a"},
                           {"on", true},
                           {"none", Json::array()}}));
  }
  const std::vector<FieldRow>& fields = history.fields();
  ASSERT_EQ(fields.size(), 6u);
  EXPECT_EQ(fields[1].path, "pose.p[0]");
  EXPECT_EQ(fields[1].value, "2");
  EXPECT_EQ(fields[1].history, (std::vector<double>{0, 0.5, 1, 1.5, 2}));
  EXPECT_EQ(fields[3].value, "\"a\"");
  EXPECT_TRUE(fields[3].history.empty());
  EXPECT_EQ(fields[4].history.size(), 5u);
  EXPECT_EQ(fields[5].value, "[]");
}

TEST(FieldHistoryTest, AFieldThatIsGoneForgetsItsHistory) {
  FieldHistory history;
  history.Take(FieldsOf({{"a", 1}}));
  history.Take(FieldsOf({{"b", 1}}));
  history.Take(FieldsOf({{"a", 2}}));
  EXPECT_EQ(history.fields()[0].history.size(), 1u);
}

TEST(FieldHistoryTest, AMessageOfVeryManyFieldsIsCut) {
  FieldHistory history;
  Json many = Json::array();
  for (int i = 0; i < 50'000; ++i) many.push_back(i);
  for (int i = 0; i < 300; i += 299) history.Take(FieldsOf({{"many", many}}));
  EXPECT_EQ(history.fields().size(), MessageFields::kMost);
  EXPECT_EQ(history.more(), 50'000 - static_cast<int64_t>(MessageFields::kMost));
  EXPECT_TRUE(history.fields()[FieldHistory::kMostHistories].history.empty());
}

TEST(FieldHistoryTest, TheHeaderOfOurMessagesComesLast) {
  FieldHistory history;
  history.Take(FieldsOf({{"header", {{"crc32", 1}, {"tick", 2}}}, {"value", 3}}));
  EXPECT_EQ(history.fields()[0].path, "value");
  EXPECT_EQ(history.fields()[2].path, "header.tick");
}

}  // namespace
}  // namespace morphbus::tools
