// Long messages put together from their fragments, and what LCM's numbers tell of losses.

#include "bridge/bus/lcm_fragments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bridge/bus/lcm_senders.h"

namespace morphbus::bridge {
namespace {

using Datagrams = std::vector<std::vector<uint8_t>>;

void AppendBig(std::vector<uint8_t>* out, uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out->push_back(static_cast<uint8_t>(value >> 8 * i));
}

/// A payload of `size` bytes, all of which tell where they stand.
std::vector<uint8_t> Payload(size_t size) {
  std::vector<uint8_t> payload(size);
  for (size_t i = 0; i < size; ++i) payload[i] = static_cast<uint8_t>(i * 7 + i / 256);
  return payload;
}

/// The fragments of a message, `each` bytes in each, as LCM sends them.
Datagrams Split(uint32_t sequence, const std::string& channel, const std::vector<uint8_t>& payload,
                size_t each) {
  Datagrams out;
  const size_t count = (payload.size() + each - 1) / each;
  for (size_t i = 0; i < count; ++i) {
    std::vector<uint8_t> bytes;
    AppendBig(&bytes, 0x4c433033, 4);
    AppendBig(&bytes, sequence, 4);
    AppendBig(&bytes, payload.size(), 4);
    AppendBig(&bytes, i * each, 4);
    AppendBig(&bytes, i, 2);
    AppendBig(&bytes, count, 2);
    if (i == 0) {
      bytes.insert(bytes.end(), channel.begin(), channel.end());
      bytes.push_back(0);
    }
    const size_t end = std::min(payload.size(), (i + 1) * each);
    bytes.insert(bytes.end(), payload.begin() + static_cast<ptrdiff_t>(i * each),
                 payload.begin() + static_cast<ptrdiff_t>(end));
    out.push_back(bytes);
  }
  return out;
}

struct Listener {
  explicit Listener(const LcmFragments::Limits& limits = {}) : fragments(limits) {}
  LcmFragments fragments;
  std::vector<std::string> channels;
  std::vector<std::vector<uint8_t>> payloads;

  void Take(uint64_t sender, const std::vector<uint8_t>& datagram) {
    fragments.Take(sender, datagram.data(), datagram.size(),
                   [&](std::string_view channel, const uint8_t* data, size_t size) {
                     channels.emplace_back(channel);
                     payloads.emplace_back(data, data + size);
                   });
  }
  void Take(uint64_t sender, const Datagrams& datagrams) {
    for (const auto& datagram : datagrams) Take(sender, datagram);
  }
};

TEST(LcmFragments, AMessageIsPutTogetherAndNothingIsKept) {
  Listener listener;
  const std::vector<uint8_t> payload = Payload(200'000);
  listener.Take(1, Split(7, "CAMERA", payload, 65'000));
  ASSERT_EQ(listener.channels, std::vector<std::string>{"CAMERA"});
  EXPECT_EQ(listener.payloads[0], payload);
  EXPECT_EQ(listener.fragments.bytes(), 0u);
  EXPECT_EQ(listener.fragments.given_up(), 0);
}

TEST(LcmFragments, SendersDoNotDisturbEachOther) {
  Listener listener;
  const Datagrams a = Split(1, "A", Payload(1000), 300);
  const Datagrams b = Split(1, "B", Payload(900), 300);
  for (size_t i = 0; i < 4; ++i) {
    listener.Take(1, a[i]);
    if (i < 3) listener.Take(2, b[i]);
  }
  EXPECT_EQ(listener.channels, (std::vector<std::string>{"B", "A"}));
}

TEST(LcmFragments, AMessageWithoutOneOfItsFragmentsIsGivenUpOnceAndTheNextOneComes) {
  for (size_t lost = 0; lost < 4; ++lost) {
    Listener listener;
    Datagrams broken = Split(1, "A", Payload(1000), 300);
    broken.erase(broken.begin() + static_cast<ptrdiff_t>(lost));
    listener.Take(1, broken);
    listener.Take(1, Split(2, "B", Payload(1000), 300));
    EXPECT_EQ(listener.channels, std::vector<std::string>{"B"}) << lost;
    EXPECT_EQ(listener.fragments.given_up(), 1) << lost;
  }
}

TEST(LcmFragments, MemoryGrowsByWhatCameNotByWhatIsClaimed) {
  Listener listener;
  // The first fragment, of a message that is as long as is allowed.
  Datagrams claim = Split(1, "A", Payload(60'000), 100);
  claim[0][8] = 0x02;
  claim[0][9] = claim[0][10] = claim[0][11] = 0;
  for (uint64_t sender = 0; sender < 10'000; ++sender) listener.Take(sender, claim[0]);
  EXPECT_LE(listener.fragments.bytes(), 64u * 100);
  EXPECT_EQ(listener.fragments.given_up(), 10'000 - 64);
}

TEST(LcmFragments, TheOldestMessageGivesWayWhenThereIsNoRoom) {
  Listener listener({1000, 1500, 64});
  const Datagrams a = Split(1, "A", Payload(1000), 200);
  const Datagrams b = Split(1, "B", Payload(1000), 200);
  for (size_t i = 0; i < 4; ++i) listener.Take(1, a[i]);
  listener.Take(2, b);
  listener.Take(1, a[4]);
  EXPECT_EQ(listener.channels, std::vector<std::string>{"B"});
  EXPECT_EQ(listener.fragments.given_up(), 1);
  listener.Take(3, Split(1, "TOO_LONG", Payload(1001), 200));
  EXPECT_EQ(listener.fragments.given_up(), 2);
}

TEST(LcmFragments, FragmentsThatContradictEachOtherAreGivenUp) {
  for (const size_t place : {size_t{9}, size_t{14}, size_t{17}, size_t{19}}) {
    Listener listener;
    Datagrams message = Split(1, "A", Payload(1000), 300);
    message[2][place] = static_cast<uint8_t>(message[2][place] + 1);
    listener.Take(1, message);
    EXPECT_TRUE(listener.channels.empty()) << place;
    EXPECT_EQ(listener.fragments.given_up(), 1) << place;
    EXPECT_EQ(listener.fragments.bytes(), 0u) << place;
  }
}

TEST(LcmFragments, ShortBytesAreNone) {
  Listener listener;
  const std::vector<uint8_t> whole = Split(1, "A", Payload(100), 100)[0];
  for (size_t size = 0; size < whole.size(); ++size) {
    Listener cut;
    cut.Take(1, std::vector<uint8_t>(whole.begin(), whole.begin() + static_cast<ptrdiff_t>(size)));
    EXPECT_TRUE(cut.channels.empty()) << size;
  }
  listener.Take(1, whole);
  EXPECT_EQ(listener.channels.size(), 1u);
}

TEST(LcmSenders, GapsAreLossesUntilTheyAreFilled) {
  LcmSenders senders;
  for (const uint32_t sequence : {5u, 6u, 6u, 9u, 10u}) senders.Take(1, sequence);
  EXPECT_EQ(senders.lost(), 2);
  senders.Take(1, 7);
  EXPECT_EQ(senders.lost(), 1);
  senders.Take(2, 100);
  EXPECT_EQ(senders.lost(), 1);
  EXPECT_EQ(senders.size(), 2u);
}

TEST(LcmSenders, NumbersGoRoundAndJumpsAreNoLosses) {
  LcmSenders senders;
  for (const uint32_t sequence : {0xFFFFFFFEu, 0xFFFFFFFFu, 0u, 2u}) senders.Take(1, sequence);
  EXPECT_EQ(senders.lost(), 1);
  senders.Take(1, 1'000'000);
  senders.Take(1, 1'000'001);
  senders.Take(1, 3);
  senders.Take(1, 4);
  EXPECT_EQ(senders.lost(), 1);
}

TEST(LcmSenders, ManySendersAreForgottenNotKept) {
  LcmSenders senders;
  for (uint64_t sender = 0; sender < 100'000; ++sender) senders.Take(sender, 1);
  EXPECT_EQ(senders.size(), LcmSenders::kMost);
}

}  // namespace
}  // namespace morphbus::bridge
