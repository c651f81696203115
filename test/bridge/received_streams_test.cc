// What the logger knows of the channels that count for the run's hash.

#include "bridge/lockstep/log/received_streams.h"

#include <gtest/gtest.h>

namespace morphbus::bridge {
namespace {

/// What a process says that it has published on a topic.
morphbus::topic_total_t Published(const std::string& topic, int64_t count, uint64_t hash) {
  morphbus::topic_total_t total;
  total.topic = topic;
  total.count = count;
  total.chained_hash = static_cast<int64_t>(hash);
  return total;
}

TEST(ReceivedStreams, InLockstepAPayloadBeyondAGapWaitsForItsTurn) {
  ReceivedStreams streams;
  ReceivedStream& late = streams.Begin("test/m1/ACTUATOR", 0, 32);
  ReceivedStream& punctual = streams.Begin("test/m2/ACTUATOR", 1, 32);
  for (const int64_t number : {0, 2, 3, 1, 4}) late.Add(number, 100 + number, true);
  for (int64_t number = 0; number < 5; ++number) punctual.Add(number, 100 + number, true);
  EXPECT_EQ(late.hash.Digest(), punctual.hash.Digest());
  EXPECT_EQ(late.count, 5);
  EXPECT_FALSE(late.gapless);
  EXPECT_TRUE(punctual.gapless);
  EXPECT_TRUE(late.early.empty());
}

TEST(ReceivedStreams, AreFoundByNameInWhateverOrderTheyCome) {
  ReceivedStreams streams;
  EXPECT_EQ(streams.Find("test/m1/ACTUATOR"), nullptr);
  for (const char* name : {"test/m2/STATUS", "test/m1/ACTUATOR", "test/SIM/CLOCK"}) {
    streams.Begin(name, -1, 32);
  }
  for (const char* name : {"test/SIM/CLOCK", "test/m1/ACTUATOR", "test/SIM/CLOCK", "test/m2/STATUS",
                           "test/SIM/CLOCK", "test/m1/ACTUATOR"}) {
    ASSERT_NE(streams.Find(name), nullptr) << name;
    EXPECT_EQ(streams.Find(name)->channel, name);
  }
  EXPECT_EQ(streams.Find("test/m1/ACTUATOR")->index, 1) << "in the order of their beginnings";
  EXPECT_EQ(streams.Find("test/m1/ACTUATOR")->name.process, "m1");
  std::vector<std::string> names;
  for (const ChannelTotal& total : streams.totals()) names.push_back(total.channel);
  EXPECT_EQ(names,
            (std::vector<std::string>{"test/SIM/CLOCK", "test/m1/ACTUATOR", "test/m2/STATUS"}));
}

TEST(ReceivedStreams, OnlyWhatIsThereAsAWholeIsCompared) {
  ReceivedStreams streams;
  ReceivedStream& stream = streams.Begin("test/m1/ACTUATOR", 0, 32);
  stream.Add(0, 100, true);
  stream.Add(1, 101, true);
  const uint64_t hash = stream.hash.Digest();
  const auto difference = [&](const morphbus::topic_total_t& total, bool realtime) {
    return streams.FirstDifference("test/m1/", {Published("STATUS", 3, 5), total}, realtime);
  };
  EXPECT_EQ(difference(Published("ACTUATOR", 2, hash), false), "");
  EXPECT_EQ(difference(Published("ACTUATOR", 2, hash + 1), false), "ACTUATOR");
  EXPECT_EQ(difference(Published("ACTUATOR", 3, hash + 1), false), "") << "the third is under way";
  // Beyond a gap the hash must wait; in real time it is another one for good.
  stream.Add(3, 103, true);
  EXPECT_EQ(difference(Published("ACTUATOR", 3, 9), false), "");
  ReceivedStream& lossy = streams.Begin("test/m1/TRANSFORM", 0, 32);
  lossy.Add(1, 101, false);
  EXPECT_EQ(difference(Published("TRANSFORM", 1, 9), true), "");
  EXPECT_EQ(difference(Published("TRANSFORM", 1, 9), false), "TRANSFORM");
}

}  // namespace
}  // namespace morphbus::bridge
