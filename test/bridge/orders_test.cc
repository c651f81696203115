// Programs that are given to modules while a run goes on (sim_participant_orders.cc).

#include <gtest/gtest.h>

#include <numeric>

#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

std::vector<uint8_t> PackageOfBytes(size_t size, uint8_t first) {
  std::vector<uint8_t> bytes(size);
  std::iota(bytes.begin(), bytes.end(), first);
  return bytes;
}

TEST(Orders, APackageThatHasNotGoneOutWholeIsWithdrawnForTheNext) {
  FakeRunOptions options;
  options.ticks = 60;
  FakeRun run(options);
  const std::vector<uint8_t> first = PackageOfBytes(3000, 0), second = PackageOfBytes(1000, 7);
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 3) run.sim->Deploy(1, 42, first, 3);
    if (tick != 8) return;
    EXPECT_FALSE(run.sim->deployed_whole());
    run.sim->Deploy(2, 43, second, 8);
  });
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->deployed_whole());
  EXPECT_EQ(run.modules[1].controller->deployed.size(), 5 * 128u) << "in ticks 3 to 7";
  EXPECT_EQ(run.modules[2].controller->deployed, second);
}

TEST(Orders, APackageGoesOutFromItsTickOn) {
  FakeRunOptions options;
  options.ticks = 30;
  FakeRun run(options);
  const std::vector<uint8_t> package = PackageOfBytes(1000, 0);
  std::vector<size_t> got;
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 3) run.sim->Deploy(1, 42, package, 20);
    got.push_back(run.modules[1].controller->deployed.size());
  });
  ASSERT_TRUE(run.Run());
  EXPECT_EQ(got[20], 0u);
  EXPECT_EQ(got[21], 128u);
  EXPECT_EQ(got[28], 1000u);
}

}  // namespace
}  // namespace morphbus::bridge
