// Programs that are given to modules while a run goes on and what they are told to do.

#include <gtest/gtest.h>

#include <numeric>

#include "bridge/lockstep/sim/module_orders.h"
#include "bridge/lockstep/sim/package_delivery.h"
#include "bridge/wire/wire_limits.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

std::vector<uint8_t> PackageOfBytes(size_t size, uint8_t first) {
  std::vector<uint8_t> bytes(size);
  std::iota(bytes.begin(), bytes.end(), first);
  return bytes;
}

std::vector<ExpectedModule> ThreeModules() {
  return {{"m1", 10, "FAKE", 0}, {"m2", 20, "FAKE", 0}, {"m3", 30, "FAKE", 0}};
}

TEST(ModuleOrders, GoOutWithThePartOfTheirModuleAndInTheirOrder) {
  ModuleOrders orders(ThreeModules());
  morphbus::sensors_t part;
  for (int i = 0; i < vm::kMaxRequests + 1; ++i) orders.Invoke(1, {});
  orders.Invoke(0, {});
  orders.Invoke(1, {});
  orders.Inspect(2);
  orders.Inspect(0);
  const auto requested = [&](const std::vector<size_t>& members) {
    orders.AddTo(members, &part);
    std::vector<int> ids;
    for (const auto& request : part.requests) ids.push_back(request.module_id);
    EXPECT_EQ(static_cast<size_t>(part.num_requests), ids.size());
    return ids;
  };
  EXPECT_EQ(requested({2}), std::vector<int>{}) << "the first one is for another part";
  EXPECT_EQ(part.inspected, std::vector<int16_t>{30});
  EXPECT_EQ(requested({0, 1}), std::vector<int>(vm::kMaxRequests, 20));
  EXPECT_EQ(part.inspected, std::vector<int16_t>{10});
  EXPECT_EQ(requested({1}), std::vector<int>{20});
  EXPECT_EQ(part.num_inspected, 0) << "once";
  EXPECT_EQ(requested({1}), std::vector<int>{});
  EXPECT_EQ(requested({0, 1}), (std::vector<int>{10, 20}));
}

/// The size of the piece that goes out with a part, 0 if there is none.
int PieceSize(PackageDelivery* delivery, const std::vector<size_t>& members, int64_t tick) {
  morphbus::sensors_t part;
  delivery->AddTo(members, tick, &part);
  EXPECT_EQ(static_cast<size_t>(part.num_pieces), part.pieces.size());
  return part.pieces.empty() ? 0 : part.pieces[0].size;
}

TEST(PackageDelivery, InLockstepEveryPieceGoesOutOnce) {
  PackageDelivery delivery(ThreeModules(), false);
  EXPECT_TRUE(delivery.whole()) << "there was none";
  delivery.Deploy(1, 42, PackageOfBytes(kMaxDeployPiece + 30, 0), 5);
  EXPECT_EQ(PieceSize(&delivery, {0, 1, 2}, 4), 0);
  EXPECT_EQ(PieceSize(&delivery, {0, 2}, 5), 0);
  EXPECT_EQ(PieceSize(&delivery, {1}, 5), static_cast<int>(kMaxDeployPiece));
  EXPECT_FALSE(delivery.whole());
  EXPECT_EQ(PieceSize(&delivery, {1}, 6), 30);
  EXPECT_TRUE(delivery.whole());
  EXPECT_EQ(PieceSize(&delivery, {1}, 7), 0);
  EXPECT_FALSE(delivery.awaited());
}

TEST(PackageDelivery, InRealTimeItGoesOutAgainUntilItHasArrived) {
  PackageDelivery delivery(ThreeModules(), true);
  delivery.Deploy(1, 42, PackageOfBytes(10, 0), 5);
  EXPECT_FALSE(delivery.awaited()) << "nothing is under way";
  for (int64_t tick = 5; tick < 8; ++tick) EXPECT_EQ(PieceSize(&delivery, {1}, tick), 10);
  EXPECT_TRUE(delivery.whole());
  EXPECT_EQ(delivery.awaited(), std::optional<size_t>(1));
  delivery.OnNews(1, 41);
  delivery.OnNews(0, 42);
  EXPECT_EQ(PieceSize(&delivery, {1}, 8), 10) << "it is not what was awaited";
  delivery.OnNews(1, 42);
  EXPECT_EQ(PieceSize(&delivery, {1}, 9), 10) << "the round is brought to its end";
  EXPECT_FALSE(delivery.awaited());
  // One that never says so is given up.
  delivery.Deploy(2, 43, PackageOfBytes(10, 0), 10);
  int times = 0;
  while (PieceSize(&delivery, {2}, 10) > 0) ++times;
  EXPECT_EQ(times, 100);
}

TEST(Orders, APackageThatHasNotGoneOutWholeIsWithdrawnForTheNext) {
  FakeRunOptions options;
  options.ticks = 60;
  FakeRun run(options);
  const std::vector<uint8_t> first = PackageOfBytes(3000, 0), second = PackageOfBytes(1000, 7);
  run.sim->OnBeforeTick([&](int64_t tick) {
    if (tick == 3) run.sim->delivery().Deploy(1, 42, first, 3);
    if (tick != 8) return;
    EXPECT_FALSE(run.sim->delivery().whole());
    run.sim->delivery().Deploy(2, 43, second, 8);
  });
  ASSERT_TRUE(run.Run());
  EXPECT_TRUE(run.sim->delivery().whole());
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
    if (tick == 3) run.sim->delivery().Deploy(1, 42, package, 20);
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
      if (tick == 7) run.sim->orders().Inspect(module);
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
