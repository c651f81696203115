// The events of a log in the order of ticks, however the file has them.

#include "logger/log/ordered_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "bridge/observe/run_message.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using test::SyntheticEvent;

/// What there is to know of an event here.
std::vector<std::string> Read(OrderedLogReader* reader, size_t most = 1'000'000) {
  std::vector<std::string> texts;
  LogEvent event;
  while (texts.size() < most && reader->Next(&event)) {
    texts.push_back(std::string(event.channel) + std::string(event.data.begin(), event.data.end()));
  }
  return texts;
}
std::vector<std::string> ReadAll(const std::string& path, const std::string& run) {
  return Read(OrderedLogReader::Open(path, run)->get());
}

/// A run's messages of ticks, in the recorder's order.
std::vector<SyntheticEvent> InOrder() {
  using Place = std::tuple<int64_t, bridge::Topic, std::string, int64_t>;
  std::map<Place, SyntheticEvent> events;
  test::SyntheticOptions options;
  options.ticks = 40;
  for (const SyntheticEvent& event : test::SyntheticEvents(options)) {
    const auto message =
        bridge::OpenMessage(event.channel, event.payload.data(), event.payload.size());
    if (!message || !bridge::IsHashed(message->name.topic)) continue;
    events[{message->header.tick, message->name.topic, event.channel, message->header.sequence}] =
        event;
  }
  std::vector<SyntheticEvent> in_order;
  for (const auto& [place, event] : events) in_order.push_back(event);
  return in_order;
}

/// The same as they come where messages overtake each other, by less than `most` places.
std::vector<SyntheticEvent> Shuffled(const std::vector<SyntheticEvent>& events, double most) {
  std::mt19937 random(5);
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = 0; i < events.size(); ++i) {
    order.emplace_back(static_cast<double>(i) + most * static_cast<double>(random() % 1000) / 1000,
                       i);
  }
  std::sort(order.begin(), order.end());
  std::vector<SyntheticEvent> shuffled;
  for (const auto& [place, i] : order) shuffled.push_back(events[i]);
  return shuffled;
}

TEST(OrderedLogTest, AFileInOrderIsReadAsItStands) {
  const TempLog file;
  auto ordered = OrderedLogReader::Open(file.path(), "synth");
  EXPECT_EQ((*ordered)->disorder(), 0);
  EXPECT_EQ(Read(ordered->get()), ReadAll(file.path(), ""));
}

TEST(OrderedLogTest, WhatStandsTooLateComesWhereItBelongs) {
  const std::vector<SyntheticEvent> events = InOrder();
  const TempLog straight(test::EncodeLog(events));
  const TempLog shuffled(test::EncodeLog(Shuffled(events, 50)));
  const std::vector<std::string> expected = ReadAll(straight.path(), "");
  EXPECT_NE(ReadAll(shuffled.path(), ""), expected);
  EXPECT_EQ(ReadAll(shuffled.path(), "synth"), expected);
  // To another run its ticks mean nothing.
  EXPECT_EQ(ReadAll(shuffled.path(), "other"), ReadAll(shuffled.path(), ""));
}

TEST(OrderedLogTest, ARunThatBeginsAnewFollowsTheOneBefore) {
  std::vector<SyntheticEvent> events;
  test::SyntheticOptions options;
  options.ticks = 300;
  for (int i = 0; i < 2; ++i) {
    const std::vector<SyntheticEvent> run = test::SyntheticEvents(options);
    events.insert(events.end(), run.begin(), run.end());
  }
  const TempLog file(test::EncodeLog(Shuffled(events, 10)));
  auto ordered = OrderedLogReader::Open(file.path(), "synth");
  EXPECT_LT((*ordered)->disorder(), 10);
  EXPECT_EQ(Read(ordered->get()).size(), events.size());
}

TEST(OrderedLogTest, FromAPositionOnAllIsReadThatWasNotHandedOut) {
  const TempLog file(test::EncodeLog(Shuffled(InOrder(), 50)));
  const std::vector<std::string> all = ReadAll(file.path(), "synth");
  auto reader = OrderedLogReader::Open(file.path(), "synth");
  const size_t half = all.size() / 2;
  Read(reader->get(), half);
  (*reader)->Seek((*reader)->position());
  const std::vector<std::string> rest = Read(reader->get());
  for (size_t i = half; i < all.size(); ++i) {
    EXPECT_NE(std::find(rest.begin(), rest.end(), all[i]), rest.end()) << i;
  }
}

}  // namespace
}  // namespace morphbus::logger
