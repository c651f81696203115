#include "tools/control/process_orders.h"

#include <gtest/gtest.h>

namespace morphbus::tools {
namespace {

/// A launcher that is told what to do, and a simulator with a barrier between two ticks.
class ProcessOrdersTest : public ::testing::Test {
 protected:
  ProcessOrdersTest() {
    orders_.OnSend([this](const bridge::ControlCommand& command, uint32_t incarnation) {
      sent_.push_back(ControlText(command) + " " + std::to_string(incarnation));
      if (at_once_) Done(true);
    });
  }

  static GivenCommand Given(const char* text) { return {1, *bridge::ParseControl(text), text}; }

  /// The launcher has done the oldest order.
  void Done(bool well) {
    const std::optional<GivenCommand> given = orders_.Done(well);
    if (given && IsCold(given->command)) restarts_.OnDone();
  }

  bool at_once_ = false;  ///< The launcher answers while it is told.
  std::vector<std::string> sent_;
  std::function<void()> at_barrier_;
  int passed_ = 0;
  uint32_t incarnation_ = 0;
  ProcessOrders orders_;
  ColdRestarts restarts_ = {
      &orders_,
      {[this](std::function<void()> at) { at_barrier_ = std::move(at); }, [this] { ++passed_; },
       [this](const bridge::ControlCommand&) { return ++incarnation_; }}};
};

TEST_F(ProcessOrdersTest, OrdersAreDoneInTheirOrder) {
  EXPECT_FALSE(orders_.Done(true)) << "none is under way";
  orders_.Order(Given("kill m1"), 0);
  orders_.Order(Given("restart m2"), 0);
  EXPECT_EQ(orders_.under_way().size(), 2u);
  EXPECT_EQ(orders_.Done(true)->command.kind, bridge::ControlKind::kKill);
  EXPECT_TRUE(orders_.any_killed());
  EXPECT_EQ(orders_.Done(true)->command.part.module, "m2");
  EXPECT_TRUE(orders_.any_killed()) << "m1 has not been started again";
  orders_.Order(Given("restart m1"), 0);
  orders_.Done(false);
  EXPECT_TRUE(orders_.any_killed()) << "that failed";
  orders_.Order(Given("restart m1"), 0);
  orders_.Done(true);
  EXPECT_FALSE(orders_.any_killed());
}

TEST_F(ProcessOrdersTest, AColdRestartIsOrderedAtTheBarrierWhichWaitsForIt) {
  restarts_.Take(Given("restart m1 --cold"));
  EXPECT_TRUE(sent_.empty());
  at_barrier_();
  EXPECT_EQ(sent_, std::vector<std::string>{"restart m1 --cold 1"});
  EXPECT_EQ(passed_, 0);
  Done(true);
  EXPECT_EQ(passed_, 1);
}

TEST_F(ProcessOrdersTest, ADeadModuleAnswersThePresentTickFirst) {
  orders_.Order(Given("kill m1"), 0);
  Done(true);
  restarts_.Take(Given("restart m1 --cold"));
  EXPECT_EQ(sent_.back(), "restart m1 0");
  EXPECT_TRUE(orders_.under_way().back().silent);
  Done(true);
  EXPECT_EQ(passed_, 0);
  at_barrier_();
  EXPECT_EQ(sent_.back(), "restart m1 --cold 1");
}

TEST_F(ProcessOrdersTest, TheTickWaitsForAllColdRestarts) {
  restarts_.Take(Given("restart m1 --cold"));
  restarts_.Take(Given("restart m2 --cold"));
  at_barrier_();
  Done(true);
  EXPECT_EQ(passed_, 0);
  Done(false);
  EXPECT_EQ(passed_, 1);
}

TEST_F(ProcessOrdersTest, RestartsThatAreDoneAtOnceLetTheTickBeginOnce) {
  at_once_ = true;
  restarts_.Take(Given("restart m1 --cold"));
  restarts_.Take(Given("restart m2 --cold"));
  at_barrier_();
  EXPECT_EQ(sent_, (std::vector<std::string>{"restart m1 --cold 1", "restart m2 --cold 2"}));
  EXPECT_EQ(passed_, 1);
}

TEST_F(ProcessOrdersTest, ARestartThatComesWhileTheTickWaitsIsDoneBeforeIt) {
  restarts_.Take(Given("restart m1 --cold"));
  at_barrier_();
  restarts_.Take(Given("restart m2 --cold"));
  EXPECT_EQ(sent_.size(), 1u);
  Done(true);
  EXPECT_EQ(sent_.back(), "restart m2 --cold 2");
  EXPECT_EQ(passed_, 0);
  Done(true);
  EXPECT_EQ(passed_, 1);
}

TEST_F(ProcessOrdersTest, ABarrierWithoutRestartsIsPassed) {
  restarts_.Take(Given("restart m1 --cold"));
  restarts_.waiting().clear();
  at_barrier_();
  EXPECT_EQ(passed_, 1);
}

}  // namespace
}  // namespace morphbus::tools
