#include "logger/log/recorder.h"
#include "logger/log/facts_text.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "compiler/model/run_description.pb.h"
#include "logger/log/run_log.h"
#include "test/bridge/fake_run.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using bridge::FakeRun;
using bridge::FakeRunOptions;

std::string Description(const std::string& run, bool realtime = false) {
  proto::RunDescription d;
  d.set_run(run);
  d.set_model_hash(bridge::kFakeModel);
  d.set_model(std::string(5000, 'x'));  // Several INFO parts.
  d.set_mode(realtime ? "realtime" : "lockstep");
  return d.SerializeAsString();
}

struct Recorded {
  RecordSummary summary;
  std::string sim_hash;
  std::string recorded_hash;
  RunLog log;
  std::vector<std::string> channels;  ///< Of the hashed events, in order of the file.
};

struct Options {
  FakeRunOptions run;
  int64_t wall_us = 1'000'000;
  std::string interrupted;
  /// Called before the run begins; what it returns stays on the bus as long as the run.
  std::function<std::unique_ptr<bridge::Bus>(FakeRun*)> join;
};

/// A whole fake run on the in-process bus, recorded.
Recorded Record(const std::string& path, const Options& options) {
  FakeRun run(options.run);
  run.log.reset();
  RecorderOptions recording;
  recording.path = path;
  recording.description = Description(options.run.run, options.run.realtime);
  recording.realtime = options.run.realtime;
  recording.timing = options.run.timing;
  int64_t wall = options.wall_us;
  recording.wall_clock = [&wall] { return ++wall; };
  auto recorder = Recorder::Create(&run.log_seat->bus, &run.time, recording);
  EXPECT_TRUE(recorder.has_value()) << (recorder ? "" : recorder.error().message);
  Recorded out;
  if (!recorder) return out;
  const std::unique_ptr<bridge::Bus> guest = options.join ? options.join(&run) : nullptr;
  bridge::LateMessages late = run.Late();
  std::vector<bridge::Participant*> participants = {&late, run.sim.get(), recorder->get()};
  for (FakeRun::Module& module : run.modules) participants.push_back(module.participant.get());
  EXPECT_TRUE(bridge::RunInproc(&run.hub, &run.time, participants));
  (*recorder)->EachSecond();
  const Result<RecordSummary> summary = (*recorder)->Finish(options.interrupted);
  EXPECT_TRUE(summary.has_value()) << (summary ? "" : summary.error().message);
  if (!summary) return out;
  out.summary = *summary;
  out.sim_hash = run.sim->outcome().run_hash;
  out.recorded_hash = run.sim->outcome().recorded_hash;
  Result<RunLog> log = LoadRunLog(path);
  EXPECT_TRUE(log.has_value());
  if (log) out.log = std::move(*log);
  auto reader = EventLogReader::Open(path);
  LogEvent event;
  while ((*reader)->Next(&event)) {
    const auto name = bridge::ParseChannel(event.channel);
    if (name && bridge::IsHashed(name->topic)) out.channels.emplace_back(event.channel);
  }
  return out;
}

TEST(RecorderTest, LockstepRunIsRecordedWholeAndVouchedFor) {
  const TempFile file;
  const Recorded r = Record(file.path(), {});
  EXPECT_TRUE(r.summary.complete) << r.summary.reason;
  EXPECT_EQ(r.summary.path, file.path());
  EXPECT_FALSE(std::filesystem::exists(file.path() + ".partial"));
  EXPECT_EQ(r.summary.run_hash, r.sim_hash);
  EXPECT_EQ(r.recorded_hash, r.sim_hash);
  EXPECT_EQ(r.log.facts.run_hash, r.sim_hash);
  EXPECT_EQ(r.log.facts.end_state, EndState::kVerified) << VerifyText(r.log.facts);
  EXPECT_TRUE(r.log.facts.whole());
  EXPECT_EQ(r.log.facts.ticks, 40);
  EXPECT_EQ(r.log.facts.end->clean, 1);
  EXPECT_EQ(r.log.description, Description("test"));
}

TEST(RecorderTest, DescriptionStandsAtTheHeadAndEndAtTheTail) {
  const TempFile file;
  Record(file.path(), {});
  auto reader = EventLogReader::Open(file.path());
  ASSERT_TRUE(reader.has_value());
  LogEvent event;
  std::vector<std::string> channels;
  while ((*reader)->Next(&event)) channels.emplace_back(event.channel);
  ASSERT_GT(channels.size(), 10u);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(channels[static_cast<size_t>(i)], "test/INFO");
  EXPECT_EQ(channels.back(), "test/END");
  EXPECT_EQ(std::count(channels.begin(), channels.end(), "test/END"), 1);
}

TEST(RecorderTest, LossOfAFifthOfAllMessagesLeavesTheSameLog) {
  const TempFile file_a("a.log");
  const TempFile file_b("b.log");
  const Recorded calm = Record(file_a.path(), {});
  Options lossy;
  lossy.run.loss = 0.2;
  lossy.run.seed = 99;
  const Recorded rough = Record(file_b.path(), lossy);
  EXPECT_TRUE(rough.summary.complete) << rough.summary.reason;
  EXPECT_EQ(calm.summary.run_hash, rough.summary.run_hash);
  // Not only the same messages, but in the same order.
  EXPECT_EQ(calm.channels, rough.channels);
  EXPECT_TRUE(rough.log.facts.whole()) << VerifyText(rough.log.facts);
}

TEST(RecorderTest, InterruptedRecordingSaysSoInItsEnd) {
  const TempFile file;
  Options options;
  options.interrupted = "the logger was stopped";
  const Recorded r = Record(file.path(), options);
  EXPECT_FALSE(r.summary.complete);
  EXPECT_EQ(r.log.facts.end->clean, 0);
  EXPECT_EQ(r.log.facts.end->reason, "the logger was stopped");
  EXPECT_EQ(r.log.facts.end_state, EndState::kVerified);
}

TEST(RecorderTest, RealTimeRecordingReportsWhatItLostAndIsCompleteAllTheSame) {
  const TempFile file;
  Options options;
  options.run.realtime = true;
  options.run.speed = 1.0;
  options.run.loss = 0.2;
  const Recorded r = Record(file.path(), options);
  EXPECT_TRUE(r.summary.complete) << r.summary.reason;  // loss in real time is no failure
  EXPECT_GT(r.summary.lost, 0);
  EXPECT_NE(r.summary.reason.find("not in the log"), std::string::npos);
  EXPECT_GT(r.log.facts.lost(), 0);
  EXPECT_FALSE(r.log.facts.whole());
  // The CLOCKs of some ticks are among what was lost; the ticks were there.
  EXPECT_LT(r.log.facts.channels.at("test/SIM/CLOCK").messages, 40);
  EXPECT_EQ(r.log.facts.ticks, 40);
}

TEST(RecorderTest, RealTimeRecordingVouchesForMessagesThatCameInAnotherOrder) {
  const TempFile file;
  Options options;
  options.run.realtime = true;
  options.run.speed = 1.0;
  bridge::FaultRule late;
  late.late = 0.3;
  late.by_us = 50'000;
  options.run.faults.rules = {late};
  const Recorded r = Record(file.path(), options);
  EXPECT_TRUE(r.summary.complete) << r.summary.reason;
  EXPECT_GT(r.log.disorder_us, 0);
  EXPECT_EQ(r.log.facts.end_state, EndState::kVerified) << VerifyText(r.log.facts);
  EXPECT_EQ(r.log.facts.run_hash, r.summary.run_hash);
  EXPECT_EQ(r.log.facts.ticks, 40);
}

/// A run that is ended, as `run` does, when its recorder says that it can record no more.
struct Spoilt {
  int64_t ticks = 0;
  std::string error;
};

Spoilt RecordUntil(const std::string& path, const std::function<void(const std::string&)>& spoil) {
  FakeRunOptions options;
  options.ticks = 5000;
  FakeRun run(options);
  run.log.reset();
  RecorderOptions recording;
  recording.path = path;
  recording.description = Description("test");
  auto recorder = Recorder::Create(&run.log_seat->bus, &run.time, recording);
  EXPECT_TRUE(recorder.has_value()) << (recorder ? "" : recorder.error().message);
  std::vector<bridge::Participant*> participants = {run.sim.get(), recorder->get()};
  for (FakeRun::Module& module : run.modules) participants.push_back(module.participant.get());
  bool stop = false;
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 20) spoil((*recorder)->partial_path());
    if (tick % 10 == 0) (*recorder)->EachSecond();
    stop = !(*recorder)->error().empty();
  });
  EXPECT_FALSE(bridge::RunInproc(&run.hub, &run.time, participants, &stop));
  Spoilt spoilt;
  spoilt.ticks = run.robot.ticks;
  const Result<RecordSummary> summary = (*recorder)->Finish("");
  EXPECT_FALSE(summary.has_value());
  if (!summary) spoilt.error = summary.error().message;
  return spoilt;
}

TEST(RecorderTest, BehindAnEventThatWasCutOffNothingIsWritten) {
  const TempFile file;
  auto writer = EventLogWriter::Create(file.path());
  ASSERT_TRUE(writer.has_value());
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit limit = {64, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  const std::vector<uint8_t> data(100, 1);
  EXPECT_TRUE((*writer)->Write(1, "A", data));
  const Result<void> full = (*writer)->Flush();
  setrlimit(RLIMIT_FSIZE, &before);
  // There is room again, but what was lost is lost.
  ASSERT_FALSE(full.has_value());
  EXPECT_NE(full.error().message.find("File too large"), std::string::npos);
  for (const Result<void>& later :
       {(*writer)->Write(2, "A", data), (*writer)->Flush(), (*writer)->Close()}) {
    ASSERT_FALSE(later.has_value());
    EXPECT_EQ(later.error().message, full.error().message);
  }
  EXPECT_EQ(std::filesystem::file_size(file.path() + ".partial"), 64u);
}

TEST(RecorderTest, AFullDiskIsNoticedAtOnceWithTheReason) {
  const TempFile file;
  // A limit on the size of files stands for a disk that is full.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const Spoilt spoilt = RecordUntil(file.path(), [&](const std::string& partial) {
    rlimit limit = before;
    limit.rlim_cur = std::filesystem::file_size(partial);
    setrlimit(RLIMIT_FSIZE, &limit);
  });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_LT(spoilt.ticks, 100);
  EXPECT_NE(spoilt.error.find("cannot write " + file.path()), std::string::npos) << spoilt.error;
}

TEST(RecorderTest, ALogThatIsRemovedWhileItIsWrittenIsNoticedWithTheReason) {
  const TempFile file;
  const Spoilt spoilt = RecordUntil(
      file.path(), [](const std::string& partial) { std::filesystem::remove(partial); });
  EXPECT_LT(spoilt.ticks, 100);
  EXPECT_NE(spoilt.error.find("was removed while it was written"), std::string::npos);
}

TEST(RecorderTest, AReasonThatIsTooLongIsCutAndEndStaysReadable) {
  const TempFile file;
  Options options;
  for (int i = 0; i < 100; ++i) options.interrupted += "ä because ";
  const Recorded r = Record(file.path(), options);
  EXPECT_EQ(r.log.facts.end_state, EndState::kVerified) << VerifyText(r.log.facts);
  ASSERT_TRUE(r.log.facts.end.has_value());
  EXPECT_LE(r.log.facts.end->reason.size(), 200u);
  EXPECT_GE(r.log.facts.end->reason.size(), 199u);
}

TEST(RecorderTest, DescriptionOfNothingIsRefused) {
  FakeRun run({});
  const TempFile file;
  RecorderOptions recording;
  recording.path = file.path();
  recording.description = "no protobuf \xFF";
  EXPECT_FALSE(Recorder::Create(&run.log_seat->bus, &run.time, recording).has_value());
}

TEST(Recorder, TheLedgerThatAProcessPublishedLastCountsWhateverIsSaidAgainOrComesLate) {
  const TempFile file, turned;
  Options options;
  std::vector<uint8_t> first;
  options.join = [&](FakeRun* run) {
    std::unique_ptr<bridge::Bus> ears = run->hub.Connect();
    ears->Subscribe("test/m1/HEALTH", [&](std::string_view, const uint8_t* data, size_t size) {
      if (first.empty()) first.assign(data, data + size);
    });
    bridge::Bus* const bus = ears.get();
    run->sim->OnAfterTick([run, bus, &first](int64_t) {
      run->modules[0].participant->PublishHealth();
      if (!first.empty()) bus->Publish("test/m1/HEALTH", first.data(), first.size());
    });
    return ears;
  };
  const Recorded recorded = Record(file.path(), options);
  EXPECT_TRUE(recorded.summary.complete) << recorded.summary.reason;
  const morphbus::health_t& last = recorded.log.facts.health.at("m1");
  EXPECT_GT(last.sent, 50);
  // Each stands in the log once; and the last one counts where it stands before the others, too.
  std::vector<std::vector<uint8_t>> told;
  auto reader = EventLogReader::Open(file.path());
  auto writer = EventLogWriter::Create(turned.path());
  ASSERT_TRUE(reader && writer);
  LogEvent event;
  while ((*reader)->Next(&event)) {
    if (event.channel == "test/m1/HEALTH") {
      told.emplace_back(event.data.begin(), event.data.end());
      continue;
    }
    while (event.channel == "test/LOG/HEALTH" && !told.empty()) {
      ASSERT_TRUE((*writer)->Write(event.timestamp_us, "test/m1/HEALTH", told.back()));
      told.pop_back();
    }
    ASSERT_TRUE((*writer)->Write(event.timestamp_us, event.channel,
                                 {event.data.begin(), event.data.end()}));
  }
  EXPECT_EQ(recorded.log.facts.channels.at("test/m1/HEALTH").events, 40);
  ASSERT_TRUE((*writer)->Close());
  const Result<RunLog> log = LoadRunLog(turned.path());
  ASSERT_TRUE(log);
  EXPECT_EQ(log->facts.health.at("m1").sent, last.sent);
}

// A stranger on the bus turns each bit of the header of the first message of every kind outside the
// hash, and mends the CRC.
TEST(Recorder, WritesNothingThatReadersTakeForDamage) {
  const TempFile file;
  int forged = 0;
  std::map<bridge::Topic, int> heard;
  Options options;
  options.join = [&](FakeRun* run) {
    std::unique_ptr<bridge::Bus> forger = run->hub.Connect();
    bridge::Bus* bus = forger.get();
    const auto forge = [&forged, &heard, bus](std::string_view channel, const uint8_t* data,
                                              size_t size) {
      const auto name = bridge::ParseChannel(channel);
      if (!name || bridge::IsHashed(name->topic) || ++heard[name->topic] != 1) return;
      // Fingerprint, CRC and protocol stay.
      constexpr size_t kFirst = 16, kEnd = 56;
      for (size_t bit = 8 * kFirst; bit < 8 * kEnd; ++bit) {
        std::vector<uint8_t> message(data, data + size);
        message[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8);
        bridge::PatchCrc(message.data(), message.size());
        bus->Publish(std::string(channel), message.data(), message.size());
        ++forged;
      }
    };
    forger->SubscribePrefix(FakeRunOptions().run + "/", forge);
    run->modules[0].participant->PublishHealth();
    return forger;
  };
  const Recorded recorded = Record(file.path(), options);
  EXPECT_GE(forged, 3 * 8 * 40);
  EXPECT_TRUE(recorded.summary.complete) << recorded.summary.reason;
  EXPECT_EQ(recorded.summary.run_hash, recorded.sim_hash);
  EXPECT_TRUE(recorded.log.facts.whole()) << VerifyText(recorded.log.facts);
}

}  // namespace
}  // namespace morphbus::logger
