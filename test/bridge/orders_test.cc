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

/// The run's hash when some modules are inspected at tick 7, with so many messages lost; what the
/// modules told, by module.
std::string HashWithInspection(double loss, const std::vector<size_t>& inspected,
                               std::vector<std::vector<int64_t>>* told) {
  FakeRunOptions options;
  options.ticks = 30;
  options.loss = loss;
  FakeRun run(options);
  run.sim->OnBeforeTick([&](int64_t tick) {
    for (const size_t module : inspected) {
      if (tick == 7) run.sim->Inspect(module);
    }
  });
  EXPECT_TRUE(run.Run());
  told->clear();
  for (const FakeRun::Module& module : run.modules) {
    told->push_back(module.controller->inspected_at);
  }
  return run.sim->outcome().run_hash;
}

TEST(Orders, WhoIsInspectedTellsOnceInThatTickWhateverIsLost) {
  std::vector<std::vector<int64_t>> told;
  const std::string quiet = HashWithInspection(0, {}, &told);
  EXPECT_EQ(told, (std::vector<std::vector<int64_t>>{{}, {}, {}}));
  const std::string one = HashWithInspection(0, {1}, &told);
  EXPECT_EQ(told, (std::vector<std::vector<int64_t>>{{}, {7}, {}}));
  EXPECT_NE(one, quiet);
  EXPECT_EQ(HashWithInspection(0.3, {1}, &told), one);
  EXPECT_EQ(told, (std::vector<std::vector<int64_t>>{{}, {7}, {}}));
  EXPECT_NE(HashWithInspection(0, {0, 1, 2}, &told), one);
  EXPECT_EQ(told, (std::vector<std::vector<int64_t>>{{7}, {7}, {7}}));
}

}  // namespace
}  // namespace morphbus::bridge
