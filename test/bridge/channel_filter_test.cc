#include "bridge/bus/channel_filter.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace morphbus::bridge {
namespace {

// A reference interpreter of the few BPF instructions the filter uses.
bool Passes(const std::vector<sock_filter>& program, const std::vector<uint8_t>& packet) {
  uint32_t a = 0;
  for (size_t pc = 0; pc < program.size(); ++pc) {
    const sock_filter& f = program[pc];
    if (BPF_CLASS(f.code) == BPF_RET) return f.k != 0;
    if (BPF_CLASS(f.code) == BPF_LD) {
      const size_t bytes = BPF_SIZE(f.code) == BPF_W ? 4 : (BPF_SIZE(f.code) == BPF_H ? 2 : 1);
      if (f.k + bytes > packet.size()) return false;
      a = 0;
      for (size_t i = 0; i < bytes; ++i) a = a << 8 | packet[f.k + i];
    } else {
      pc += a == f.k ? f.jt : f.jf;
    }
  }
  ADD_FAILURE() << "the program runs off its end";
  return false;
}

std::vector<uint8_t> Packet(const std::string& magic, const std::string& channel, size_t payload) {
  std::vector<uint8_t> packet(8, 0);
  packet.insert(packet.end(), magic.begin(), magic.end());
  packet.insert(packet.end(), 4, 0);
  packet.insert(packet.end(), channel.begin(), channel.end());
  packet.push_back(0);
  packet.insert(packet.end(), payload, 0x55);
  return packet;
}

TEST(ChannelFilter, PassesExactlyTheChannels) {
  const std::vector<std::string> wanted = {"run/SIM/CLOCK", "run/SIM/SENSORS", "run/m1/ASK",
                                           "run/m12/TRANSFORM", "x"};
  std::vector<ChannelInterest> interests;
  for (const std::string& channel : wanted) interests.push_back({channel, {}});
  const auto program = BuildChannelFilter(interests);
  for (const size_t payload : {size_t{0}, size_t{1}, size_t{60}}) {
    for (const std::string& channel : wanted) {
      EXPECT_TRUE(Passes(program, Packet("LC02", channel, payload))) << channel << " " << payload;
    }
    for (const char* other : {"run/SIM/CLOC", "run/SIM/CLOCKS", "run/m1/TRANSFORM", "run/m2/ASK",
                              "", "y", "run/m12/TRANSFORMX", "walk/SIM/CLOCK"}) {
      EXPECT_FALSE(Passes(program, Packet("LC02", other, payload))) << other;
    }
  }
  EXPECT_FALSE(Passes(program, Packet("LC03", "run/m1/ASK", 0))) << "fragments";
  EXPECT_FALSE(Passes(program, Packet("HTTP", "x", 0)));
  EXPECT_FALSE(Passes(program, {1, 2, 3}));
}

TEST(ChannelFilter, PassesWhatBeginsAndEndsLikeThePattern) {
  const auto program = BuildChannelFilter({{"run/m1/ASK", {}}}, {"run/", "/TRANSFORM"});
  for (const size_t payload : {size_t{0}, size_t{300}}) {
    for (const char* channel : {"run/m1/ASK", "run/m1/TRANSFORM", "run/a/TRANSFORM",
                                "run/front_left_upper_half_of_9/TRANSFORM"}) {
      EXPECT_TRUE(Passes(program, Packet("LC02", channel, payload))) << channel;
    }
    for (const char* other : {"run/m1/ACTUATOR", "run/SIM/SENSORS", "walk/m1/TRANSFORM",
                              "run/TRANSFORM", "run/m1/", "ru"}) {
      EXPECT_FALSE(Passes(program, Packet("LC02", other, payload))) << other;
    }
  }
}

TEST(ChannelFilter, PassesOnlyMessagesWhoseNumberIsOfInterest) {
  // One channel by a number of two bytes at 4, one without a number at 1, one whole.
  const Interest part{true, 2, 4, 0x0102, false};
  const Interest not_running{true, 1, 1, 7, true};
  const auto program =
      BuildChannelFilter({{"r/PARTS", part}, {"r/CLOCK", not_running}, {"r/X", {}}});
  const auto passes = [&](const std::string& channel, std::vector<uint8_t> payload) {
    std::vector<uint8_t> packet = Packet("LC02", channel, 0);
    packet.insert(packet.end(), payload.begin(), payload.end());
    return Passes(program, packet);
  };
  EXPECT_TRUE(passes("r/PARTS", {0, 0, 0, 0, 1, 2, 9}));
  EXPECT_FALSE(passes("r/PARTS", {0, 0, 0, 0, 1, 3, 9}));
  EXPECT_FALSE(passes("r/PARTS", {0, 0, 0, 0, 2, 2, 9}));
  EXPECT_FALSE(passes("r/PARTS", {0, 0, 0, 0, 1})) << "too short for its number";
  EXPECT_TRUE(passes("r/CLOCK", {7, 6}));
  EXPECT_FALSE(passes("r/CLOCK", {6, 7}));
  EXPECT_FALSE(passes("r/CLOCK", {6}));
  EXPECT_TRUE(passes("r/X", {}));
  EXPECT_FALSE(passes("r/Y", {0, 0, 0, 0, 1, 2}));
}

TEST(ChannelFilter, TooManyChannelsMeanNoFilter) {
  std::vector<ChannelInterest> channels;
  for (int i = 0; i < 1000; ++i) channels.push_back({std::string(50, 'a') + std::to_string(i), {}});
  EXPECT_TRUE(BuildChannelFilter(channels).empty());
  channels.resize(60);
  EXPECT_FALSE(BuildChannelFilter(channels).empty());
}

}  // namespace
}  // namespace morphbus::bridge
