// Channels, URLs, adapters of buses, outbox, ledger, hashes.

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <morphbus/status_t.hpp>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/inproc_bus.h"
#include "bridge/bus/lcm_bus.h"
#include "bridge/bus/lcm_url.h"
#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/sequence_tracker.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/stream_hash.h"
#include "test/bridge/lossy_bus.h"

namespace morphbus::bridge {
namespace {

const std::vector<uint8_t> kBytes = {1, 2, 3};

TEST(Channels, NamesAndBack) {
  for (const Topic topic : {Topic::kClock, Topic::kSensors, Topic::kWorld}) {
    const std::string channel = Channel("walk", "SIM", topic);
    const auto name = ParseChannel(channel);
    ASSERT_TRUE(name);
    EXPECT_EQ(name->process, "SIM");
    EXPECT_EQ(name->topic, topic);
    EXPECT_TRUE(IsHashed(topic));
  }
  EXPECT_EQ(Channel("walk", "m1", Topic::kTransform), "walk/m1/TRANSFORM");
  EXPECT_EQ(Channel("walk", "m1", Topic::kResend), "walk/m1/RESEND");
  EXPECT_EQ(Channel("walk", "", Topic::kLeave), "walk/SIM/LEAVE");
  EXPECT_EQ(Channel("walk", "LOG", Topic::kProgress), "walk/LOG/PROGRESS");
  EXPECT_EQ(Channel("walk", "m1", Topic::kHello), "walk/HELLO");
  const auto name = ParseChannel("walk/m1/STATUS");
  ASSERT_TRUE(name);
  EXPECT_EQ(name->run, "walk");
  EXPECT_EQ(name->process, "m1");
  EXPECT_FALSE(IsHashed(Topic::kResend) || IsHashed(Topic::kHello) || IsHashed(Topic::kHealth) ||
               IsHashed(Topic::kInfo));
}

TEST(Channels, StrangersAreNone) {
  for (const char* name :
       {"", "walk", "/m1/STATUS", "walk//STATUS", "walk/m1/NEWS", "walk/m1/CLOCK",
        "walk/SIM/STATUS", "walk/m1/HELLO", "walk/STATUS", "walk/a/b/STATUS", "walk/m1/PROGRESS",
        "walk/LOG/LEAVE", "wa lk/m1/STATUS", "LCM_SELF_TEST"}) {
    EXPECT_FALSE(ParseChannel(name)) << name;
  }
}

TEST(Channels, TheLongestNamesFitLcm) {
  const std::string run(kMaxRunName, 'r'), module(kMaxProcessName, 'm');
  EXPECT_TRUE(CheckRunName(run));
  EXPECT_TRUE(CheckModuleName(module));
  EXPECT_EQ(Channel(run, module, Topic::kTransform).size(), kMaxChannelName);
  EXPECT_FALSE(CheckRunName(run + "r"));
  EXPECT_FALSE(CheckModuleName(module + "m"));
}

TEST(Channels, ReservedAndOddNamesAreRefused) {
  for (const char* name :
       {"SIM", "LOG", "HELLO", "INFO", "CONTROL", "END", "", "a b", "a/b", "m.1"}) {
    EXPECT_FALSE(CheckModuleName(name)) << name;
  }
  for (const char* name : {"", "a b", "a/b", "a.b", "ä"}) EXPECT_FALSE(CheckRunName(name)) << name;
}

TEST(LcmUrl, BufferIsAskedForWhereItIsNot) {
  const auto plain = ResolveLcmUrl("udpm://239.255.76.67:7667?ttl=0");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->url, "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304");
  EXPECT_EQ(plain->port, 7667);
  EXPECT_EQ(plain->group, 0xefff4c43u);
  EXPECT_EQ(ResolveLcmUrl("udpm://239.1.2.3:99")->url, "udpm://239.1.2.3:99?recv_buf_size=4194304");
  EXPECT_EQ(ResolveLcmUrl("udpm://")->url, "udpm://?recv_buf_size=4194304");
  EXPECT_EQ(ResolveLcmUrl("udpm://?")->url, "udpm://?recv_buf_size=4194304");
  EXPECT_EQ(ResolveLcmUrl("udpm://?recv_buf_size=5")->url, "udpm://?recv_buf_size=5");
  EXPECT_EQ(ResolveLcmUrl("memq://")->url, "memq://");
  EXPECT_EQ(ResolveLcmUrl("file:///tmp/x.log?mode=r")->provider, "file");
}

TEST(LcmUrl, EnvironmentThenDefault) {
  setenv("LCM_DEFAULT_URL", "udpm://239.9.9.9:1234?ttl=1", 1);
  EXPECT_EQ(ResolveLcmUrl("")->port, 1234);
  EXPECT_EQ(ResolveLcmUrl("udpm://239.1.1.1:55")->port, 55);
  unsetenv("LCM_DEFAULT_URL");
  EXPECT_EQ(ResolveLcmUrl("")->url, kDefaultLcmUrl);
}

TEST(LcmUrl, BadOnesAreRefusedInOneSentence) {
  const std::pair<const char*, const char*> cases[] = {
      {"239.255.76.67:7667", "has no provider"},
      {"carrier://pigeon", "names the provider 'carrier', which LCM does not have"},
      {"udpm://10.0.0.1:7667", "has the group 10.0.0.1, which is no multicast address"},
      {"udpm://239.255.76:7667", "is not an IPv4 address"},
      {"udpm://239.255.76.67:0", "is not a number from 1 to 65535"},
      {"udpm://239.255.76.67:70000", "is not a number from 1 to 65535"},
      {"udpm://239.255.76.67:7667?ttl=300", "is not a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl", "is not written name=value"},
      {"udpm://239.255.76.67:7667?tll=1", "has the option 'tll', which LCM does not know"},
  };
  for (const auto& [url, why] : cases) {
    const auto result = ResolveLcmUrl(url);
    ASSERT_FALSE(result) << url;
    EXPECT_NE(result.error().message.find(why), std::string::npos) << result.error().message;
  }
}

/// Notes what it is asked for.
class NotingBus : public Bus {
 public:
  void Publish(const std::string&, const uint8_t*, size_t) override {}
  void Receive(const Channels& channels, Handler) override {
    interests[channels.name] = channels.interest;
  }
  void Unsubscribe(const std::string& channel) override { interests.erase(channel); }
  void WakeForAny(bool any) override { wakes_for_any = any; }
  int HandleFor(int64_t) override { return 0; }

  std::map<std::string, Interest> interests;
  bool wakes_for_any = false;
};

TEST(BusMux, TheSharedBusIsAskedForAllThatAnybodyNeeds) {
  NotingBus bus;
  BusMux mux(&bus);
  const auto ignore = [](std::string_view, const uint8_t*, size_t) {};
  auto first = mux.Connect(), second = mux.Connect(), third = mux.Connect();
  Interest part_1{true, 2, 56, 1, false};
  Interest part_2{true, 2, 56, 2, false};
  Interest quiet;
  quiet.wakes = false;
  first->Subscribe("r/S", ignore, part_1);
  EXPECT_EQ(bus.interests["r/S"], part_1);
  second->Subscribe("r/S", ignore, part_1);
  EXPECT_EQ(bus.interests["r/S"], part_1);
  third->Subscribe("r/S", ignore, part_2);
  EXPECT_EQ(bus.interests["r/S"], Interest());
  first->Subscribe("r/T", ignore, quiet);
  EXPECT_EQ(bus.interests["r/T"], quiet);
  second->Subscribe("r/T", ignore);
  EXPECT_EQ(bus.interests["r/T"], Interest());
  // Any wait that must end early ends early for all.
  first->WakeForAny(true);
  second->WakeForAny(true);
  first->WakeForAny(false);
  EXPECT_TRUE(bus.wakes_for_any);
  second.reset();
  EXPECT_FALSE(bus.wakes_for_any);
}

TEST(BusMux, ParticipantsShareABusInOrder) {
  InprocHub hub;
  const auto bus = hub.Connect(), other = hub.Connect();
  BusMux mux(bus.get());
  auto first = mux.Connect(), second = mux.Connect();
  std::string heard;
  second->Subscribe("x", [&heard](std::string_view, const uint8_t*, size_t) { heard += '2'; });
  first->Subscribe("x", [&heard](std::string_view, const uint8_t*, size_t) { heard += '1'; });
  first->SubscribePrefix("x", [&heard](std::string_view, const uint8_t*, size_t) { heard += 'p'; });
  other->Publish("x", kBytes.data(), kBytes.size());
  hub.HandleAll();
  EXPECT_EQ(heard, "12p");
  first.reset();
  other->Publish("x", kBytes.data(), kBytes.size());
  hub.HandleAll();
  EXPECT_EQ(heard, "12p2");
}

TEST(Ledger, CountsInjectedLossExactly) {
  for (const double loss : {0.0, 0.01, 0.2, 0.7}) {
    InprocHub hub;
    const auto sender = hub.Connect(), receiver = hub.Connect();
    LossyBus lossy(receiver.get(), loss, 42);
    Ledger ledger;
    SequenceTracker tracker;
    int64_t first = -1, last = -1, heard = 0;
    lossy.Subscribe("x", [&](std::string_view, const uint8_t* data, size_t) {
      last = data[0] | data[1] << 8;
      if (first < 0) first = last;
      tracker.Take(last, 0, &ledger);
      ++heard;
    });
    constexpr int64_t kSent = 5000;
    for (int64_t i = 0; i < kSent; ++i) {
      const uint8_t number[] = {static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8)};
      sender->Publish("x", number, 2);
      hub.HandleAll();
    }
    EXPECT_EQ(heard + lossy.losses().discarded, kSent);
    // What is lost before the first message that is heard, or after the last, leaves no gap.
    EXPECT_EQ(ledger.lost, last - first + 1 - heard);
    if (loss == 0.2) {
      EXPECT_NEAR(static_cast<double>(ledger.lost) / kSent, loss, 0.02);
    }
    EXPECT_EQ(ledger.duplicates, 0);
  }
}

TEST(Ledger, TellsLateFromRepeated) {
  Ledger ledger;
  SequenceTracker tracker;
  using Kind = SequenceTracker::Kind;
  EXPECT_EQ(tracker.Take(10, 0, &ledger), Kind::kNext);
  EXPECT_EQ(tracker.Take(13, 0, &ledger), Kind::kAfterGap);
  EXPECT_EQ(ledger.lost, 2);
  EXPECT_EQ(tracker.Take(12, 0, &ledger), Kind::kLate);
  EXPECT_EQ(tracker.Take(12, 0, &ledger), Kind::kDuplicate);
  EXPECT_EQ(tracker.Take(14, 0, &ledger), Kind::kNext);
  EXPECT_EQ(tracker.Take(13, 0, &ledger), Kind::kDuplicate);
  EXPECT_EQ(ledger.lost, 2);
  EXPECT_EQ(ledger.duplicates, 2);
  EXPECT_EQ(tracker.Take(1000, 0, &ledger), Kind::kAfterGap);
  EXPECT_EQ(tracker.Take(20, 0, &ledger), Kind::kLate) << "late by hundreds is late all the same";
  EXPECT_EQ(tracker.Take(20, 0, &ledger), Kind::kDuplicate);
  EXPECT_EQ(tracker.Take(5000, 0, &ledger), Kind::kAfterGap);
  EXPECT_EQ(tracker.Take(30, 0, &ledger), Kind::kDuplicate) << "too long ago to know";
  // Other bytes under a number are neither lost nor repeated: one of the two is somebody else's.
  const Ledger before = ledger;
  EXPECT_EQ(tracker.Take(5000, 1, &ledger), Kind::kConflict);
  EXPECT_EQ(tracker.Take(5000, 0, &ledger), Kind::kDuplicate);
  EXPECT_EQ(ledger.lost, before.lost);
  EXPECT_EQ(ledger.duplicates, before.duplicates + 1);
}

TEST(LossyBus, IsTheSameWithTheSameSeed) {
  const auto pattern = [](uint64_t seed) {
    InprocHub hub;
    const auto endpoint = hub.Connect();
    LossyBus lossy(endpoint.get(), 0.5, seed);
    std::string heard;
    lossy.Subscribe("x", [&heard](std::string_view, const uint8_t* data, size_t) {
      heard += static_cast<char>('a' + data[0] % 26);
    });
    for (uint8_t i = 0; i < 100; ++i) lossy.Publish("x", &i, 1);
    hub.HandleAll();
    return heard;
  };
  EXPECT_EQ(pattern(1), pattern(1));
  EXPECT_NE(pattern(1), pattern(2));
}

class OutboxTest : public testing::Test {
 protected:
  OutboxTest() {
    heard_bus_->SubscribePrefix(
        "", [this](std::string_view channel, const uint8_t* data, size_t size) {
          heard_.emplace_back(std::string(channel), std::vector<uint8_t>(data, data + size));
        });
  }
  void SendStatus(Outbox* outbox, int64_t tick) {
    morphbus::status_t status;
    status.module_id = 1;
    status.incarnation = 1;
    status.role = -1;
    status.frozen = status.has_pose = status.pose_stale = 0;
    status.num_labels = status.num_joints = status.num_tasks = status.num_faults =
        status.num_prints = status.num_inspections = 0;
    status.tasks_omitted = status.ended_behaviors = status.startup_ended = 0;
    status.faults_dropped = status.prints_dropped = 0;
    outbox->Send("run/m1/STATUS", tick, tick * 20000, &status);
    hub_.HandleAll();
  }

  InprocHub hub_;
  std::unique_ptr<Bus> bus_ = hub_.Connect(), heard_bus_ = hub_.Connect();
  Ledger ledger_;
  Sender sender_{"run", "m1", 7, 8};
  std::vector<std::pair<std::string, std::vector<uint8_t>>> heard_;
};

TEST_F(OutboxTest, NumbersMessagesAndRepeatsThemByteForByte) {
  Outbox outbox(bus_.get(), sender_, &ledger_);
  for (int64_t tick = 0; tick < 40; ++tick) SendStatus(&outbox, tick);
  ASSERT_EQ(heard_.size(), 40u);
  for (size_t i = 0; i < heard_.size(); ++i) {
    morphbus::status_t status;
    ASSERT_TRUE(Decode(heard_[i].second.data(), heard_[i].second.size(), {7, 8}, &status));
    EXPECT_EQ(status.header.sequence, static_cast<int64_t>(i));
  }
  EXPECT_EQ(outbox.count("run/m1/STATUS"), 40);
  EXPECT_EQ(outbox.Resend("run/m1/STATUS", 0, 1000), kKeptTicks) << "the last 16 ticks are kept";
  hub_.HandleAll();
  for (size_t i = 0; i < 16; ++i) EXPECT_EQ(heard_[40 + i], heard_[24 + i]);
  EXPECT_EQ(outbox.Resend("run/m1/STATUS", 0, 23), 0);
  EXPECT_EQ(outbox.Resend("run/m2/STATUS", 0, 99), 0);
  EXPECT_EQ(outbox.Resend("run/m1/STATUS", 30, 29), 0);
  EXPECT_EQ(ledger_.sent, 40);
  EXPECT_EQ(ledger_.resent, 16);
}

TEST_F(OutboxTest, TotalsAreTheHashOfAllPayloadsAndResendsDoNotCount) {
  Outbox outbox(bus_.get(), sender_, &ledger_);
  StreamHash expected;
  for (int64_t tick = 0; tick < 40; ++tick) {
    SendStatus(&outbox, tick);
    expected.Update(heard_.back().second.data(), heard_.back().second.size());
    outbox.Resend("run/m1/STATUS", tick, tick);
    hub_.HandleAll();
  }
  ASSERT_EQ(outbox.totals().size(), 1u);
  EXPECT_EQ(outbox.totals()[0].count, 40);
  EXPECT_EQ(static_cast<uint64_t>(outbox.totals()[0].chained_hash), expected.Digest());
}

TEST_F(OutboxTest, ASavedOutboxGoesOnAsIfNothingHadHappened) {
  Outbox whole(bus_.get(), sender_, &ledger_), before(bus_.get(), sender_, &ledger_);
  for (int64_t tick = 0; tick < 60; ++tick) SendStatus(&whole, tick);
  for (int64_t tick = 0; tick < 30; ++tick) SendStatus(&before, tick);
  std::vector<uint8_t> saved;
  before.Save(&saved);
  Outbox after(bus_.get(), sender_, &ledger_);
  const auto used = after.Load(saved.data(), saved.size());
  ASSERT_TRUE(used) << used.error().message;
  EXPECT_EQ(*used, saved.size());
  EXPECT_EQ(after.Resend("run/m1/STATUS", 29, 29), 1);
  for (int64_t tick = 30; tick < 60; ++tick) SendStatus(&after, tick);
  EXPECT_EQ(after.totals()[0].chained_hash, whole.totals()[0].chained_hash);
}

TEST_F(OutboxTest, HeldMessagesComeOutInOrder) {
  Outbox outbox(bus_.get(), sender_, &ledger_);
  outbox.Hold();
  SendStatus(&outbox, 0);
  SendStatus(&outbox, 1);
  EXPECT_TRUE(heard_.empty());
  outbox.Release();
  hub_.HandleAll();
  ASSERT_EQ(heard_.size(), 2u);
  morphbus::header_t header;
  ASSERT_TRUE(DecodeHeader(heard_[0].second.data(), heard_[0].second.size(), &header));
  EXPECT_EQ(header.tick, 0);
}

TEST(RunHashTest, CountsHashedChannelsUnderTheirNamesWithinTheRun) {
  const ChannelTotal a{"one/m1/STATUS", 3, 77, true}, b{"one/m2/STATUS", 3, 77, true};
  const ChannelTotal health{"one/m1/HEALTH", 9, 1, false};
  const std::string hash = RunHash({a, b});
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(RunHash({b, a, health}), hash);
  EXPECT_EQ(RunHash({{"two/m1/STATUS", 3, 77, true}, {"two/m2/STATUS", 3, 77, true}}), hash);
  EXPECT_NE(RunHash({a}), hash);
  EXPECT_NE(RunHash({a, {"one/m2/STATUS", 4, 77, true}}), hash);
  EXPECT_NE(RunHash({a, {"one/m2/STATUS", 3, 78, true}}), hash);
  EXPECT_NE(RunHash({a, {"one/m3/STATUS", 3, 77, true}}), hash);
}

TEST(StreamHashTest, ChainsTheHashesOfPayloads) {
  // XXH3_64bits of the empty input, from xxHash's own specification.
  EXPECT_EQ(DigestOf(nullptr, 0), 0x2d06800538d394c2u);
  EXPECT_EQ(StreamHash().Digest(), 0u);
  // The link of the empty payload, put together by hand.
  const std::vector<uint8_t> link = {0,    0,    0,    0,    0,    0,    0,    0,
                                     0x2d, 0x06, 0x80, 0x05, 0x38, 0xd3, 0x94, 0xc2};
  StreamHash hash;
  hash.Update(nullptr, 0);
  EXPECT_EQ(hash.Digest(), DigestOf(link.data(), link.size()));
}

TEST(StreamHashTest, TellsOrderAndBoundariesOfPayloads) {
  const std::vector<uint8_t> a = {1, 2}, b = {3}, both = {1, 2, 3};
  const auto hash_of = [](const std::vector<std::vector<uint8_t>>& payloads) {
    StreamHash hash;
    for (const std::vector<uint8_t>& payload : payloads) {
      hash.Update(payload.data(), payload.size());
    }
    return hash.Digest();
  };
  EXPECT_NE(hash_of({a, b}), hash_of({b, a}));
  EXPECT_NE(hash_of({a, b}), hash_of({both}));
  EXPECT_NE(hash_of({a}), hash_of({a, a}));
  // A process that goes on with the value goes on with the chain.
  StreamHash resumed;
  resumed.Resume(hash_of({a}));
  resumed.Update(b.data(), b.size());
  EXPECT_EQ(resumed.Digest(), hash_of({a, b}));
}

}  // namespace
}  // namespace morphbus::bridge
