// Replays with followers: each gets every message exactly once and in order, whatever the bus
// loses.

#include "logger/log/replay_delivery.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bridge/bus/inproc_bus.h"
#include "logger/log/replayer.h"
#include "test/logger/temp_log.h"

namespace morphbus::logger {
namespace {

using FollowedMessage = std::pair<std::string, std::vector<uint8_t>>;

/// A bus that loses a share of what it delivers to its participant.
class LossyBus : public bridge::Bus {
 public:
  LossyBus(std::unique_ptr<bridge::Bus> bus, double loss, uint32_t seed)
      : bus_(std::move(bus)), loss_(loss), random_(seed) {}
  void Publish(const std::string& channel, const uint8_t* data, size_t size) override {
    bus_->Publish(channel, data, size);
  }
  void Receive(const bridge::Channels& channels, Handler handler) override {
    bus_->Receive(channels, Lossy(std::move(handler)));
  }
  void Unsubscribe(const std::string& channel) override { bus_->Unsubscribe(channel); }
  int HandleFor(int64_t timeout_us) override { return bus_->HandleFor(timeout_us); }

 private:
  Handler Lossy(Handler handler) {
    return [this, handler = std::move(handler)](std::string_view channel, const uint8_t* data,
                                                size_t size) {
      if (std::uniform_real_distribution<double>(0, 1)(random_) >= loss_) {
        handler(channel, data, size);
      }
    };
  }

  std::unique_ptr<bridge::Bus> bus_;
  double loss_;
  std::mt19937 random_;
};

TEST(BatchSumTest, EveryByteOfNamesAndPayloadsCounts) {
  const auto sum_of = [](std::string_view channel, const std::vector<uint8_t>& data) {
    BatchSum sum;
    sum.Add(channel, data);
    return sum.hash();
  };
  const std::vector<uint8_t> data(64, 7);
  const std::string channel = "a-run-with-a-name/m1/ACTUATOR";
  for (size_t i = 0; i < channel.size(); ++i) {
    std::string other = channel;
    other[i] = 'x';
    EXPECT_NE(sum_of(other, data), sum_of(channel, data)) << i;
  }
  // CRC and auth, which are outside the run's hash, are part of what a log holds.
  for (size_t i = 0; i < data.size(); ++i) {
    std::vector<uint8_t> other = data;
    ++other[i];
    EXPECT_NE(sum_of(channel, other), sum_of(channel, data)) << i;
  }
}

/// A replay and its followers in virtual time.
class Delivery {
 public:
  Delivery(const std::string& path, ReplayOptions options, double loss, int num_followers)
      : player_bus_(hub_.Connect(), loss, 1) {
    options.listen_us = 0;
    auto opened = Replayer::Open(path, options);
    EXPECT_TRUE(opened.has_value());
    replayer = std::move(*opened);
    replayer->Start(&player_bus_, now_us);
    got.resize(static_cast<size_t>(num_followers));
    for (int i = 0; i < num_followers; ++i) Join(i, loss);
  }
  void Join(int i, double loss) {
    buses_.push_back(std::make_unique<LossyBus>(hub_.Connect(), loss, 100 + i));
    followers.push_back(std::make_unique<ReplayFollower>(
        buses_.back().get(), "synth", "F" + std::to_string(i),
        [this, i](std::string_view channel, std::span<const uint8_t> data) {
          got[i].emplace_back(channel, std::vector<uint8_t>(data.begin(), data.end()));
        }));
  }
  /// Plays until the end or `until_us`; false if it is still going.
  bool Play(int64_t until_us) {
    while (now_us < until_us) {
      for (auto& follower : followers) follower->Advance(now_us);
      const std::optional<int64_t> again = replayer->Advance(now_us);
      hub_.HandleAll();
      if (!again) return true;
      now_us = std::max(now_us + 1, std::min(*again, now_us + 50'000));
    }
    return false;
  }

  bridge::InprocHub hub_;
  LossyBus player_bus_;
  std::vector<std::unique_ptr<LossyBus>> buses_;
  std::unique_ptr<Replayer> replayer;
  std::vector<std::unique_ptr<ReplayFollower>> followers;
  std::vector<std::vector<FollowedMessage>> got;
  int64_t now_us = 5'000'000;
};

/// What a replay publishes of the synthetic log.
std::vector<FollowedMessage> Published() {
  std::vector<FollowedMessage> messages;
  for (const test::SyntheticEvent& event : test::SyntheticEvents({})) {
    if (event.channel != "synth/END") messages.emplace_back(event.channel, event.payload);
  }
  return messages;
}

constexpr int64_t kLongUs = 10'000'000'000;

TEST(ReplayDeliveryTest, EveryFollowerGetsEveryMessageOnceAtAnySpeedWhateverIsLost) {
  const TempLog file;
  const std::vector<FollowedMessage> expected = Published();
  for (const double speed : {0.0, 1.0, 100.0}) {
    for (const double loss : {0.0, 0.02, 0.1}) {
      // Of 64 messages, of which a tenth is lost, hardly ever all come; slow replays have smaller
      // batches.
      if (loss > 0.05 && speed != 1.0) continue;
      Delivery delivery(file.path(), {.speed = speed, .wait_for = 3}, loss, 3);
      ASSERT_TRUE(delivery.Play(kLongUs)) << speed << " " << loss;
      int64_t again = 0;
      for (size_t i = 0; i < delivery.got.size(); ++i) {
        EXPECT_EQ(delivery.got[i], expected) << speed << " " << loss << " follower " << i;
        EXPECT_TRUE(delivery.followers[i]->finished());
        again += delivery.followers[i]->asked_again();
      }
      EXPECT_EQ(again > 0, loss > 0);
      EXPECT_EQ(delivery.replayer->progress().lost_followers, 0);
      EXPECT_EQ(delivery.replayer->progress().published, static_cast<int64_t>(expected.size()));
    }
  }
}

TEST(ReplayDeliveryTest, AFollowerThatIsGoneIsGivenUpAndTheOthersGetTheRest) {
  const TempLog file;
  Delivery delivery(file.path(), {.speed = 1, .wait_for = 2}, 0, 2);
  ASSERT_FALSE(delivery.Play(delivery.now_us + 1'000'000));
  delivery.followers[0].reset();
  delivery.followers.erase(delivery.followers.begin());
  ASSERT_TRUE(delivery.Play(kLongUs));
  EXPECT_EQ(delivery.replayer->progress().lost_followers, 1);
  EXPECT_EQ(delivery.got[1], Published());
}

TEST(ReplayDeliveryTest, WhoJoinsLaterGetsAllFromThenOn) {
  const TempLog file;
  Delivery delivery(file.path(), {.speed = 1}, 0, 0);
  ASSERT_FALSE(delivery.Play(delivery.now_us + 1'000'000));
  delivery.got.resize(1);
  delivery.Join(0, 0.02);
  ASSERT_TRUE(delivery.Play(kLongUs));
  const std::vector<FollowedMessage> all = Published();
  const std::vector<FollowedMessage>& got = delivery.got[0];
  ASSERT_GT(got.size(), 300u);
  ASSERT_LT(got.size(), all.size());
  EXPECT_TRUE(std::equal(got.begin(), got.end(), all.end() - static_cast<ptrdiff_t>(got.size())));
}

TEST(ReplayDeliveryTest, PausedReplaysKeepTheirFollowersAndSilentOnesLoseThem) {
  const TempLog file;
  Delivery delivery(file.path(), {.speed = 1, .wait_for = 1}, 0, 1);
  delivery.Play(delivery.now_us + 500'000);
  delivery.replayer->Pause(delivery.now_us);
  delivery.Play(delivery.now_us + 60'000'000);
  EXPECT_FALSE(delivery.followers[0]->abandoned());
  delivery.replayer->Resume(delivery.now_us);
  ASSERT_TRUE(delivery.Play(kLongUs));
  EXPECT_EQ(delivery.got[0], Published());
  // A follower of a replay that is gone notices.
  Delivery gone(file.path(), {.speed = 1, .wait_for = 1}, 0, 1);
  gone.Play(gone.now_us + 500'000);
  gone.followers[0]->Advance(gone.now_us);
  gone.followers[0]->Advance(gone.now_us + kFollowPatienceUs + 1'000'000);
  EXPECT_TRUE(gone.followers[0]->abandoned());
}

TEST(ReplayDeliveryTest, OnlyWhatAReplayOfTheRunPublishesIsFollowed) {
  EXPECT_TRUE(IsFollowed("walk", "walk/m1/STATUS", 100));
  EXPECT_TRUE(IsFollowed("walk", "walk/INFO", 100));
  for (const char* channel : {"walk/LOG/RESEND", "walk/LOG/BATCH", "walk/SIM/LEAVE", "walk/HELLO",
                              "walk/CONTROL", "walk/END", "x/m1/STATUS", "EXAMPLE"}) {
    EXPECT_FALSE(IsFollowed("walk", channel, 100)) << channel;
  }
  EXPECT_FALSE(IsFollowed("walk", "walk/m1/STATUS", 70'000));
}

}  // namespace
}  // namespace morphbus::logger
