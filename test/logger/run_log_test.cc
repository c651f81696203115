#include "logger/log/run_log.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "bridge/wire/codec.h"
#include "logger/log/channel_stream.h"
#include "logger/log/facts_text.h"
#include "logger/log/series_collector.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using test::SyntheticEvent;
using test::SyntheticOptions;

RunLog Load(const std::string& path, const RunLogOptions& options = {}) {
  Result<RunLog> log = LoadRunLog(path, options);
  EXPECT_TRUE(log.has_value()) << (log ? "" : log.error().message);
  return log ? std::move(*log) : RunLog{};
}

TEST(RunLogTest, WholeLogIsReadByTick) {
  const TempLog file;
  const RunLog log = Load(file.path());
  EXPECT_TRUE(log.facts.whole()) << VerifyText(log.facts);
  EXPECT_EQ(log.facts.run, "synth");
  EXPECT_EQ(log.facts.robot_name, "one");
  EXPECT_EQ(log.facts.ticks, 100);
  EXPECT_DOUBLE_EQ(log.facts.seconds, 2.0);
  ASSERT_NE(log.robot, nullptr) << FactsText(log.facts, true);
  ASSERT_EQ(log.modules.size(), 3u);
  EXPECT_EQ(log.modules[0].name, "m1");
  for (const ModuleSeries& module : log.modules) {
    EXPECT_EQ(module.sensors.size(), 100u);
    EXPECT_EQ(module.transforms.size(), 100u);
    EXPECT_EQ(module.actuators.size(), 100u);
    EXPECT_EQ(module.status.size(), 3u);
  }
  EXPECT_EQ(log.world.size(), 100u);
  EXPECT_EQ(log.facts.end_state, EndState::kVerified);
  EXPECT_EQ(log.facts.run_hash, log.facts.end->run_hash);
}

TEST(SeriesCollectorTest, AReportThatOnlyTracesFieldsIsKeptAsTheirValues) {
  morphbus::status_t status{};
  status.role_name = "Node";
  SeriesCollector series;
  const auto take = [&](int tick, bool traces) {
    morphbus::status_t told = status;
    told.header.tick = tick;
    if (traces) {
      morphbus::print_t value{};
      value.function_index = -1;
      value.num_values = 1;
      value.values = {tick};
      told.prints = {value};
    }
    series.TakeTraces("m1", tick, told);
    series.TakeStatus("m1", tick, std::move(told), false);
  };
  for (int tick = 0; tick < 1000; ++tick) take(tick, true);
  EXPECT_EQ(series.Module("m1").status.size(), 1u);
  ASSERT_EQ(series.Module("m1").traces.size(), 1000u);
  EXPECT_EQ(series.Module("m1").traces[999].trace.value.bits, 999u);
  // What is new of the role is kept, and so is a report that came for another reason.
  status.role_name = "Leader";
  take(1000, true);
  take(1001, false);
  EXPECT_EQ(series.Module("m1").status.size(), 3u);
  EXPECT_TRUE(series.Module("m1").status[1].status.prints.empty());
}

TEST(RunLogTest, RunHashIgnoresTheRunsNameAndTheWallClock) {
  SyntheticOptions other;
  other.run = "another";
  other.start_us += 12345;
  const TempLog a;
  const TempLog b(other);
  EXPECT_EQ(Load(a.path()).facts.run_hash, Load(b.path()).facts.run_hash);
}

TEST(RunLogTest, LogWithoutEndIsNotWhole) {
  SyntheticOptions options;
  options.end = false;
  const TempLog file(options);
  const RunLog log = Load(file.path());
  EXPECT_EQ(log.facts.end_state, EndState::kMissing);
  EXPECT_FALSE(log.facts.whole());
}

TEST(RunLogTest, ContentThatEndDoesNotVouchForIsNamedByChannel) {
  SyntheticOptions options;
  options.stale_end = true;
  options.on_actuator = [](const std::string& module, actuator_t* message) {
    if (module == "m2" && message->header.tick == 40) message->joints[0].target_si += 0.01;
  };
  const TempLog file(options);
  const RunLog log = Load(file.path());
  EXPECT_EQ(log.facts.end_state, EndState::kMismatch);
  EXPECT_EQ(log.facts.num_damage, 0);
  EXPECT_EQ(log.facts.channels.at("synth/m2/ACTUATOR").matches_end, false);
  EXPECT_EQ(log.facts.channels.at("synth/m1/ACTUATOR").matches_end, true);
}

TEST(RunLogTest, ALogOfAnotherVersionIsSaidToBeOne) {
  // In that version SENSORS had other fields, and so another fingerprint.
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  for (SyntheticEvent& event : events) {
    if (event.channel != "synth/SIM/SENSORS") continue;
    event.payload[0] ^= 1;
    bridge::PatchCrc(event.payload.data(), event.payload.size());
  }
  const TempLog file(test::EncodeLog(events));
  const RunLog log = Load(file.path());
  EXPECT_GE(log.facts.num_damage, 100);
  ASSERT_FALSE(log.facts.problems.empty());
  EXPECT_TRUE(log.facts.problems.front().starts_with(
      "100 messages of the log have other fields than those of this version: it was made by test, "
      "this is "))
      << log.facts.problems.front();
}

TEST(RunLogTest, MissingMessagesAreCountedByChannelAndNumber) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  std::erase_if(events, [count = 0](const SyntheticEvent& e) mutable {
    return e.channel == "synth/m3/TRANSFORM" && (++count == 11 || count == 12);
  });
  const TempLog file(test::EncodeLog(events));
  const RunLog log = Load(file.path());
  const ChannelFacts& channel = log.facts.channels.at("synth/m3/TRANSFORM");
  EXPECT_EQ(channel.lost, 2);
  EXPECT_EQ(channel.first_lost, 10);
  EXPECT_EQ(log.facts.lost(), 2);
  EXPECT_FALSE(log.facts.whole());
}

TEST(RunLogTest, RepeatedAndDisorderedMessagesChangeNothing) {
  // As another tool's recording of a run with loss may look.
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  std::vector<SyntheticEvent> disordered(events.begin(), events.end() - 1);
  std::mt19937 random(5);
  for (size_t i = 20; i + 40 < disordered.size(); i += 20) {
    std::shuffle(disordered.begin() + static_cast<long>(i),
                 disordered.begin() + static_cast<long>(i) + 20, random);
    disordered.insert(disordered.begin() + static_cast<long>(i) + 5, disordered[i]);
  }
  disordered.push_back(events.back());
  const TempLog file(test::EncodeLog(disordered));
  const RunLog log = Load(file.path());
  EXPECT_EQ(log.facts.end_state, EndState::kVerified) << VerifyText(log.facts);
  EXPECT_EQ(log.facts.lost(), 0);
  ASSERT_EQ(log.modules[1].sensors.size(), 100u);
  for (size_t i = 1; i < 100; ++i) {
    EXPECT_LT(log.modules[1].sensors[i - 1].time_us, log.modules[1].sensors[i].time_us);
  }
}

TEST(RunLogTest, TwoMessagesWithOneNumberAreDamage) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  SyntheticOptions altered;
  altered.on_actuator = [](const std::string&, actuator_t* m) { m->joints[0].speed_si = 1.0; };
  const std::vector<SyntheticEvent> others = test::SyntheticEvents(altered);
  for (size_t i = 0; i < events.size(); ++i) {
    if (events[i].channel != "synth/m1/ACTUATOR") continue;
    events.insert(events.begin() + static_cast<long>(i) + 1, others[i]);
    break;
  }
  const TempLog file(test::EncodeLog(events));
  EXPECT_EQ(Load(file.path()).facts.num_damage, 1);
}

TEST(RunLogTest, FlippedPayloadByteIsReportedWithItsPlaceAndTime) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  std::vector<uint8_t> bytes;
  uint64_t offset = 0;
  for (size_t i = 0; i < events.size(); ++i) {
    if (events[i].channel == "synth/m2/TRANSFORM" && offset == 0 && i > events.size() / 2) {
      offset = bytes.size();
      events[i].payload[100] ^= 0x10;
    }
    AppendEvent(static_cast<int64_t>(i), events[i].timestamp_us, events[i].channel,
                events[i].payload, &bytes);
  }
  const TempLog file(bytes);
  const RunLog log = Load(file.path());
  ASSERT_EQ(log.facts.damage.size(), 1u);
  EXPECT_EQ(log.facts.damage[0].offset, offset);
  EXPECT_GT(log.facts.damage[0].time_us, 900'000);
  EXPECT_EQ(log.facts.channels.at("synth/m2/TRANSFORM").bad, 1);
}

TEST(RunLogTest, EveryFlippedByteOfALogIsNoticedUnlessItIsATimestamp) {
  SyntheticOptions options;
  options.ticks = 8;
  const std::vector<SyntheticEvent> events = test::SyntheticEvents(options);
  const std::vector<uint8_t> bytes = test::EncodeLog(events);
  std::vector<bool> is_timestamp(bytes.size(), false);
  size_t at = 0;
  for (const SyntheticEvent& e : events) {
    std::fill_n(is_timestamp.begin() + static_cast<long>(at) + 12, 8, true);
    at += kEventHeaderBytes + e.channel.size() + e.payload.size();
  }
  const TempFile file;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    if (is_timestamp[i]) continue;
    std::vector<uint8_t> flipped = bytes;
    flipped[i] ^= static_cast<uint8_t>(1u << (i % 8));
    test::WriteBytes(file.path(), flipped);
    const Result<RunLog> log = LoadRunLog(file.path(), {"synth", true});
    ASSERT_TRUE(log.has_value()) << i;
    ASSERT_FALSE(log->facts.whole()) << "byte " << i;
  }
}

TEST(RunLogTest, TruncationAnywhereIsNoticed) {
  SyntheticOptions options;
  options.ticks = 4;
  const std::vector<uint8_t> bytes = test::EncodeLog(test::SyntheticEvents(options));
  const TempFile file;
  for (size_t size = 0; size < bytes.size(); size += 7) {
    test::WriteBytes(file.path(), {bytes.begin(), bytes.begin() + static_cast<long>(size)});
    const Result<RunLog> log = LoadRunLog(file.path(), {"synth", true});
    ASSERT_TRUE(log.has_value());
    ASSERT_FALSE(log->facts.whole()) << size;
  }
}

TEST(RunLogTest, FactsAloneAgreeWithTheWholeReading) {
  const TempLog file;
  const RunLog log = Load(file.path(), {"", false});
  EXPECT_TRUE(log.modules[0].sensors.empty());
  EXPECT_EQ(FactsJson(log.facts), FactsJson(Load(file.path()).facts));
}

TEST(RunLogTest, ForeignChannelsAndRunsAreToldApart) {
  std::vector<SyntheticEvent> events = test::SyntheticEvents({});
  SyntheticOptions other;
  other.run = "other";
  other.ticks = 3;
  for (const SyntheticEvent& e : test::SyntheticEvents(other)) {
    events.insert(events.begin() + 30, e);
  }
  events.insert(events.begin() + 10, {0, "LCM_SELF_TEST", {1, 2, 3}});
  events.insert(events.begin() + 11, {0, "odd\x01\xFF<name>", {}});
  const TempLog file(test::EncodeLog(events));
  const RunLog log = Load(file.path());
  EXPECT_TRUE(log.facts.whole()) << VerifyText(log.facts);
  EXPECT_EQ(log.facts.other_runs, std::vector<std::string>{"other"});
  EXPECT_FALSE(log.facts.channels.at("LCM_SELF_TEST").ours);
  EXPECT_TRUE(log.facts.channels.contains("odd\\x01\\xff<name>"));
  EXPECT_FALSE(FactsJson(log.facts).dump().empty());
  EXPECT_EQ(Load(file.path(), {"other", true}).facts.ticks, 3);
}

TEST(RunLogTest, ARunThatTheFileDoesNotHoldIsAnErrorThatNamesThoseItHolds) {
  const TempLog file(test::EncodeLog(test::SyntheticEvents({})));
  for (const bool series : {false, true}) {
    const Result<RunLog> log = LoadRunLog(file.path(), {"nope", series});
    ASSERT_FALSE(log.has_value());
    EXPECT_EQ(log.error().message, "no run 'nope' in " + file.path() + "; it holds synth");
  }
}

TEST(RunLogTest, FaultsAreListedWithModuleRoleAndLine) {
  SyntheticOptions options;
  options.on_status = [](const std::string& module, status_t* status) {
    if (module != "m3" || status->header.tick != 50) return;
    fault_t fault{};
    fault.code = static_cast<int16_t>(vm::FaultCode::kTargetClamped);
    fault.role = fault.rival_role = fault.keyword = -1;
    fault.ended_task = fault.task_function = -1;
    fault.link = fault.connector = -1;
    fault.function_index = 4;
    fault.line = 17;
    fault.joint = 1;
    fault.asked = 95.5F;
    fault.limit = 90;
    status->faults = {fault};
    status->num_faults = 1;
  };
  const TempLog file(options);
  const RunLog log = Load(file.path());
  ASSERT_EQ(log.facts.faults.size(), 1u);
  EXPECT_EQ(log.facts.faults[0].module, "m3");
  EXPECT_EQ(log.facts.faults[0].role, "Tip");
  EXPECT_EQ(log.facts.faults[0].fault.line, 17);
  EXPECT_EQ(log.facts.faults[0].time_us, 1'000'000);
  // The synthetic log has no images, so the sentence has numbers in place of names. Whose program
  // it is the description says by its hash, and so in which file.
  EXPECT_EQ(log.facts.faults[0].Line(),
            "synthetic.dyn:17: joint 1 was asked for 95.5 and can go to 90 only: clamped (in "
            "function 4)");
  EXPECT_NE(FactsText(log.facts, true).find(log.facts.faults[0].Line()), std::string::npos);
}

TEST(RunLogTest, InfoJsonHasWhatScriptsNeed) {
  const TempLog file;
  const nlohmann::json json = FactsJson(Load(file.path()).facts);
  EXPECT_EQ(json["run"], "synth");
  EXPECT_EQ(json["end"], "verified");
  EXPECT_EQ(json["whole"], true);
  EXPECT_EQ(json["ticks"], 100);
  EXPECT_EQ(json["lost"], 0);
  EXPECT_EQ(json["channels"]["synth/SIM/CLOCK"]["messages"], 101);
  EXPECT_NEAR(json["channels"]["synth/m1/TRANSFORM"]["rate_hz"].get<double>(), 50.0, 1e-9);
  EXPECT_EQ(json["description"]["robot"], "one");
}

TEST(RunLogTest, FileWithoutARunIsAnErrorThatNamesIt) {
  const TempLog file(test::EncodeLog({{1, "EXAMPLE", {1}}}));
  const Result<RunLog> log = LoadRunLog(file.path());
  ASSERT_FALSE(log.has_value());
  EXPECT_NE(log.error().message.find(file.path()), std::string::npos);
}

TEST(RunLogTest, RandomAlterationsOfAnythingNeverCrash) {
  SyntheticOptions options;
  options.ticks = 10;
  const std::vector<SyntheticEvent> events = test::SyntheticEvents(options);
  const TempFile file;
  std::mt19937 random(11);
  for (int round = 0; round < 150; ++round) {
    std::vector<SyntheticEvent> altered = events;
    for (int i = 0; i < 20; ++i) {
      SyntheticEvent& event = altered[random() % altered.size()];
      if (event.payload.size() < 16) continue;
      event.payload[12 + random() % (event.payload.size() - 12)] = static_cast<uint8_t>(random());
      // With the CRC made right again, so that the values themselves are what is tried.
      const uint32_t crc = bridge::MessageCrc(event.payload.data(), event.payload.size());
      for (int b = 0; b < 4; ++b) {
        event.payload[8 + static_cast<size_t>(b)] = static_cast<uint8_t>(crc >> (24 - 8 * b));
      }
    }
    test::WriteBytes(file.path(), test::EncodeLog(altered));
    const Result<RunLog> log = LoadRunLog(file.path(), {"synth", true});
    ASSERT_TRUE(log.has_value());
    ASSERT_FALSE(FactsText(log->facts, true).empty());
  }
}

TEST(ChannelStreamTest, GapIsGivenUpAfterPatienceAndMemoryStaysBounded) {
  ChannelStream line;
  const std::vector<uint8_t> payload(100, 7);
  EXPECT_EQ(line.Take(0, payload), ChannelStream::Kind::kNew);
  for (int64_t n = 2; n < 10'000; ++n) line.Take(n, payload);
  EXPECT_EQ(line.lost(), 1);
  EXPECT_EQ(line.first_lost(), 1);
  EXPECT_EQ(line.Take(5'000, payload), ChannelStream::Kind::kDuplicate);
  line.Finish();
  EXPECT_EQ(line.count(), 9'999);
}

}  // namespace
}  // namespace morphbus::logger
