#include "compiler/base/bytes.h"

#include <gtest/gtest.h>

namespace morphbus {
namespace {

TEST(BytesTest, TheFirstByteIsTheMostSignificant) {
  const uint8_t bytes[] = {0xED, 0xA1, 0xDA, 0x01, 0x02, 0x03, 0x04, 0x05};
  EXPECT_EQ(ReadBig(bytes, 1), 0xEDU);
  EXPECT_EQ(ReadBig(bytes, 2), 0xEDA1U);
  EXPECT_EQ(ReadBig(bytes, 4), 0xEDA1DA01U);
  EXPECT_EQ(ReadBig(bytes, 8), 0xEDA1DA0102030405U);
}

TEST(BytesTest, WhatIsWrittenIsReadAndNothingBeside) {
  for (int count = 1; count <= 8; ++count) {
    uint8_t bytes[10];
    for (uint8_t& byte : bytes) byte = 0x55;
    const uint64_t value = 0xFEDCBA9876543210U >> (64 - 8 * count);
    WriteBig(value, count, bytes + 1);
    EXPECT_EQ(ReadBig(bytes + 1, count), value) << count;
    EXPECT_EQ(bytes[0], 0x55) << count;
    EXPECT_EQ(bytes[1 + count], 0x55) << count;
  }
}

TEST(BytesTest, OnlyTheLowestBytesAreWritten) {
  uint8_t bytes[2] = {};
  WriteBig(0x123456, 2, bytes);
  EXPECT_EQ(ReadBig(bytes, 2), 0x3456U);
}

}  // namespace
}  // namespace morphbus
