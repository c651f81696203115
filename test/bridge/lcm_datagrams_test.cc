// LCM's datagrams put together to messages, in any order and number.

#include "bridge/bus/lcm_datagrams.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace morphbus::bridge {
namespace {

using Bytes = std::vector<uint8_t>;

void Append(Bytes* out, uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out->push_back(static_cast<uint8_t>(value >> 8 * i));
}
void Append(Bytes* out, const std::string& text) {
  out->insert(out->end(), text.begin(), text.end());
}

Bytes Short(const std::string& channel, const std::string& payload) {
  Bytes out;
  Append(&out, 0x4c433032, 4);
  Append(&out, 7, 4);
  Append(&out, channel);
  out.push_back(0);
  Append(&out, payload);
  return out;
}

/// Fragment `number` of `payload` cut into pieces of `piece` bytes.
Bytes Fragment(uint32_t sequence, const std::string& payload, size_t piece, size_t number) {
  const size_t count = (payload.size() + piece - 1) / piece;
  Bytes out;
  Append(&out, 0x4c433033, 4);
  Append(&out, sequence, 4);
  Append(&out, payload.size(), 4);
  Append(&out, number * piece, 4);
  Append(&out, number, 2);
  Append(&out, count, 2);
  if (number == 0) {
    Append(&out, "run/long");
    out.push_back(0);
  }
  Append(&out, payload.substr(number * piece, piece));
  return out;
}

struct Receiver {
  LcmDatagrams datagrams;
  std::vector<std::string> heard;

  void Take(const Bytes& bytes, uint64_t sender = 1) {
    datagrams.Take(sender, bytes.data(), bytes.size(),
                   [&](std::string_view channel, const uint8_t* data, size_t size) {
                     heard.push_back(std::string(channel) + "=" +
                                     std::string(reinterpret_cast<const char*>(data), size));
                   });
  }
};

TEST(LcmDatagrams, AShortMessageIsOneDatagram) {
  Receiver receiver;
  receiver.Take(Short("run/a", "payload"));
  receiver.Take(Short("run/b", ""));
  EXPECT_EQ(receiver.heard, (std::vector<std::string>{"run/a=payload", "run/b="}));
}

TEST(LcmDatagrams, FragmentsMayComeInAnyOrderAndTwice) {
  Receiver receiver;
  for (const size_t number : {2, 0, 2, 1, 1, 3})
    receiver.Take(Fragment(5, "0123456789", 3, number));
  EXPECT_EQ(receiver.heard, std::vector<std::string>{"run/long=0123456789"});
}

TEST(LcmDatagrams, SendersWithEqualSequenceNumbersAreKeptApart) {
  Receiver receiver;
  receiver.Take(Fragment(5, "aaaa", 2, 0), 1);
  receiver.Take(Fragment(5, "bbbb", 2, 0), 2);
  receiver.Take(Fragment(5, "bbbb", 2, 1), 2);
  receiver.Take(Fragment(5, "aaaa", 2, 1), 1);
  EXPECT_EQ(receiver.heard, (std::vector<std::string>{"run/long=bbbb", "run/long=aaaa"}));
}

TEST(LcmDatagrams, WhatContradictsItselfIsCountedAndDropped) {
  Receiver receiver;
  Bytes beyond = Fragment(1, "0123456789", 5, 1);
  beyond[15] = 9;  // The offset: its five bytes would end behind the message.
  receiver.Take(beyond);
  Bytes too_many = Fragment(2, "0123456789", 5, 1);
  too_many[17] = 2;  // Number 2 of 2.
  receiver.Take(too_many);
  Bytes huge = Fragment(3, "0123456789", 5, 1);
  huge[8] = 0xff;
  receiver.Take(huge);
  receiver.Take({});
  receiver.Take({'L', 'C', '0', '2', 0, 0, 0, 0});
  receiver.Take(Short(std::string(64, 'x'), "channel of 64 characters"));
  receiver.Take({'L', 'C', '0', '9', 0, 0, 0, 0, 'a', 0});
  EXPECT_TRUE(receiver.heard.empty());
  EXPECT_EQ(receiver.datagrams.bad(), 7);
}

TEST(LcmDatagrams, AFragmentOfAnotherShapeDoesNotJoin) {
  Receiver receiver;
  receiver.Take(Fragment(5, "0123456789", 5, 0));
  receiver.Take(Fragment(5, "01234567", 4, 1));
  EXPECT_EQ(receiver.datagrams.bad(), 1);
  receiver.Take(Fragment(5, "0123456789", 5, 1));
  EXPECT_EQ(receiver.heard, std::vector<std::string>{"run/long=0123456789"});
}

TEST(LcmDatagrams, TheOldestUnfinishedMessagesGiveWay) {
  Receiver receiver;
  const auto most = static_cast<uint32_t>(LcmDatagrams::kMostUnfinished);
  for (uint32_t i = 0; i <= most; ++i) receiver.Take(Fragment(i, "0123", 2, 0));
  EXPECT_EQ(receiver.datagrams.abandoned(), 1);
  receiver.Take(Fragment(most, "0123", 2, 1));
  EXPECT_EQ(receiver.heard.size(), 1u);
}

TEST(LcmDatagrams, MemoryIsBoundedByBytesToo) {
  Receiver receiver;
  for (uint32_t i = 0; i < 4; ++i) {
    Bytes one = Fragment(i, "0123", 2, 0);
    one[8] = 0x02;  // 32 MiB and a little.
    receiver.Take(one);
  }
  EXPECT_EQ(receiver.datagrams.abandoned(), 3);
}

}  // namespace
}  // namespace morphbus::bridge
