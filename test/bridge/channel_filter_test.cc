#include "bridge/bus/channel_filter.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace morphbus::bridge {
namespace {

// The registers of classic BPF.
struct Registers {
  uint32_t a = 0, x = 0, memory = 0;
};

uint32_t Compute(const sock_filter& f, const Registers& r) {
  const uint32_t other = BPF_SRC(f.code) == BPF_X ? r.x : f.k;
  switch (BPF_OP(f.code)) {
    case BPF_XOR:
      return r.a ^ other;
    case BPF_AND:
      return r.a & other;
    case BPF_MUL:
      return r.a * other;
    case BPF_RSH:
      EXPECT_LT(other, 32u);
      return r.a >> other;
    default:
      ADD_FAILURE() << "an operation that the reference does not know";
      return 0;
  }
}

// A reference interpreter of the few BPF instructions the filter uses.
bool Passes(const std::vector<sock_filter>& program, const std::vector<uint8_t>& packet) {
  Registers r;
  for (size_t pc = 0; pc < program.size(); ++pc) {
    const sock_filter& f = program[pc];
    switch (BPF_CLASS(f.code)) {
      case BPF_RET:
        return f.k != 0;
      case BPF_LDX:
        r.x = f.k;
        break;
      case BPF_ST:
        r.memory = r.a;
        break;
      case BPF_MISC:
        BPF_MISCOP(f.code) == BPF_TAX ? r.x = r.a : r.a = r.x;
        break;
      case BPF_ALU:
        r.a = Compute(f, r);
        break;
      case BPF_JMP:
        pc += BPF_OP(f.code) == BPF_JA ? f.k : (r.a == f.k ? f.jt : f.jf);
        break;
      case BPF_LD: {
        if (BPF_MODE(f.code) != BPF_ABS) {
          r.a = BPF_MODE(f.code) == BPF_IMM ? f.k : r.memory;
          break;
        }
        const size_t bytes = BPF_SIZE(f.code) == BPF_W ? 4 : (BPF_SIZE(f.code) == BPF_H ? 2 : 1);
        if (f.k + bytes > packet.size()) return false;
        r.a = 0;
        for (size_t i = 0; i < bytes; ++i) r.a = r.a << 8 | packet[f.k + i];
      }
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
  const std::vector<std::string> wanted = {"run/SIM/CLOCK", "run/SIM/SENSORS", "run/m1/RESEND",
                                           "run/m12/TRANSFORM", "x"};
  std::vector<ChannelInterest> interests;
  for (const std::string& channel : wanted) interests.push_back({channel, {}});
  const auto program = BuildChannelFilter(interests);
  for (const size_t payload : {size_t{0}, size_t{1}, size_t{60}}) {
    for (const std::string& channel : wanted) {
      EXPECT_TRUE(Passes(program, Packet("LC02", channel, payload))) << channel << " " << payload;
    }
    for (const char* other : {"run/SIM/CLOC", "run/SIM/CLOCKS", "run/m1/TRANSFORM", "run/m2/RESEND",
                              "", "y", "run/m12/TRANSFORMX", "walk/SIM/CLOCK"}) {
      EXPECT_FALSE(Passes(program, Packet("LC02", other, payload))) << other;
    }
  }
  EXPECT_FALSE(Passes(program, Packet("LC03", "run/m1/RESEND", 0))) << "fragments";
  EXPECT_FALSE(Passes(program, Packet("HTTP", "x", 0)));
  EXPECT_FALSE(Passes(program, {1, 2, 3}));
}

TEST(ChannelFilter, PassesWhatBeginsAndEndsLikeThePattern) {
  const auto program = BuildChannelFilter({{"run/m1/RESEND", {}}}, {"run/", "/TRANSFORM"});
  for (const size_t payload : {size_t{0}, size_t{300}}) {
    for (const char* channel : {"run/m1/RESEND", "run/m1/TRANSFORM", "run/a/TRANSFORM",
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

// The channels of a process of many modules m0, m1, …, and of the simulator.
std::vector<ChannelInterest> ManyChannels(const std::string& run, int modules,
                                          const std::vector<std::string>& topics) {
  std::vector<ChannelInterest> channels = {{run + "/HELLO", {}}, {run + "/SIM/RESEND", {}}};
  const Interest not_running{true, 1, 1, 7, true};
  channels.push_back({run + "/SIM/CLOCK", not_running});
  for (int i = 0; i < modules; ++i) {
    for (const std::string& topic : topics) {
      channels.push_back({run + "/m" + std::to_string(i) + "/" + topic, {}});
    }
  }
  return channels;
}

TEST(ChannelFilter, ManyNamesTakeNoLargerProgram) {
  // What sockets get before 6.8; the kernel makes of a load some thirteen instructions of its own.
  constexpr size_t kPacketBytes = 20480, kKernelInstruction = 8, kLoad = 14, kOther = 2;
  const auto bytes = [](const std::vector<sock_filter>& program) {
    size_t instructions = 0;
    for (const sock_filter& f : program) {
      const bool load = BPF_CLASS(f.code) == BPF_LD && BPF_MODE(f.code) == BPF_ABS;
      instructions += load ? kLoad : kOther;
    }
    return kKernelInstruction * instructions;
  };
  for (const std::string& run : {std::string("r"), std::string(40, 'r')}) {
    size_t before = 0;
    for (const int modules : {30, 200, 1000, 5000}) {
      const auto program = BuildChannelFilter(ManyChannels(run, modules, {"RESEND", "TRANSFORM"}));
      EXPECT_GT(program.size(), 0u);
      EXPECT_LT(bytes(program), kPacketBytes) << modules;
      if (modules > 1000) {
        EXPECT_LE(program.size(), before + 8) << modules;
      }
      before = program.size();
    }
  }
}

TEST(ChannelFilter, OfManyNamesAllPassAndHardlyAnyOther) {
  // Every tenth module of a thousand.
  constexpr int kModules = 100;
  std::vector<ChannelInterest> channels = ManyChannels("run", 0, {});
  const auto name = [](int module) { return "run/m" + std::to_string(module); };
  for (int i = 0; i < 10 * kModules; i += 10) {
    channels.push_back({name(i) + "/RESEND", {}});
    channels.push_back({name(i) + "/TRANSFORM", {}});
  }
  const auto program = BuildChannelFilter(channels);
  const auto passes = [&](const std::string& channel, size_t payload = 60) {
    return Passes(program, Packet("LC02", channel, payload));
  };
  int others = 0;
  for (int i = 0; i < 10 * kModules; ++i) {
    if (i % 10 == 0) {
      EXPECT_TRUE(passes(name(i) + "/RESEND", 0)) << i;
      EXPECT_TRUE(passes(name(i) + "/TRANSFORM")) << i;
    } else {
      others += passes(name(i) + "/RESEND") ? 1 : 0;
    }
    // Topics are told apart exactly, and so are runs.
    EXPECT_FALSE(passes(name(i) + "/ACTUATOR")) << i;
    EXPECT_FALSE(passes(name(i) + "/STATUS")) << i;
    EXPECT_FALSE(passes("rum/m" + std::to_string(i) + "/RESEND")) << i;
  }
  // A hundred bits of a thousand and twenty-four are set, a little unevenly.
  EXPECT_LT(others, 3 * 9 * kModules * kModules / 1024);
  // The rest is exact.
  EXPECT_TRUE(passes("run/HELLO", 0));
  EXPECT_TRUE(passes("run/SIM/RESEND", 0));
  EXPECT_TRUE(passes("run/SIM/CLOCK")) << "its number is another one";
  EXPECT_FALSE(passes("run/SIM/SENSORS"));
  EXPECT_FALSE(passes("run/m1"));
  EXPECT_FALSE(passes("run/" + std::string(59, 'm')));
  EXPECT_FALSE(passes(""));
}

TEST(ChannelFilter, NamesThatAreTooLongToBeHashedPass) {
  std::vector<ChannelInterest> channels = ManyChannels("run", 50, {"RESEND"});
  const std::string longest = "run/" + std::string(54, 'n') + "/RESEND";
  channels.push_back({longest, {}});
  const auto program = BuildChannelFilter(channels);
  for (const std::string& channel :
       {longest, std::string("run/m7/RESEND"), std::string("run/HELLO")}) {
    EXPECT_TRUE(Passes(program, Packet("LC02", channel, 60))) << channel;
  }
  EXPECT_FALSE(Passes(program, Packet("LC02", "run/m7/STATUS", 60)));
  EXPECT_FALSE(Passes(program, Packet("LC02", "other/m7/RESEND", 60)));
}

TEST(ChannelFilter, ThePatternPassesBesideManyNames) {
  const auto program =
      BuildChannelFilter(ManyChannels("run", 100, {"RESEND", "TRANSFORM"}), {"run/", "/TRANSFORM"});
  for (const char* channel : {"run/m1/RESEND", "run/m1/TRANSFORM", "run/other/TRANSFORM"}) {
    EXPECT_TRUE(Passes(program, Packet("LC02", channel, 60))) << channel;
  }
  for (const char* channel : {"run/m1/STATUS", "walk/m1/TRANSFORM"}) {
    EXPECT_FALSE(Passes(program, Packet("LC02", channel, 60))) << channel;
  }
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
