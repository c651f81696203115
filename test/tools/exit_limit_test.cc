#include "tools/launch/failure_watch.h"

#include <gtest/gtest.h>

namespace morphbus::tools {
namespace {

TEST(ExitLimitTest, TheThirdExitWithinTenSecondsIsOneTooMany) {
  ExitLimit limit;
  EXPECT_FALSE(limit.TooMany(5));
  EXPECT_FALSE(limit.TooMany(5));
  EXPECT_TRUE(limit.TooMany(14.9));
}

TEST(ExitLimitTest, WhoDiesNowAndThenMayGoOnForEver) {
  ExitLimit limit;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(limit.TooMany(5.0 * i)) << i;
  EXPECT_FALSE(limit.TooMany(5000)) << "the last but one was ten seconds ago";
  EXPECT_TRUE(limit.TooMany(5004.9));
}

}  // namespace
}  // namespace morphbus::tools
