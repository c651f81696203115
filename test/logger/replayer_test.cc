#include "logger/log/replayer.h"
#include "bridge/description/described_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <morphbus/info_part_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sim_clock_t.hpp>

#include "bridge/bus/inproc_bus.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/info_parts.h"
#include "logger/log/description.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using test::SyntheticEvent;
using test::SyntheticOptions;

struct Heard {
  int64_t now_us = 0;
  std::string channel;
  std::vector<uint8_t> payload;
};

/// A replay in virtual time, with one listener.
class Rig {
 public:
  explicit Rig(const std::string& path, ReplayOptions options = {}) {
    listener_ = hub_.Connect();
    player_ = hub_.Connect();
    listener_->SubscribePrefix(
        "", [this](std::string_view channel, const uint8_t* data, size_t size) {
          heard.push_back({now_us, std::string(channel), {data, data + size}});
        });
    auto opened = Replayer::Open(path, options);
    EXPECT_TRUE(opened.has_value()) << (opened ? "" : opened.error().message);
    if (opened) replayer = std::move(*opened);
  }
  void Start() { replayer->Start(player_.get(), now_us); }
  /// Plays until the end or `until_us`; false if it is still going.
  bool Play(int64_t until_us = 1'000'000'000) {
    while (now_us < until_us) {
      const std::optional<int64_t> again = replayer->Advance(now_us);
      hub_.HandleAll();
      if (!again) return true;
      now_us = std::max(now_us, *again);
    }
    return false;
  }
  void Say(const std::string& channel, const std::vector<uint8_t>& payload) {
    listener_->Publish(channel, payload.data(), payload.size());
    hub_.HandleAll();
  }
  void AskForInfo(const std::string& from) {
    resend_t ask{};
    ask.header.protocol = header_t::PROTOCOL;
    ask.sender = from;
    ask.channel = "synth/INFO";
    std::vector<uint8_t> payload;
    bridge::Encode(ask, &payload);
    Say("synth/LOG/RESEND", payload);
  }
  std::map<std::string, int> Count() const {
    std::map<std::string, int> count;
    for (const Heard& h : heard) ++count[h.channel];
    return count;
  }

  bridge::InprocHub hub_;
  std::unique_ptr<bridge::Bus> listener_, player_;
  std::unique_ptr<Replayer> replayer;
  std::vector<Heard> heard;
  int64_t now_us = 5'000'000;
};

TEST(ReplayerTest, EveryMessageArrivesOnceInOrderAndByteForByte) {
  for (const double speed : {0.0, 1.0, 50.0}) {
    const TempLog file;
    Rig rig(file.path(), {.speed = speed});
    rig.Start();
    ASSERT_TRUE(rig.Play());
    std::vector<SyntheticEvent> expected = test::SyntheticEvents({});
    std::erase_if(expected, [](const SyntheticEvent& e) { return e.channel == "synth/END"; });
    ASSERT_EQ(rig.heard.size(), expected.size()) << speed;
    for (size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(rig.heard[i].channel, expected[i].channel);
      ASSERT_EQ(rig.heard[i].payload, expected[i].payload);
    }
  }
}

TEST(ReplayerTest, PaceIsSimTimeWhateverTheLogsTimestampsSay) {
  const TempLog file;  // Recorded twenty times faster than sim time.
  for (const double speed : {0.5, 1.0, 4.0}) {
    Rig rig(file.path(), {.speed = speed});
    rig.Start();
    ASSERT_TRUE(rig.Play());
    EXPECT_NEAR(static_cast<double>(rig.heard.back().now_us - rig.heard.front().now_us),
                2e6 / speed, 100.0);
  }
}

TEST(ReplayerTest, ControlAndWhatMakesARunNeverGoOut) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  for (const char* channel : {"synth/CONTROL", "synth/HELLO", "synth/m1/RESEND", "synth/TOTALS"}) {
    events.insert(events.begin() + 20, {1, channel, {1, 2, 3}});
  }
  const TempLog file(test::EncodeLog(events));
  Rig rig(file.path(), {.speed = 0});
  rig.Start();
  ASSERT_TRUE(rig.Play());
  const auto count = rig.Count();
  for (const char* channel :
       {"synth/CONTROL", "synth/HELLO", "synth/m1/RESEND", "synth/TOTALS", "synth/END"}) {
    EXPECT_FALSE(count.contains(channel)) << channel;
  }
  EXPECT_EQ(rig.replayer->progress().withheld, 5);
}

TEST(ReplayerTest, NothingIsPublishedIntoALiveRunOfThatName) {
  const TempLog file;
  Rig rig(file.path());
  rig.Start();
  rig.Play(rig.now_us + 500'000);
  const std::vector<SyntheticEvent> live = test::SyntheticEvents({});
  const auto clock = std::find_if(live.begin(), live.end(), [](const SyntheticEvent& e) {
    return e.channel == "synth/SIM/CLOCK";
  });
  rig.Say(clock->channel, clock->payload);
  rig.heard.clear();
  EXPECT_TRUE(rig.Play());
  EXPECT_TRUE(rig.heard.empty());
  EXPECT_NE(rig.replayer->error().find("live run"), std::string::npos);
}

TEST(ReplayerTest, RangeIsInSimTimeAndKeepsTheDescription) {
  const TempLog file;
  Rig rig(file.path(), {.speed = 0, .from_s = 0.5, .to_s = 1.0});
  rig.Start();
  ASSERT_TRUE(rig.Play());
  const auto count = rig.Count();
  EXPECT_EQ(count.at("synth/SIM/CLOCK"), 25);
  EXPECT_EQ(count.at("synth/m2/TRANSFORM"), 25);
  EXPECT_GE(count.at("synth/INFO"), 1);
}

TEST(ReplayerTest, TheRangeIsThatOfEachOfConcatenatedRuns) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  SyntheticOptions options;
  options.run = "second";
  const std::vector<SyntheticEvent> second = test::SyntheticEvents(options);
  events.insert(events.end(), second.begin(), second.end());
  const TempLog file(test::EncodeLog(events));
  Rig rig(file.path(), {.from_s = 0.5, .to_s = 0.8});
  rig.Start();
  ASSERT_TRUE(rig.Play());
  const auto count = rig.Count();
  EXPECT_EQ(count.at("synth/SIM/CLOCK"), 15);
  EXPECT_EQ(count.at("second/SIM/CLOCK"), 15);
  EXPECT_EQ(count.at("second/m2/TRANSFORM"), 15);
  // Nobody waits for what is left out: 0.3 s of each run.
  EXPECT_LE(rig.heard.back().now_us - rig.heard.front().now_us, 700'000);
}

TEST(ReplayerTest, ChannelExpressionMatchesWholeNames) {
  const TempLog file;
  Rig rig(file.path(), {.speed = 0, .channel = "synth/m[12]/(TRANSFORM|STATUS)"});
  rig.Start();
  ASSERT_TRUE(rig.Play());
  EXPECT_EQ(rig.Count().size(), 4u);
}

TEST(ReplayerTest, BadExpressionIsAnErrorThatShowsIt) {
  const TempLog file;
  const auto replayer = Replayer::Open(file.path(), {.channel = "m[1"});
  ASSERT_FALSE(replayer.has_value());
  EXPECT_NE(replayer.error().message.find("m[1"), std::string::npos);
}

TEST(ReplayerTest, LoopBeginsAgain) {
  const TempLog file;
  Rig rig(file.path(), {.speed = 10, .loop = true});
  rig.Start();
  EXPECT_FALSE(rig.Play(rig.now_us + 2'500'000));
  EXPECT_GE(rig.replayer->progress().loops, 4);
  EXPECT_GE(rig.Count().at("synth/SIM/CLOCK"), 4 * 101);
}

TEST(ReplayerTest, PausedReplayStepsByTicksAndGoesOnWherePaused) {
  const TempLog file;
  Rig rig(file.path(), {.paused = true});
  rig.Start();
  rig.Play(rig.now_us + 3'000'000);
  EXPECT_TRUE(rig.heard.empty());
  rig.replayer->Step();
  rig.Play(rig.now_us + 100'000);
  EXPECT_EQ(rig.Count().at("synth/SIM/CLOCK"), 1);
  EXPECT_EQ(rig.Count().at("synth/m3/ACTUATOR"), 1);
  rig.replayer->Step();
  rig.Play(rig.now_us + 100'000);
  EXPECT_EQ(rig.Count().at("synth/SIM/CLOCK"), 2);
  rig.replayer->Resume(rig.now_us);
  const int64_t begin = rig.now_us;
  ASSERT_TRUE(rig.Play());
  EXPECT_NEAR(static_cast<double>(rig.heard.back().now_us - begin), 1.96e6, 1e3);
  EXPECT_EQ(rig.Count().at("synth/SIM/CLOCK"), 101);
}

/// Sim times of the CLOCKs that were heard, µs.
std::vector<int64_t> ClockTimes(const Rig& rig) {
  std::vector<int64_t> times;
  for (const Heard& heard : rig.heard) {
    header_t header;
    if (heard.channel != "synth/SIM/CLOCK") continue;
    if (bridge::DecodeHeader(heard.payload.data(), heard.payload.size(), &header)) {
      times.push_back(header.sim_time_us);
    }
  }
  return times;
}

TEST(ReplayerTest, SeekingGoesOnFromThereInEitherDirectionAtTheSamePace) {
  const TempLog file;
  Rig rig(file.path(), {.listen_us = 0});
  rig.Start();
  rig.Play(rig.now_us + 500'000);
  rig.heard.clear();
  rig.replayer->Seek(1.5, rig.now_us);
  const int64_t begin = rig.now_us;
  rig.Play(rig.now_us + 200'000);
  std::vector<int64_t> times = ClockTimes(rig);
  ASSERT_FALSE(times.empty());
  EXPECT_EQ(times.front(), 1'500'000);
  EXPECT_NEAR(static_cast<double>(times.back()), 1'700'000, 20'000);
  EXPECT_GE(rig.Count().at("synth/INFO"), 1);
  // What is due at once is published at once.
  EXPECT_NEAR(static_cast<double>(rig.heard.front().now_us), static_cast<double>(begin), 1'000);
  rig.heard.clear();
  rig.replayer->Seek(0.1, rig.now_us);
  ASSERT_TRUE(rig.Play());
  times = ClockTimes(rig);
  EXPECT_EQ(times.front(), 100'000);
  EXPECT_EQ(times.size(), 101u - 5u);
}

TEST(ReplayerTest, SeekingStaysInTheRangeAndALoopBeginsAtItsStart) {
  const TempLog file;
  Rig rig(file.path(), {.from_s = 0.5, .to_s = 1.0, .loop = true, .listen_us = 0});
  rig.Start();
  rig.replayer->Seek(-7, rig.now_us);
  rig.Play(rig.now_us + 100'000);
  EXPECT_EQ(ClockTimes(rig).front(), 500'000);
  rig.heard.clear();
  rig.replayer->Seek(0.9, rig.now_us);
  rig.Play(rig.now_us + 300'000);
  const std::vector<int64_t> times = ClockTimes(rig);
  EXPECT_EQ(times.front(), 900'000);
  EXPECT_EQ(*std::min_element(times.begin(), times.end()), 500'000);
}

TEST(ReplayerTest, SeekingWhilePausedShowsThatTickAndStaysPaused) {
  const TempLog file;
  Rig rig(file.path(), {.paused = true, .listen_us = 0});
  rig.Start();
  rig.replayer->Seek(1.005, rig.now_us);
  rig.Play(rig.now_us + 1'000'000);
  EXPECT_EQ(ClockTimes(rig), std::vector<int64_t>({1'020'000}));
  EXPECT_EQ(rig.Count().at("synth/m3/ACTUATOR"), 1);
  EXPECT_TRUE(rig.replayer->paused());
  EXPECT_NEAR(rig.replayer->progress().time_s, 1.02, 1e-9);
}

TEST(ReplayerTest, ALogWithoutDescriptionIsLentOneUnderItsOwnName) {
  SyntheticOptions options;
  options.description = false;
  const TempLog file(options);
  Rig rig(
      file.path(),
      {.loop = true, .description = test::SyntheticDescription("one", "another"), .listen_us = 0});
  rig.Start();
  rig.Play(rig.now_us + 2'500'000);
  bridge::InfoAssembler parts;
  std::vector<std::string> descriptions;
  int begun = 0;
  for (const Heard& heard : rig.heard) {
    info_part_t part;
    if (heard.channel != "synth/INFO") continue;
    ASSERT_TRUE(bridge::Decode(heard.payload.data(), heard.payload.size(), {}, &part));
    begun += part.part == 0 ? 1 : 0;
    if (auto whole = parts.Take(part)) descriptions.push_back(*whole);
  }
  // Once at the beginning, and once as it begins again.
  EXPECT_EQ(begun, 2);
  ASSERT_EQ(descriptions.size(), 1u);
  const auto key = bridge::ReadDescribedRun(descriptions.front());
  ASSERT_TRUE(key.has_value());
  EXPECT_EQ(key->run, "synth");
  // A log that has its own keeps to it, and one of another model is refused.
  const TempLog whole;
  Rig own(whole.path(), {.speed = 0, .description = test::SyntheticDescription("two", "another")});
  own.Start();
  ASSERT_TRUE(own.Play());
  EXPECT_EQ(own.heard.size(), test::SyntheticEvents({}).size() - 1);
  EXPECT_FALSE(Replayer::Open(file.path(), {.description = "nonsense"}).has_value());
}

/// The log with these commands in the CLOCKs of ticks, each of them twice in the file.
std::vector<SyntheticEvent> Commanded(const std::map<int64_t, std::string>& commands) {
  std::vector<SyntheticEvent> events;
  for (SyntheticEvent& event : test::SyntheticEvents({})) {
    const auto name = bridge::ParseChannel(event.channel);
    sim_clock_t clock;
    const bool is_clock =
        name && name->topic == bridge::Topic::kClock &&
        bridge::Decode(event.payload.data(), event.payload.size(), {}, &clock).has_value();
    const auto found = is_clock ? commands.find(clock.header.tick) : commands.end();
    if (found != commands.end()) {
      clock.controls = {found->second};
      clock.num_controls = 1;
      bridge::Encode(clock, &event.payload);
      events.push_back(event);
    }
    events.push_back(std::move(event));
  }
  return events;
}

TEST(ReplayerTest, CommandsArePassedOnceInTheirTicksWhateverGoesOut) {
  const TempLog log(
      test::EncodeLog(Commanded({{10, "pause"}, {50, "push m1 UP 2"}, {90, "stop"}})));
  for (const char* channel : {"", "synth/SIM/WORLD"}) {
    Rig rig(log.path(), {.channel = channel, .listen_us = 0});
    rig.Start();
    ASSERT_FALSE(rig.Play(rig.now_us + 500'000));
    const std::vector<ClockCommand> early = rig.replayer->TakeCommands();
    ASSERT_EQ(early.size(), 1U) << channel;
    EXPECT_EQ(early[0].text, "pause");
    EXPECT_EQ(early[0].tick, 10);
    EXPECT_EQ(early[0].time_us, 200'000);
    // What is skipped is not passed; what lies before it is passed again after going back.
    rig.replayer->Seek(1.2, rig.now_us);
    ASSERT_TRUE(rig.Play());
    const std::vector<ClockCommand> late = rig.replayer->TakeCommands();
    ASSERT_EQ(late.size(), 1U) << channel;
    EXPECT_EQ(late[0].text, "stop");
    EXPECT_TRUE(rig.replayer->TakeCommands().empty());
  }
}

TEST(ReplayerTest, SpeedChangesFromWhereItIs) {
  const TempLog file;
  Rig rig(file.path(), {.speed = 1, .listen_us = 0});
  rig.Start();
  const int64_t begin = rig.now_us;
  rig.Play(begin + 1'000'000);
  rig.replayer->SetSpeed(4, rig.now_us);
  ASSERT_TRUE(rig.Play());
  EXPECT_NEAR(static_cast<double>(rig.now_us - begin), 1e6 + 0.25e6, 3e4);
}

TEST(ReplayerTest, WaitsUntilSoManyAskedForTheDescription) {
  const TempLog file;
  Rig rig(file.path(), {.speed = 0, .wait_for = 2});
  rig.Start();
  rig.AskForInfo("monitor");
  rig.AskForInfo("monitor");
  rig.heard.clear();
  EXPECT_FALSE(rig.Play(rig.now_us + 5'000'000));
  EXPECT_TRUE(rig.heard.empty());
  rig.AskForInfo("spy");
  EXPECT_TRUE(rig.Play());
  EXPECT_EQ(rig.Count().at("synth/SIM/CLOCK"), 101);
}

TEST(ReplayerTest, LogOfForeignChannelsReplaysByItsTimestamps) {
  std::vector<SyntheticEvent> events;
  for (int i = 0; i < 11; ++i) events.push_back({1'000'000 + 100'000 * i, "EXAMPLE", {1}});
  const TempLog file(test::EncodeLog(events));
  Rig rig(file.path());
  rig.Start();
  ASSERT_TRUE(rig.Play());
  EXPECT_EQ(rig.heard.size(), 11u);
  EXPECT_EQ(rig.heard.back().now_us - rig.heard.front().now_us, 1'000'000);
}

TEST(ReplayerTest, DamagedMessagesAreCountedAndGoOutAsTheyAre) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  for (SyntheticEvent& event : events) {
    if (event.channel == "synth/SIM/SENSORS") event.payload.back() ^= 1;
  }
  const TempLog file(test::EncodeLog(events));
  Rig rig(file.path(), {.speed = 0});
  EXPECT_EQ(rig.replayer->progress().damaged, 0);
  rig.Start();
  EXPECT_TRUE(rig.Play());
  EXPECT_GT(rig.Count()["synth/SIM/SENSORS"], 0);
  EXPECT_EQ(rig.replayer->progress().damaged_messages, rig.Count()["synth/SIM/SENSORS"]);
}

TEST(ReplayerTest, TheEndOfTheLogIsKnownBeforeItIsReached) {
  const TempLog file(test::EncodeLog(test::SyntheticEvents({})));
  EXPECT_NEAR(Rig(file.path()).replayer->progress().end_s, 2.0, 0.03);  // 100 ticks of 20 ms
  std::vector<SyntheticEvent> events;
  for (int i = 0; i < 11; ++i) events.push_back({1'000'000 + 100'000 * i, "EXAMPLE", {1}});
  const TempLog foreign(test::EncodeLog(events));
  EXPECT_NEAR(Rig(foreign.path()).replayer->progress().end_s, 1.0, 1e-9);
}

TEST(ReplayerTest, ARangeThatIsNoTimeIsRefused) {
  const TempLog file(test::EncodeLog(test::SyntheticEvents({})));
  EXPECT_FALSE(Replayer::Open(file.path(), {.from_s = std::nan("")}).has_value());
  EXPECT_FALSE(Replayer::Open(file.path(), {.to_s = 1e300}).has_value());
}

TEST(ReplayerTest, DamagedLogReplaysAllThatIsSound) {
  std::vector<uint8_t> bytes = test::EncodeLog(test::SyntheticEvents({}));
  for (size_t i = 5'000; i < 9'000; ++i) bytes[i] = 0;
  const TempLog file(bytes);
  Rig rig(file.path(), {.speed = 0});
  EXPECT_GE(rig.replayer->progress().damaged, 1);
  rig.Start();
  EXPECT_TRUE(rig.Play());
  EXPECT_GT(rig.heard.size(), 850u);  // Of 919.
}

}  // namespace
}  // namespace morphbus::logger
