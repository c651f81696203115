#include "logger/log/promised_messages.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/channels.h"

namespace morphbus::logger {

using bridge::Topic;

void PromisedMessages::TakeClock(const morphbus::sim_clock_t& clock) {
  const bool first = num_modules_ < 0;
  // A run's shape never changes: another one in a later CLOCK is a contradiction.
  clock_varies_ =
      clock_varies_ || (!first && (clock.num_modules != num_modules_ || clock.tick_us != tick_us_ ||
                                   clock.num_sensors_parts != sensors_parts_ ||
                                   clock.num_world_parts != world_parts_));
  num_modules_ = clock.num_modules;
  sensors_parts_ = clock.num_sensors_parts;
  world_parts_ = clock.num_world_parts;
  tick_us_ = clock.tick_us;
  if (clock.phase != morphbus::sim_clock_t::PHASE_END) {
    num_ticks_ = std::max(num_ticks_, clock.header.tick + 1);
  }
}

void PromisedMessages::TakeSensors(const morphbus::sensors_t& sensors) {
  for (const morphbus::module_sensors_t& reading : sensors.modules) ++readings_[reading.name];
}

void PromisedMessages::TakeStatusCount(std::string_view module, int64_t count) {
  // Messages may come in any order, so the highest count is the last one.
  int64_t& known = status_counts_[std::string(module)];
  known = std::max(known, count);
}

void PromisedMessages::TakePlace(const std::string& channel, const morphbus::header_t& header,
                                 int64_t parts, int64_t part) {
  // A damaged tick may be any number, and its products wrap; they need only differ.
  const auto times = [](int64_t a, int64_t b) {
    return static_cast<int64_t>(static_cast<uint64_t>(a) * static_cast<uint64_t>(b));
  };
  // A message's number is tick * parts + part, and its time that of the tick's start.
  const bool number = parts == 0 || header.sequence - part == times(header.tick, parts);
  const bool time = tick_us_ == 0 || header.sim_time_us == times(header.tick, tick_us_);
  if (number && time) return;
  Misplaced& misplaced = misplaced_[channel];
  misplaced.numbers += number ? 0 : 1;
  misplaced.times += time ? 0 : 1;
}

void PromisedMessages::Judge(bool realtime, int64_t time_us, LogFacts* facts) const {
  // What an interrupted run should have held is not known.
  if (!facts->end || !facts->end->clean) return;
  const auto damage = [&](std::string what) { facts->AddDamage(std::move(what), 0, time_us); };
  // The channel must have had `promised` messages; those beyond the last one it has are lost.
  const auto promise = [&](std::string_view process, Topic topic, int64_t promised) {
    const std::string name = bridge::Channel(facts->run, process, topic);
    // A channel of which nothing was promised or found gets no entry.
    if (promised == 0 && !facts->channels.contains(name)) return;
    ChannelFacts& channel = facts->channels[name];
    channel.channel = name;
    channel.ours = channel.hashed = true;
    const int64_t next = channel.messages + channel.lost;
    // A message after the last one promised contradicts; where there are too few, some were taken
    // out.
    if (next > promised) {
      damage(fmt::format("{} holds {} messages where the run had {}", name, next, promised));
    } else if (next < promised) {
      if (channel.first_lost < 0) channel.first_lost = next;
      channel.lost += promised - next;
    }
  };

  // END, the CLOCK that ends the run and the other CLOCKs agree on the number of ticks.
  const int64_t ticks = std::max({num_ticks_, facts->end_tick, facts->end->num_ticks});
  if (facts->end->num_ticks != ticks) {
    damage(fmt::format("END counts {} ticks, CLOCK {}", facts->end->num_ticks, ticks));
  }
  if (clock_varies_) damage("CLOCK changes the number of modules or parts, or the tick's length");

  // The simulator's channels have a fixed number of messages a tick.
  promise(bridge::kSimProcess, Topic::kClock, ticks + 1);
  promise(bridge::kSimProcess, Topic::kSensors, ticks * sensors_parts_);
  promise(bridge::kSimProcess, Topic::kWorld, ticks * world_parts_);

  // Every module is sensed in every tick, and answers to it.
  const int named = static_cast<int>(readings_.size());
  if (named != num_modules_) {
    damage(fmt::format("CLOCK counts {} modules, SENSORS name {}", num_modules_, named));
  }
  for (const auto& [module, readings] : readings_) {
    if (readings != ticks) {
      damage(fmt::format("SENSORS name module {} in {} of {} ticks", module, readings, ticks));
    }
    const auto status = status_counts_.find(module);
    // Modules count their STATUS in any mode; only in lockstep they answer to every tick.
    promise(module, Topic::kStatus, status == status_counts_.end() ? 0 : status->second);
    if (realtime) continue;
    // A lost module publishes nothing from the tick on in which the run goes on without it.
    const auto lost = facts->lost_modules.find(module);
    const int64_t answers = lost == facts->lost_modules.end() || tick_us_ == 0
                                ? ticks
                                : std::min(ticks, lost->second / tick_us_);
    promise(module, Topic::kTransform, answers);
    promise(module, Topic::kActuator, answers);
  }
  // The numbers of a real-time run follow the messages, not the ticks; times are right in both.
  for (const auto& [channel, misplaced] : misplaced_) {
    if (misplaced.numbers > 0 && !realtime) {
      damage(fmt::format("{} messages of {} have the number of another tick", misplaced.numbers,
                         channel));
    }
    if (misplaced.times > 0) {
      damage(
          fmt::format("{} messages of {} have the time of another tick", misplaced.times, channel));
    }
  }
}

}  // namespace morphbus::logger
