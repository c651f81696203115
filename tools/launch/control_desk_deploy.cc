// When a deployment that a ControlDesk takes goes out, and when modules go over to it.
#include <fmt/format.h>

#include <cmath>

#include "bridge/wire/wire_limits.h"
#include "tools/base/messages.h"
#include "tools/launch/control_desk.h"
#include "vm/spread/program_relay.h"

namespace morphbus::tools {
namespace {

using bridge::ControlCommand;
using bridge::ControlKind;

/// No deployment is for a time further ahead, seconds.
constexpr double kFurthestSwitch = 3600;
/// Ticks more than a program needs to be everywhere, and in real time, where messages may come a
/// tick late at every hop, the factor of the time that it takes to spread.
constexpr int64_t kSpareTicks = 5;
constexpr double kRealtimeSlack = 2;

}  // namespace

ControlDesk::Refusal ControlDesk::CheckTime(const ControlCommand& command, int64_t tick,
                                            bool scripted) {
  if (command.kind != ControlKind::kDeploy || !command.at) return {};
  const int64_t switch_tick = Plan(command, tick).switch_tick;
  if (switch_tick < tick) {
    return {kNo, fmt::format("--at {}: the run is at {} s already; name a later time, or leave "
                             "--at out",
                             *command.at, SecondsOf(tick))};
  }
  if (*command.at > SecondsOf(tick) + kFurthestSwitch) {
    return {kNo, fmt::format("--at {}: more than {} s ahead of the run, which is at {} s",
                             *command.at, kFurthestSwitch, SecondsOf(tick))};
  }
  // A script may be that of a run which went on for longer.
  const int64_t end = scripted ? -1 : plan_.num_ticks();
  if (end < 0 || switch_tick < end) return {};
  return {kNo, fmt::format("--at {}: the run ends at {} s", *command.at, SecondsOf(end))};
}

double ControlDesk::SecondsOf(int64_t tick) const {
  // A quotient, so that the text of a time in whole ticks is as short as it can be.
  return static_cast<double>(tick * plan_.description.tick_us()) / 1e6;
}

int64_t ControlDesk::TicksToAll(const ControlCommand& command) {
  // The pieces come one a tick.
  const size_t image = script_.images[command.program_hash].size();
  const auto size = static_cast<uint32_t>(vm::kPackageHeadBytes + image);
  const int64_t give = (size + bridge::kMaxDeployPiece - 1) / bridge::kMaxDeployPiece;
  const int64_t spread = vm::SpreadTicks(size, sim_.HopsFrom(Addressee(command)));
  if (plan_.description.mode() != "realtime") return give + spread + kSpareTicks;
  // In real time messages are late or lost, and come again: a piece that is lost costs its hop
  // some ticks, and its module a round.
  const double loss = plan_.description.loss();
  const double rounds =
      loss > 0 ? std::ceil(std::log(100.0 * static_cast<double>(give)) / -std::log(loss)) : 1;
  const double slow = kRealtimeSlack / ((1 - loss) * (1 - loss));
  return kSpareTicks +
         std::llround(rounds * static_cast<double>(give) + slow * static_cast<double>(spread));
}

ControlDesk::Schedule ControlDesk::Plan(const ControlCommand& command, int64_t tick) {
  Schedule schedule = {tick, 0};
  const int64_t to_all = TicksToAll(command);
  // A program that has not gone out whole is withdrawn; one that has, waits.
  const int64_t waits_for = sim_.deployed_whole() ? last_switch_tick_ : whole_switch_tick_;
  if (waits_for > tick && waits_for <= tick + to_all) schedule.from_tick = waits_for;
  const auto tick_us = static_cast<double>(plan_.description.tick_us());
  schedule.switch_tick = command.at
                             ? static_cast<int64_t>(std::ceil(*command.at * 1e6 / tick_us - 1e-3))
                             : schedule.from_tick + to_all;
  return schedule;
}

ControlCommand ControlDesk::Complete(ControlCommand command, int64_t tick) {
  if (command.kind != ControlKind::kDeploy) return command;
  command.at = SecondsOf(Plan(command, tick).switch_tick);
  return command;
}

void ControlDesk::Deploy(const ControlCommand& command, int module, int64_t tick) {
  const Schedule schedule = Plan(command, tick);
  // The later command wins, also where its module has not heard of the earlier one: modules start
  // with version 1, so the first deployment has the number 2.
  const vm::PackageHead head = {schedule.switch_tick, ++last_number_};
  const std::string& image = script_.images[command.program_hash];
  std::vector<uint8_t> package(vm::kPackageHeadBytes);
  vm::WritePackageHead(head, package.data());
  package.insert(package.end(), image.begin(), image.end());
  if (sim_.deployed_whole()) whole_switch_tick_ = last_switch_tick_;
  last_switch_tick_ = schedule.switch_tick;
  sim_.Deploy(module, vm::PackageId(command.program_hash, head), package, schedule.from_tick);
}

}  // namespace morphbus::tools
