// LCM's datagrams taken apart: messages of one datagram, and nothing else.

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

/// The first fragment of a message that claims to have `message_size` bytes.
Bytes Fragment(uint32_t message_size) {
  Bytes out;
  Append(&out, 0x4c433033, 4);
  Append(&out, 7, 4);
  Append(&out, message_size, 4);
  Append(&out, 0, 4);  // Where in the message it belongs,
  Append(&out, 0, 2);  // its number,
  Append(&out, 2, 2);  // and how many there are.
  Append(&out, "run/long");
  out.push_back(0);
  Append(&out, "payload");
  return out;
}

struct Receiver {
  LcmDatagrams datagrams;
  std::vector<std::string> heard;

  void Take(const Bytes& bytes) {
    datagrams.Take(bytes.data(), bytes.size(),
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

TEST(LcmDatagrams, FragmentsAreRefusedUnreadAndCounted) {
  Receiver receiver;
  for (int i = 0; i < 6000; ++i) receiver.Take(Fragment(15u << 20));
  receiver.Take(Short("run/a", "payload"));
  EXPECT_EQ(receiver.heard, std::vector<std::string>{"run/a=payload"});
  EXPECT_EQ(receiver.datagrams.fragments(), 6000);
  EXPECT_EQ(receiver.datagrams.bad(), 0);
}

TEST(LcmDatagrams, WhatIsNoMessageIsCountedAndDropped) {
  Receiver receiver;
  receiver.Take({});
  receiver.Take({'L', 'C', '0', '2', 0, 0, 0, 0});
  receiver.Take(Short(std::string(64, 'x'), "channel of 64 characters"));
  receiver.Take({'L', 'C', '0', '9', 0, 0, 0, 0, 'a', 0});
  EXPECT_TRUE(receiver.heard.empty());
  EXPECT_EQ(receiver.datagrams.bad(), 4);
}

}  // namespace
}  // namespace morphbus::bridge
