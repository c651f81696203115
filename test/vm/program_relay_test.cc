#include "vm/spread/program_relay.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

namespace morphbus::vm {
namespace {

std::vector<uint8_t> Image(uint32_t size, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<uint8_t> bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  return bytes;
}

/// A row of relays; each hears its two neighbours' messages of the last tick.
class Row {
 public:
  explicit Row(int n, double loss = 0) : loss_(loss) {
    const std::vector<uint8_t> first = Image(700, 1);
    for (int i = 0; i < n; ++i) {
      states_.push_back(std::make_unique<RelayState>());
      relays_.emplace_back(states_.back().get());
      relays_.back().Start(first.data(), 700, 1);
    }
    messages_.resize(static_cast<size_t>(n));
  }
  ProgramRelay& operator[](int i) { return relays_[static_cast<size_t>(i)]; }

  /// `accepts` is the verifier.
  template <typename Accepts>
  void Tick(Accepts accepts) {
    std::vector<NeighbourMessage> next(messages_.size());
    std::uniform_real_distribution<double> chance(0, 1);
    for (size_t i = 0; i < relays_.size(); ++i) {
      TickInput input;
      if (i > 0 && chance(random_) >= loss_) input.messages[0] = &messages_[i - 1];
      if (i + 1 < relays_.size() && chance(random_) >= loss_) input.messages[1] = &messages_[i + 1];
      relays_[i].Receive(input);
      if (relays_[i].ready()) {
        if (accepts(relays_[i]))
          relays_[i].Accept();
        else
          relays_[i].Refuse();
      }
      relays_[i].Fill(&next[i]);
    }
    messages_ = next;
  }
  void Tick(int count) {
    for (int i = 0; i < count; ++i) Tick([](const ProgramRelay&) { return true; });
  }
  bool AllRun(const std::vector<uint8_t>& image) {
    for (ProgramRelay& relay : relays_) {
      if (relay.running_size() != image.size() ||
          !std::equal(image.begin(), image.end(), relay.running_image())) {
        return false;
      }
    }
    return true;
  }

 private:
  double loss_;
  std::mt19937_64 random_{3};
  std::vector<std::unique_ptr<RelayState>> states_;
  std::vector<ProgramRelay> relays_;
  std::vector<NeighbourMessage> messages_;
};

TEST(ProgramRelayTest, ANewProgramGivenToOneReplacesTheOldOnAll) {
  Row row(5);
  row.Tick(3);
  const std::vector<uint8_t> image = Image(5000, 2);
  row[2].Deploy(image.data(), 5000, 99);
  row.Tick(100);
  EXPECT_TRUE(row.AllRun(image));
}

TEST(ProgramRelayTest, PiecesGoOutAtOneATick) {
  Row row(2);
  const std::vector<uint8_t> image = Image(64 * kFragmentBytes, 2);
  row[0].Deploy(image.data(), 64 * kFragmentBytes, 99);
  row.Tick(64 + 8);
  EXPECT_TRUE(row.AllRun(image));
}

TEST(ProgramRelayTest, LossesOnlyDelay) {
  Row row(4, 0.4);
  const std::vector<uint8_t> image = Image(9000, 2);
  row[0].Deploy(image.data(), 9000, 99);
  row.Tick(1500);
  EXPECT_TRUE(row.AllRun(image));
}

TEST(ProgramRelayTest, TheLargestImagePasses) {
  Row row(2);
  const std::vector<uint8_t> image = Image(kMaxImageBytes, 4);
  row[1].Deploy(image.data(), kMaxImageBytes, 7);
  row.Tick(400);
  EXPECT_TRUE(row.AllRun(image));
}

TEST(ProgramRelayTest, OfTwoDeployedAtOnceOneWinsEverywhere) {
  Row row(6);
  const std::vector<uint8_t> a = Image(3000, 2), b = Image(4000, 3);
  row[0].Deploy(a.data(), 3000, 50);
  row[5].Deploy(b.data(), 4000, 60);
  row.Tick(300);
  EXPECT_TRUE(row.AllRun(b));
}

TEST(ProgramRelayTest, ALaterDeploymentOvertakesAnEarlierOne) {
  Row row(6);
  const std::vector<uint8_t> a = Image(9000, 2), b = Image(2000, 3);
  row[0].Deploy(a.data(), 9000, 50);
  row.Tick(60);
  row[0].Deploy(b.data(), 2000, 40);
  row.Tick(300);
  EXPECT_TRUE(row.AllRun(b));
}

TEST(ProgramRelayTest, ARefusedImageIsNotAskedForAgain) {
  Row row(3);
  const std::vector<uint8_t> old = Image(700, 1);
  const std::vector<uint8_t> image = Image(2000, 2);
  row[0].Deploy(image.data(), 2000, 99);
  int asked = 0;
  // The first runs it; the others' verifier refuses it.
  const auto accepts = [&](const ProgramRelay& relay) {
    asked += &relay == &row[0] ? 0 : 1;
    return &relay == &row[0];
  };
  for (int i = 0; i < 200; ++i) row.Tick(accepts);
  EXPECT_EQ(asked, 1);  // The third never hears of it: the second does not run it.
  EXPECT_EQ(row[1].running_size(), 700u);
  EXPECT_TRUE(std::equal(old.begin(), old.end(), row[1].running_image()));
}

TEST(ProgramRelayTest, PiecesThatContradictEachOtherAreDropped) {
  RelayState state;
  ProgramRelay relay(&state);
  const std::vector<uint8_t> image = Image(700, 1);
  relay.Start(image.data(), 700, 1);
  NeighbourMessage message;
  message.news.version = 2;
  message.news.hash = 5;
  ProgramFragment& piece = message.fragment;
  piece.version = 2;
  piece.hash = 5;
  TickInput input;
  input.messages[0] = &message;
  const auto receive = [&](uint32_t image_size, uint32_t offset, uint16_t size) {
    piece.image_size = image_size;
    piece.offset = offset;
    piece.size = size;
    relay.Receive(input);
  };
  receive(kMaxImageBytes + 1, 0, kFragmentBytes);
  receive(0, 0, 1);
  receive(600, 100, kFragmentBytes);
  receive(600, 768, kFragmentBytes);
  receive(600, 512, kFragmentBytes);
  receive(600, 0xffffff00u, kFragmentBytes);
  EXPECT_EQ(state.incoming.image_size, 0u);
  receive(600, 0, kFragmentBytes);
  EXPECT_EQ(state.pieces_missing, 2u);
  receive(5000, 256, kFragmentBytes);
  EXPECT_EQ(state.pieces_missing, 2u);
  receive(600, 512, 88);
  receive(600, 256, kFragmentBytes);
  EXPECT_TRUE(relay.ready());
}

}  // namespace
}  // namespace morphbus::vm
