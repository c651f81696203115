#include "logger/log/series_reader.h"

#include <algorithm>
#include <functional>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/wire/codec.h"
#include "bridge/wire/wire_peek.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;

/// A damaged log can name any number of channels; further ones are looked up anew each time.
constexpr size_t kMostChannels = 200'000;

/// Moves the samples before `end_us` to the series, in order of time and one a time.
template <class Sample>
void MoveBefore(int64_t end_us, std::vector<Sample>* ahead, std::vector<Sample>* series) {
  const auto earlier = [](const Sample& a, const Sample& b) { return a.time_us < b.time_us; };
  if (!std::is_sorted(ahead->begin(), ahead->end(), earlier)) {
    std::stable_sort(ahead->begin(), ahead->end(), earlier);
  }
  // What is of a later slice stays for the next call.
  const auto end = std::lower_bound(ahead->begin(), ahead->end(), end_us,
                                    [](const Sample& s, int64_t t) { return s.time_us < t; });
  series->clear();
  series->insert(series->end(), std::make_move_iterator(ahead->begin()),
                 std::make_move_iterator(end));
  ahead->erase(ahead->begin(), end);
  const auto same = [](const Sample& a, const Sample& b) { return a.time_us == b.time_us; };
  series->erase(std::unique(series->begin(), series->end(), same), series->end());
}

}  // namespace

Result<std::unique_ptr<SeriesReader>> SeriesReader::Open(RunLog* log) {
  auto reader = EventLogReader::Open(log->facts.path);
  if (!reader) return tl::unexpected(reader.error());
  return std::unique_ptr<SeriesReader>(new SeriesReader(log, std::move(*reader)));
}

SeriesReader::SeriesReader(RunLog* log, std::unique_ptr<EventLogReader> reader)
    : log_(*log), reader_(std::move(reader)), ahead_(log->modules.size()) {
  for (int m = 0; m < static_cast<int>(log_.modules.size()); ++m) {
    modules_.emplace(log_.modules[m].name, m);
  }
}

const SeriesReader::Wanted& SeriesReader::WantedOf(std::string_view channel) {
  // A run has some dozens of channels and millions of messages: the name is parsed once.
  const auto found = channels_.find(channel);
  if (found != channels_.end()) return found->second;
  Wanted wanted;
  const std::optional<bridge::ChannelName> name = bridge::ParseChannel(channel);
  if (name && name->run == log_.facts.run) {
    wanted.topic = name->topic;
    // Only what fills series is wanted, and of modules only those that the outline found.
    const bool of_sim = wanted.topic == Topic::kSensors || wanted.topic == Topic::kWorld;
    const bool of_module = wanted.topic == Topic::kTransform || wanted.topic == Topic::kActuator;
    const auto module = modules_.find(name->process);
    if (of_module && module != modules_.end()) wanted.module = module->second;
    wanted.any = of_sim || wanted.module >= 0;
  }
  // Beyond the bound the names are only looked up anew.
  if (channels_.size() >= kMostChannels) channels_.clear();
  return channels_.emplace(channel, wanted).first->second;
}

void SeriesReader::ReadUntil(int64_t end_us) {
  // Messages stand behind later ones by so much at most, as the outline found: what belongs to
  // the slice may stand so far behind its end.
  LogEvent event;
  while (!ended_ && (now_us_ < end_us || now_us_ - end_us < log_.disorder_us)) {
    if (!reader_->Next(&event)) {
      ended_ = true;
      break;
    }
    const Wanted& wanted = WantedOf(event.channel);
    if (wanted.any) Take(event, wanted);
  }
}

void SeriesReader::Install(int64_t end_us) {
  // World and modules get the same slice of time.
  for (size_t m = 0; m < ahead_.size(); ++m) {
    MoveBefore(end_us, &ahead_[m].sensors, &log_.modules[m].sensors);
    MoveBefore(end_us, &ahead_[m].transforms, &log_.modules[m].transforms);
    MoveBefore(end_us, &ahead_[m].actuators, &log_.modules[m].actuators);
  }
  MoveBefore(end_us, &world_ahead_, &log_.world);
}

void SeriesReader::Take(const LogEvent& event, const Wanted& wanted) {
  // The outline has checked every message: of a log without damage all of them are sound.
  const uint8_t* data = event.data.data();
  if (log_.facts.num_damage > 0) {
    // Of a damaged log each header is looked at again, and messages of other models are left out.
    morphbus::header_t header;
    if (!bridge::DecodeHeader(data, event.data.size(), &header)) return;
    const auto model_hash = static_cast<uint64_t>(header.model_hash);
    if (log_.facts.model_hash != 0 && model_hash != log_.facts.model_hash) return;
  }
  switch (wanted.topic) {
    case Topic::kSensors:
      return TakeSensors(event);
    case Topic::kWorld:
      return TakeWorld(event);
    case Topic::kTransform:
      return TakeTransform(event, wanted.module);
    default:
      return TakeActuator(event, wanted.module);
  }
}

void SeriesReader::TakeSensors(const LogEvent& event) {
  morphbus::sensors_t sensors;
  // A message that does not decode has no sample, as in the outline.
  if (!bridge::DecodeBody(event.data.data(), event.data.size(), &sensors)) return;
  now_us_ = std::max(now_us_, sensors.header.sim_time_us);
  for (morphbus::module_sensors_t& reading : sensors.modules) {
    // A module that the outline does not know has no series, such as one of a forged message.
    const auto module = modules_.find(reading.name);
    if (module == modules_.end()) continue;
    const std::vector<float>& velocity = reading.joint_velocity_si;
    ahead_[module->second].sensors.push_back(
        {sensors.header.sim_time_us, std::move(reading.joint_position_si),
         std::vector<double>(velocity.begin(), velocity.end()), std::move(reading.docked),
         std::move(reading.sensor_value), std::move(reading.joint_effort_si)});
  }
}

void SeriesReader::TakeTransform(const LogEvent& event, int module) {
  const uint8_t* data = event.data.data();
  if (log_.facts.num_damage > 0 &&
      !bridge::CheckBody<morphbus::transform_t>(data, event.data.size())) {
    return;
  }
  // Poses are most of a log, so that only these bytes are read and not the whole message.
  const int64_t time_us = bridge::PeekSimTime(data);
  now_us_ = std::max(now_us_, time_us);
  TransformSample& sample = ahead_[module].transforms.emplace_back(TransformSample{
      time_us, bridge::PeekRole(data), bridge::PeekHasPose(data), bridge::PeekPoseStale(data), {}});
  bridge::PeekLinkPoses(data, &sample.X_RL);
}

void SeriesReader::TakeActuator(const LogEvent& event, int module) {
  morphbus::actuator_t actuator;
  if (!bridge::DecodeBody(event.data.data(), event.data.size(), &actuator)) return;
  now_us_ = std::max(now_us_, actuator.header.sim_time_us);
  ahead_[module].actuators.push_back(
      {actuator.header.sim_time_us, std::move(actuator.joints), std::move(actuator.connectors)});
}

void SeriesReader::TakeWorld(const LogEvent& event) {
  morphbus::world_t world;
  if (!bridge::DecodeBody(event.data.data(), event.data.size(), &world)) return;
  now_us_ = std::max(now_us_, world.header.sim_time_us);
  const int64_t time_us = world.header.sim_time_us;
  // Parts of one instant make one sample; they stand near each other, mostly beside.
  const auto same = std::find_if(world_ahead_.rbegin(), world_ahead_.rend(),
                                 [time_us](const WorldSample& s) { return s.time_us <= time_us; });
  if (same != world_ahead_.rend() && same->time_us == time_us) {
    same->bodies.insert(same->bodies.end(), world.bodies.begin(), world.bodies.end());
    same->contacts.insert(same->contacts.end(), world.contacts.begin(), world.contacts.end());
    return;
  }
  world_ahead_.insert(same.base(), {time_us, std::move(world.bodies), std::move(world.contacts)});
}

}  // namespace morphbus::logger
