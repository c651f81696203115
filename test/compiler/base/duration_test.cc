#include "compiler/base/duration.h"

#include <gtest/gtest.h>

namespace morphbus {
namespace {

TEST(Duration, SecondsAndMillisecondsAreRead) {
  EXPECT_EQ(ReadSeconds("2.5"), 2.5);
  EXPECT_EQ(ReadSeconds("2.5s"), 2.5);
  EXPECT_EQ(ReadSeconds("300ms"), 0.3);
  EXPECT_EQ(ReadSeconds("-1e3ms"), -1.0);
}

TEST(Duration, NothingElseIsATime) {
  for (const char* text :
       {"", "s", "ms", " 1", "1 s", "1m", "1sec", "+1", "nan", "inf", "1e999s", "1s2"}) {
    EXPECT_EQ(ReadSeconds(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace morphbus
