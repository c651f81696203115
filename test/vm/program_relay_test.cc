#include "vm/spread/program_relay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "test/support/flash_store.h"

namespace morphbus::vm {
namespace {

std::vector<uint8_t> Image(uint32_t size, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<uint8_t> bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  return bytes;
}

/// A package of random bytes, of this size with its head; the relay does not look into it.
std::vector<uint8_t> PackageBytes(uint32_t size, uint64_t seed, int64_t switch_tick = 0) {
  std::vector<uint8_t> bytes(kPackageHeadBytes);
  WritePackageHead({switch_tick, 0}, bytes.data());
  const std::vector<uint8_t> image = Image(size - kPackageHeadBytes, seed);
  bytes.insert(bytes.end(), image.begin(), image.end());
  return bytes;
}

/// A row of relays; each hears its two neighbours' messages of the last tick.
class Row {
 public:
  explicit Row(int n, double loss = 0, uint64_t seed = 3) : loss_(loss), random_(seed) {
    for (int i = 0; i < n; ++i) {
      states_.push_back(std::make_unique<RelayState>());
      stores_.push_back(std::make_unique<test::FlashStore>());
      relays_.push_back(std::make_unique<ProgramRelay>(first_.data(), 700, states_.back().get(),
                                                       stores_.back().get()));
      relays_.back()->Start(1);
    }
    messages_.resize(static_cast<size_t>(n));
  }
  ProgramRelay& operator[](int i) { return *relays_[static_cast<size_t>(i)]; }
  RelayState& state(int i) { return *states_[static_cast<size_t>(i)]; }
  void Deploy(int i, const std::vector<uint8_t>& package, uint64_t id) {
    (*this)[i].Deploy(package.data(), static_cast<uint32_t>(package.size()), id);
  }
  test::FlashStore& store(int i) { return *stores_[static_cast<size_t>(i)]; }
  /// This one says that it takes no larger pieces, as one of a smaller profile, and is held to it.
  void SetPieceBytes(int i, uint16_t bytes) {
    piece_bytes_.resize(messages_.size(), kFragmentBytes);
    piece_bytes_[static_cast<size_t>(i)] = bytes;
  }
  /// Another relay in the place of one; it outlives the row.
  void Replace(int i, const ProgramRelay& relay) {
    relays_[static_cast<size_t>(i)] = std::make_unique<ProgramRelay>(relay);
  }
  /// A silent relay is as good as gone.
  void SetSilent(int i) { silent_ = i; }

  /// `accepts` is the verifier; what it accepts runs at once, or waits.
  template <typename Accepts>
  void Tick(Accepts accepts, bool at_once = true) {
    ++tick_;
    std::vector<NeighbourMessage> next(messages_.size());
    std::uniform_real_distribution<double> chance(0, 1);
    for (size_t i = 0; i < relays_.size(); ++i) {
      TickInput input;
      input.tick = tick_;
      if (static_cast<int>(i) == silent_) continue;
      const auto hears = [&](size_t other) {
        return other < relays_.size() && static_cast<int>(other) != silent_ &&
               chance(random_) >= loss_;
      };
      if (hears(i - 1)) input.messages[0] = &messages_[i - 1];
      if (hears(i + 1)) input.messages[1] = &messages_[i + 1];
      ProgramRelay& relay = *relays_[i];
      for (const NeighbourMessage* message : input.messages) {
        // Before a first word of it nobody can know.
        if (message != nullptr && tick_ > 2) {
          EXPECT_LE(message->fragment.size, PieceBytes(i)) << "module " << i;
        }
      }
      relay.Receive(input);
      if (relay.ready()) accepts(relay) ? relay.Keep() : relay.Refuse();
      if (at_once && relay.verified()) relay.Accept();
      relay.Fill(&next[i]);
      next[i].news.piece_bytes = PieceBytes(i);
    }
    messages_ = next;
  }
  void Tick(int count, bool at_once = true) {
    for (int i = 0; i < count; ++i) Tick([](const ProgramRelay&) { return true; }, at_once);
  }
  bool Runs(int i, const std::vector<uint8_t>& package) {
    const ProgramRelay& relay = (*this)[i];
    return relay.running_size() + kPackageHeadBytes == package.size() &&
           std::equal(package.begin() + kPackageHeadBytes, package.end(), relay.running_image());
  }
  bool AllRun(const std::vector<uint8_t>& package) {
    for (int i = 0; i < size(); ++i) {
      if (!Runs(i, package)) return false;
    }
    return true;
  }
  [[nodiscard]] int size() const { return static_cast<int>(relays_.size()); }

 private:
  [[nodiscard]] uint16_t PieceBytes(size_t i) const {
    return piece_bytes_.empty() ? static_cast<uint16_t>(kFragmentBytes) : piece_bytes_[i];
  }
  const std::vector<uint8_t> first_ = Image(700, 1);
  double loss_;
  int64_t tick_ = 0;
  int silent_ = -1;
  std::mt19937_64 random_;
  std::vector<std::unique_ptr<RelayState>> states_;
  std::vector<std::unique_ptr<test::FlashStore>> stores_;
  std::vector<std::unique_ptr<ProgramRelay>> relays_;
  std::vector<uint16_t> piece_bytes_;
  std::vector<NeighbourMessage> messages_;
};

/// That a program which one relay is given runs on all of the row after so many ticks.
void ExpectSpreads(Row* row, int from, const std::vector<uint8_t>& package, int ticks) {
  row->Deploy(from, package, 99);
  row->Tick(ticks);
  EXPECT_TRUE(row->AllRun(package));
}

TEST(ProgramRelayTest, ANewProgramGivenToOneReplacesTheOldOnAll) {
  Row row(5);
  row.Tick(3);
  ExpectSpreads(&row, 2, PackageBytes(5000, 2), 100);
}

TEST(ProgramRelayTest, PiecesGoOutAtOneATick) {
  Row row(2);
  ExpectSpreads(&row, 0, PackageBytes(64 * kFragmentBytes, 2), 64 + 8);
}

TEST(ProgramRelayTest, LossesOnlyDelay) {
  Row row(4, 0.4);
  ExpectSpreads(&row, 0, PackageBytes(9000, 2), 1500);
}

TEST(ProgramRelayTest, TheLargestImagePasses) {
  Row row(2);
  ExpectSpreads(&row, 1, PackageBytes(kMaxPackageBytes, 4), 400);
}

TEST(ProgramRelayTest, OfTwoDeployedAtOnceOneWinsEverywhere) {
  // The higher id wins, be it of the one or of the other, and whether they run at once or wait.
  for (const bool at_once : {true, false}) {
    for (const uint64_t id_a : {uint64_t{50}, uint64_t{70}}) {
      Row row(6);
      const std::vector<uint8_t> a = PackageBytes(3000, 2, at_once ? 0 : 900);
      const std::vector<uint8_t> b = PackageBytes(4000, 3, at_once ? 0 : 800);
      row.Deploy(0, a, id_a);
      row.Deploy(5, b, 60);
      row.Tick(300, at_once);
      if (!at_once) row.Tick(1);
      EXPECT_TRUE(row.AllRun(id_a > 60 ? a : b)) << "at once: " << at_once << ", id " << id_a;
    }
  }
}

TEST(ProgramRelayTest, ALaterDeploymentOvertakesAnEarlierOne) {
  Row row(6);
  const std::vector<uint8_t> a = PackageBytes(9000, 2), b = PackageBytes(2000, 3);
  row.Deploy(0, a, 50);
  row.Tick(60);
  row.Deploy(0, b, 40);
  row.Tick(300);
  EXPECT_TRUE(row.AllRun(b));
}

TEST(ProgramRelayTest, ARefusedImageIsNotAskedForAgain) {
  Row row(3);
  const std::vector<uint8_t> image = PackageBytes(2000, 2);
  row.Deploy(0, image, 99);
  int asked = 0;
  // The first runs it; the others' verifier refuses it.
  const auto accepts = [&](const ProgramRelay& relay) {
    asked += &relay == &row[0] ? 0 : 1;
    return &relay == &row[0];
  };
  for (int i = 0; i < 200; ++i) row.Tick(accepts);
  EXPECT_EQ(asked, 1);  // The third never hears of it: the second does not run it.
  EXPECT_TRUE(row.Runs(1, PackageBytes(700 + kPackageHeadBytes, 1))) << "the old goes on";
}

TEST(ProgramRelayTest, WhatIsHeldIsHandedOnBeforeItRuns) {
  Row row(4);
  const std::vector<uint8_t> old = PackageBytes(700 + kPackageHeadBytes, 1);
  const std::vector<uint8_t> image = PackageBytes(3000, 2, 500);
  row.Deploy(0, image, 99);
  row.Tick(100, false);
  for (int i = 0; i < row.size(); ++i) EXPECT_TRUE(row[i].verified()) << i;
  EXPECT_TRUE(row.AllRun(old));
  row.Tick(1);
  EXPECT_TRUE(row.AllRun(image)) << "all in the same tick";
}

TEST(ProgramRelayTest, SpreadTicksIsWhenTheLastOneHoldsIt) {
  for (const uint32_t size : {100u, 256u, 257u, 3000u, kMaxPackageBytes}) {
    for (const int hops : {1, 2, 5}) {
      Row row(hops + 1);
      row.Tick(3);
      row.Deploy(0, PackageBytes(size, 2, 500), 99);
      row.Tick(1, false);
      row.Tick(static_cast<int>(SpreadTicks(size, hops)) - 1, false);
      EXPECT_FALSE(row[hops].verified()) << size << " bytes over " << hops << " hops";
      row.Tick(1, false);
      EXPECT_TRUE(row[hops].verified()) << size << " bytes over " << hops << " hops";
    }
  }
}

TEST(ProgramRelayTest, LossSlowsTheSpreadByNoMoreThanDeployersReckonWith) {
  // tools/control/control_desk.cc: twice as long, over the square of the share that arrives.
  for (const double loss : {0.1, 0.3}) {
    for (uint64_t seed = 1; seed <= 20; ++seed) {
      Row row(5, loss, seed);
      row.Deploy(0, PackageBytes(4500, 2, 500), 99);
      int ticks = 0;
      while (!row[4].verified() && ticks < 10000) {
        row.Tick(1, false);
        ++ticks;
      }
      const auto reckoned =
          2 / ((1 - loss) * (1 - loss)) * static_cast<double>(SpreadTicks(4500, 4));
      EXPECT_LT(ticks, reckoned) << "loss " << loss << ", seed " << seed;
    }
  }
}

TEST(ProgramRelayTest, ANewerOneTakesThePlaceOfWhatIsHeld) {
  Row row(5);
  const std::vector<uint8_t> a = PackageBytes(3000, 2, 900), b = PackageBytes(2000, 3, 950);
  row.Deploy(0, a, 70);
  row.Tick(100, false);
  ASSERT_TRUE(row[4].verified());
  // Its id is lower, but its module has heard of the other.
  row.Deploy(4, b, 60);
  row.Tick(100, false);
  row.Tick(1);
  EXPECT_TRUE(row.AllRun(b));
}

TEST(ProgramRelayTest, WhatNobodyOffersAnyMoreIsGivenUpForAnotherOne) {
  Row row(3);
  const std::vector<uint8_t> lost = PackageBytes(20000, 2), next = PackageBytes(3000, 3);
  row.Deploy(0, lost, 99);
  row.Tick(20);
  ASSERT_NE(row.state(1).incoming.version, 0u);
  // The only one that has it whole is gone for good.
  row.SetSilent(0);
  row.Tick(static_cast<int>(kSilentTicks) + 2);
  EXPECT_EQ(row.state(1).incoming.version, 0u);
  // A later one is above the version that was lost, though nobody runs that.
  row.Deploy(2, next, 1);
  row.Tick(60);
  EXPECT_TRUE(row.Runs(1, next) && row.Runs(2, next));
}

TEST(ProgramRelayTest, VersionsStopAtTheHighestAndNeverBeginAnew) {
  RelayState state;
  test::FlashStore store;
  const std::vector<uint8_t> image = Image(700, 1), package = PackageBytes(900, 2);
  ProgramRelay relay(image.data(), 700, &state, &store);
  relay.Start(1);
  NeighbourMessage message;
  message.news.version = 0x7fffffff;
  message.news.hash = 5;
  TickInput input;
  input.messages[0] = &message;
  relay.Receive(input);
  relay.Deploy(package.data(), 900, 6);
  EXPECT_TRUE(relay.ready());
  EXPECT_EQ(state.incoming.version, 0x7fffffffu);
}

TEST(ProgramRelayTest, OfTwoAtOnceTheOneWithTheLaterNumberWins) {
  for (const bool at_first : {true, false}) {
    Row row(6);
    const std::vector<uint8_t> a = PackageBytes(3000, 2, 900), b = PackageBytes(4000, 3, 800);
    row[0].Deploy(a.data(), 3000, 50, at_first ? 3 : 2);
    row[5].Deploy(b.data(), 4000, 60, at_first ? 2 : 3);
    row.Tick(300, false);
    row.Tick(1);
    EXPECT_TRUE(row.AllRun(at_first ? a : b));
  }
}

TEST(ProgramRelayTest, EachGetsPiecesAsSmallAsItCanTake) {
  // A row whose modules are of different profiles, one with an odd capacity of its own.
  Row row(6);
  row.SetPieceBytes(1, 32);
  row.SetPieceBytes(3, 50);
  row.Tick(3);
  ExpectSpreads(&row, 0, PackageBytes(5000, 2), 800);
  // Where nobody is small, pieces are large: 5 to 4 has no small neighbour, 4 has.
  const std::vector<uint8_t> next = PackageBytes(64 * kFragmentBytes, 3);
  row.Deploy(5, next, 98);
  row.Tick(64 + 8);
  EXPECT_TRUE(row.Runs(4, next));
  EXPECT_FALSE(row.Runs(3, next));
}

TEST(ProgramRelayTest, WhoeverTookSmallPiecesAndIsGoneSlowsNobodyDown) {
  Row row(3);
  row.SetPieceBytes(2, 32);
  row.Tick(5);
  EXPECT_EQ(row.state(1).cut, 32u);
  row.SetSilent(2);
  row.Tick(static_cast<int>(kSilentTicks) + 2);
  EXPECT_EQ(row.state(1).cut, static_cast<uint32_t>(kFragmentBytes));
}

TEST(ProgramRelayTest, SmallPiecesGetThroughLosses) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Row row(4, 0.3, seed);
    row.SetPieceBytes(1, 32);
    row.Tick(3);
    row.Deploy(0, PackageBytes(3000, 2), 99);
    // Of 32 bytes each: as many ticks as deployers reckon with for a package eight times as large.
    row.Tick(static_cast<int>(2 / 0.49 * static_cast<double>(SpreadTicks(8 * 3000, 3))));
    EXPECT_TRUE(row.AllRun(PackageBytes(3000, 2))) << "seed " << seed;
  }
}

TEST(ProgramRelayTest, TheFirstProgramIsHandedOnFromWhereItLies) {
  // Module 1 was started with another program under a higher version; both relays' stores are
  // empty.
  Row row(2);
  const std::vector<uint8_t> image = Image(1000, 5);
  RelayState state;
  test::FlashStore store;
  ProgramRelay newer(image.data(), 1000, &state, &store);
  newer.Start(7, 2);
  row.Replace(1, newer);
  row.Tick(20);
  EXPECT_EQ(row[0].running_size(), 1000u);
  EXPECT_TRUE(std::equal(image.begin(), image.end(), row[0].running_image()));
  EXPECT_EQ(store.written(), 0);
}

TEST(ProgramRelayTest, AProgramThatFindsNoRoomIsRefusedAndTheOldGoesOn) {
  Row row(3);
  row.store(1).SetCapacity(1000);
  const std::vector<uint8_t> large = PackageBytes(1001, 2), small = PackageBytes(1000, 3);
  row.Deploy(0, large, 99);
  row.Tick(50);
  EXPECT_TRUE(row.Runs(0, large));
  EXPECT_TRUE(row.Runs(1, PackageBytes(700 + kPackageHeadBytes, 1)));
  EXPECT_EQ(row.state(1).refused.id, 99u);
  EXPECT_EQ(row.state(1).incoming.version, 0u);
  row.Deploy(0, small, 98);
  row.Tick(50);
  EXPECT_TRUE(row.AllRun(small));
}

TEST(ProgramRelayTest, APlaceThatKeepsNothingRefusesAndTheOldGoesOn) {
  Row row(2);
  row.store(1).SetWornOutAt(600);
  row.Deploy(0, PackageBytes(1000, 2), 99);
  row.Tick(50);
  EXPECT_TRUE(row.Runs(1, PackageBytes(700 + kPackageHeadBytes, 1)));
  EXPECT_EQ(row.state(1).refused.id, 99u);
}

TEST(ProgramRelayTest, AStateThatPointsOutOfItsStoreIsNotSound) {
  Row row(2);
  row.Deploy(0, PackageBytes(5000, 2, 900), 99);
  row.Tick(12, false);
  const RelayState good = row.state(1);
  ASSERT_TRUE(row[1].Sound());
  ASSERT_GT(good.have, 0u);
  const auto sound = [&](auto change) {
    row.state(1) = good;
    change(row.state(1));
    return row[1].Sound();
  };
  EXPECT_FALSE(sound([](RelayState& s) { s.have = s.incoming.size + 1; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.incoming.size = kMaxPackageBytes + 1; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.whole = 1; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.verified = 1; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.place = 3; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.place = 0, s.running.size = kPackageHeadBytes; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.running.size += 1; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.cut = 0; }));
  EXPECT_FALSE(sound([](RelayState& s) { s.cut = kFragmentBytes + 1; }));
}

TEST(ProgramRelayTest, ItsStateIsAFewHundredBytesAtMost) { EXPECT_LE(sizeof(RelayState), 100u); }

TEST(PackageTest, HeadAndImageAreReadBack) {
  std::vector<uint8_t> bytes = PackageBytes(300, 2);
  WritePackageHead({123456789012345, 7}, bytes.data());
  vm::Package package;
  ASSERT_TRUE(ReadPackage(bytes.data(), 300, &package));
  EXPECT_EQ(package.image, bytes.data() + kPackageHeadBytes);
  EXPECT_EQ(package.image_size, 300 - kPackageHeadBytes);
  EXPECT_EQ(package.switch_tick, 123456789012345);
  EXPECT_EQ(package.number, 7u);
}

TEST(PackageTest, WhatIsNoPackageIsRefused) {
  const std::vector<uint8_t> bytes = PackageBytes(300, 2, 7);
  vm::Package package;
  EXPECT_FALSE(ReadPackage(bytes.data(), kPackageHeadBytes, &package)) << "no image";
  for (size_t at = 0; at < 4; ++at) {
    std::vector<uint8_t> other = bytes;
    other[at] ^= 1;
    EXPECT_FALSE(ReadPackage(other.data(), 300, &package)) << "byte " << at;
  }
  EXPECT_FALSE(ReadPackage(PackageBytes(300, 2, -1).data(), 300, &package)) << "before the run";
}

TEST(PackageTest, AnIdIsOfImageAndHead) {
  EXPECT_EQ(PackageId(99, {}), 99u) << "the program that a module starts with";
  EXPECT_NE(PackageId(99, {7, 0}), 99u);
  EXPECT_NE(PackageId(99, {7, 0}), PackageId(99, {8, 0}));
  EXPECT_NE(PackageId(99, {7, 0}), PackageId(99, {7, 2}));
  EXPECT_NE(PackageId(99, {7, 0}), PackageId(98, {7, 0}));
}

TEST(ProgramRelayTest, PiecesThatContradictEachOtherAreDropped) {
  RelayState state;
  test::FlashStore store;
  const std::vector<uint8_t> image = Image(700, 1);
  ProgramRelay relay(image.data(), 700, &state, &store);
  relay.Start(1);
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
  receive(kMostPackageBytes + 1, 0, kFragmentBytes);
  receive(0, 0, 1);
  receive(600, 400, kFragmentBytes);
  receive(600, 600, 1);
  receive(600, 0xffffff00u, kFragmentBytes);
  EXPECT_EQ(state.incoming.size, 0u);
  receive(600, 0, kFragmentBytes);
  EXPECT_EQ(state.have, 256u);
  receive(5000, 256, kFragmentBytes);
  EXPECT_EQ(state.have, 256u) << "of another size";
  receive(600, 512, 88);
  EXPECT_EQ(state.have, 256u) << "there is a gap before it";
  receive(600, 100, kFragmentBytes);
  EXPECT_EQ(state.have, 356u) << "the first half of it has come before";
  receive(600, 100, kFragmentBytes);
  EXPECT_EQ(state.have, 356u);
  receive(600, 350, 250);
  EXPECT_TRUE(relay.ready());
}

}  // namespace
}  // namespace morphbus::vm
