#include "tools/control/deployment_schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bridge/wire/wire_limits.h"

namespace morphbus::tools {
namespace {

/// No deployment is for a time further ahead, seconds.
constexpr double kFurthestSwitch = 3600;
/// Ticks more than a program needs to be everywhere, and in real time, where messages may come a
/// tick late at every hop, the factor of the time that it takes to spread.
constexpr int64_t kSpareTicks = 5;
constexpr double kRealtimeSlack = 2;

}  // namespace

std::string DeploymentSchedule::WhyNot(const Order& order, bool endless) const {
  if (!order.at) return "";
  const int64_t switch_tick = Plan(order).switch_tick;
  const double now = SecondsOf(order.tick);
  if (switch_tick < order.tick) {
    return fmt::format("--at {}: the run is at {} s already; name a later time, or leave --at out",
                       *order.at, now);
  }
  if (order.sets && UnderWay(order.tick) && switch_tick < last_switch_tick_) {
    return fmt::format("--at {}: the program that has this value is taken up at {} s", *order.at,
                       SecondsOf(last_switch_tick_));
  }
  if (*order.at > now + kFurthestSwitch) {
    return fmt::format("--at {}: more than {} s ahead of the run, which is at {} s", *order.at,
                       kFurthestSwitch, now);
  }
  if (endless || run_.num_ticks < 0 || switch_tick < run_.num_ticks) return "";
  return fmt::format("--at {}: the run ends at {} s", *order.at, SecondsOf(run_.num_ticks));
}

double DeploymentSchedule::SecondsOf(int64_t tick) const {
  // A quotient, so that the text of a time in whole ticks is as short as it can be.
  return static_cast<double>(tick * run_.tick_us) / 1e6;
}

int64_t DeploymentSchedule::TicksToAll(const Order& order) const {
  // The pieces come one a tick.
  const auto size = static_cast<uint32_t>(vm::kPackageHeadBytes + order.image_bytes);
  const int64_t give = (size + bridge::kMaxDeployPiece - 1) / bridge::kMaxDeployPiece;
  const int64_t spread = vm::SpreadTicks(size, order.hops);
  if (!run_.realtime) return give + spread + kSpareTicks;
  // In real time messages are late or lost, and come again: a piece that is lost costs its hop
  // some ticks, and its module a round.
  // With so many rounds the chance that any piece is lost in all of them is 1 % at most.
  const double loss = run_.loss;
  const double rounds =
      loss > 0 ? std::ceil(std::log(100.0 * static_cast<double>(give)) / -std::log(loss)) : 1;
  const double slow = kRealtimeSlack / ((1 - loss) * (1 - loss));
  return kSpareTicks +
         std::llround(rounds * static_cast<double>(give) + slow * static_cast<double>(spread));
}

DeploymentSchedule::Times DeploymentSchedule::Plan(const Order& order) const {
  Times times = {order.tick, 0};
  const int64_t to_all = TicksToAll(order);
  // A program that has not gone out whole is withdrawn; one that has, waits.
  const int64_t waits_for = order.last_is_whole ? last_switch_tick_ : whole_switch_tick_;
  if (waits_for > order.tick && waits_for <= order.tick + to_all) times.from_tick = waits_for;
  // All go over at the first tick that is not before the time. The quotient need not be exact: what
  // lies a thousandth behind a tick is that tick.
  const auto tick_us = static_cast<double>(run_.tick_us);
  times.switch_tick = order.at ? static_cast<int64_t>(std::ceil(*order.at * 1e6 / tick_us - 1e-3))
                               : times.from_tick + to_all;
  // A value of a program that waits for its time does not bring that program forward.
  if (order.sets && !order.at) times.switch_tick = std::max(times.switch_tick, last_switch_tick_);
  return times;
}

bool DeploymentSchedule::UnderWay(int64_t tick) const {
  // In real time modules may be late by as long as they are thought to be there.
  return last_switch_tick_ >= 0 &&
         tick <= last_switch_tick_ + (run_.realtime ? vm::kSilentTicks : 0);
}

vm::PackageHead DeploymentSchedule::Begin(const Order& order, const Times& times) {
  if (order.last_is_whole) whole_switch_tick_ = last_switch_tick_;
  last_switch_tick_ = times.switch_tick;
  return {times.switch_tick, ++last_number_};
}

}  // namespace morphbus::tools
