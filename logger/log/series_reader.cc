#include "logger/log/series_reader.h"

#include <algorithm>
#include <utility>

namespace morphbus::logger {
namespace {

using bridge::Topic;

/// The names of the modules that the outline found.
std::vector<std::string> NamesIn(const RunLog& log) {
  std::vector<std::string> names;
  for (const ModuleSeries& module : log.modules) names.push_back(module.name);
  return names;
}

}  // namespace

Result<std::unique_ptr<SeriesReader>> SeriesReader::Open(RunLog* log) {
  auto reader = EventLogReader::Open(log->facts.path);
  if (!reader) return tl::unexpected(reader.error());
  return std::unique_ptr<SeriesReader>(new SeriesReader(log, std::move(*reader)));
}

SeriesReader::SeriesReader(RunLog* log, std::unique_ptr<EventLogReader> reader)
    : log_(*log), reader_(std::move(reader)), channels_(log->facts.run, NamesIn(*log)) {}

void SeriesReader::ReadUntil(int64_t end_us) {
  // Messages stand behind later ones by so much at most, as the outline found: what belongs to
  // the slice may stand so far behind its end.
  LogEvent event;
  while (!ended_ && (now_us_ < end_us || now_us_ - end_us < log_.disorder_us)) {
    if (!reader_->Next(&event)) {
      ended_ = true;
      break;
    }
    Take(event);
  }
}

void SeriesReader::Install(int64_t end_us) { ahead_.MoveBefore(end_us, &log_); }

void SeriesReader::Take(const LogEvent& event) {
  // Only what fills series is wanted, and of modules only those that the outline found.
  const bridge::RunChannels::Channel* channel = channels_.Find(event.channel);
  if (channel == nullptr) return;
  const Topic topic = channel->topic;
  const bool of_sim = topic == Topic::kSensors || topic == Topic::kWorld;
  const bool of_module = topic == Topic::kTransform || topic == Topic::kActuator;
  if (!of_sim && !of_module) return;
  bridge::RunMessage message{
      {log_.facts.run, channel->process, topic}, {}, event.data.data(), event.data.size()};
  // The outline has checked every message: of a log without damage all of them are sound, and a
  // TRANSFORM needs no second look.
  if (log_.facts.num_damage == 0) {
    message.header.sim_time_us = bridge::SimTimeOf(message);
    if (topic == Topic::kTransform) {
      ahead_.OnChecked(message);
      now_us_ = std::max(now_us_, message.header.sim_time_us);
      return;
    }
  } else {
    // Of a damaged log each message is looked at again, and those of other models are left out.
    const uint64_t model_hash = log_.facts.model_hash;
    if (!bridge::ReadHeader(&message)) return;
    if (model_hash != 0 && static_cast<uint64_t>(message.header.model_hash) != model_hash) return;
  }
  // A message that does not decode has no sample, as in the outline.
  if (!bridge::ReadMessage(message, &ahead_)) return;
  now_us_ = std::max(now_us_, message.header.sim_time_us);
}

}  // namespace morphbus::logger
