#include <gtest/gtest.h>

#include "tools/machine/wall_clock.h"

namespace morphbus::tools {
namespace {

TEST(WakingTimer, CountsTheTimeInWhichTheProcessRan) {
  bridge::VirtualTime time;
  constexpr int64_t kStepUs = 50'000;
  time.AdvanceTo(7'000'000);
  WakingTimer timer(&time);
  const auto pass = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      time.AdvanceTo(time.NowUs() + kStepUs);
      (void)timer.seconds();
    }
  };
  pass(40);
  EXPECT_DOUBLE_EQ(timer.seconds(), 2);
  // Stopped for a minute, and continued: hardly anything of that was waiting.
  time.AdvanceTo(time.NowUs() + 60'000'000);
  EXPECT_DOUBLE_EQ(timer.seconds(), 2.5);
  pass(40);
  EXPECT_DOUBLE_EQ(timer.seconds(), 4.5);
}

}  // namespace
}  // namespace morphbus::tools
