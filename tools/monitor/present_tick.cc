#include "tools/monitor/present_tick.h"

#include <fmt/format.h>

#include <morphbus/resend_t.hpp>
#include <random>
#include <utility>

#include "bridge/wire/channels.h"

namespace morphbus::tools {
namespace {

using bridge::Topic;

/// CLOCK is repeated twice a second: what is not there after so many is not kept any more.
constexpr int kMostRequests = 6;

}  // namespace

std::string NameOfAsker() {
  // Two monitors of one run must not have one name: its processes would take what one asks for a
  // repetition of what the other has asked.
  std::random_device random;
  return fmt::format("TOOL {:08x}{:08x}", random(), random());
}

PresentTick::PresentTick(bridge::Bus* bus, std::shared_ptr<const bridge::RunModel> run)
    : run_(std::move(run)),
      outbox_(bus, bridge::Sender{run_->run, NameOfAsker(), run_->model_hash, 0}, &ledger_) {}

void PresentTick::Want(std::string_view process, Topic topic, int64_t first, int64_t last) {
  // A run without a world has no WORLD to ask for, and a module may not have said any STATUS.
  if (first < 0 || first > last) return;
  const auto [entry, is_new] =
      wanted_.try_emplace(bridge::Channel(run_->run, process, topic),
                          Wanted{std::string(process), topic, first, last, 0});
  if (is_new) Ask(entry->second);
}

void PresentTick::Ask(const Wanted& wanted) {
  morphbus::resend_t ask = {};
  ask.sender = outbox_.sender().process;
  ask.channel = bridge::Channel(run_->run, wanted.process, wanted.topic);
  ask.first_sequence = wanted.first;
  ask.last_sequence = wanted.last;
  outbox_.Send(bridge::Channel(run_->run, wanted.process, Topic::kResend), 0, 0, &ask);
}

void PresentTick::OnClock(const bridge::RunMessage& /*message*/, morphbus::sim_clock_t&& clock) {
  const int64_t tick = clock.header.tick;
  // The first CLOCK alone does not say whether the run goes on.
  if (first_tick_ < 0) {
    first_tick_ = tick;
    return;
  }
  // What lacks is asked for again, and given up in the end.
  over_ =
      tick != first_tick_ || times_asked_ >= kMostRequests || (times_asked_ > 0 && wanted_.empty());
  if (over_) return wanted_.clear();
  for (auto& [channel, wanted] : wanted_) {
    wanted.come = 0;
    Ask(wanted);
  }
  if (times_asked_++ > 0) return;
  // Numbers on the sim's channels follow from the tick; those of modules do while they miss none.
  const int64_t sensors = clock.num_sensors_parts, world = clock.num_world_parts;
  Want(bridge::kSimProcess, Topic::kSensors, tick * sensors, (tick + 1) * sensors - 1);
  Want(bridge::kSimProcess, Topic::kWorld, tick * world, (tick + 1) * world - 1);
  for (const auto& module : run_->robot->modules) {
    Want(module.name, Topic::kTransform, tick, tick);
    Want(module.name, Topic::kActuator, tick, tick);
  }
}

void PresentTick::Take(std::string_view channel, const uint8_t* data, size_t size) {
  // Once the run goes on every tick brings its own messages, and nothing is asked for any more.
  if (over_) return;
  const Result<bridge::RunMessage> message = bridge::OpenMessage(channel, data, size);
  if (!message) return;
  if (message->name.topic == Topic::kClock) {
    bridge::ReadMessage(*message, this);
    return;
  }
  const auto found = wanted_.find(channel);
  if (found == wanted_.end()) return;
  const Wanted& wanted = found->second;
  // All that were asked for must have come before the channel counts as done.
  if (++found->second.come <= wanted.last - wanted.first) return;
  // ACTUATOR tells how many STATUS its module has sent; the last one has role, labels and signs.
  if (message->name.topic == Topic::kActuator) {
    const int64_t count = bridge::StatusCountOf(*message);
    Want(wanted.process, Topic::kStatus, count - 1, count - 1);
  }
  wanted_.erase(found);
}

}  // namespace morphbus::tools
