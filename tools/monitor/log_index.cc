#include "tools/monitor/log_index.h"

#include <algorithm>

#include "bridge/wire/channels.h"
#include "logger/log/description.h"
#include "logger/log/ordered_log.h"
#include "tools/monitor/channel_rates.h"

namespace morphbus::tools {
namespace {

constexpr size_t kMostCheckpoints = 256;
/// Sim time between two checkpoints at first; it doubles as often as there are too many.
constexpr int64_t kFirstSpacingUs = 1'000'000;

/// Leaves every second checkpoint, the first among them.
void ThinOut(std::vector<LogCheckpoint>* checkpoints) {
  std::vector<LogCheckpoint> kept;
  for (size_t i = 0; i < checkpoints->size(); i += 2) {
    kept.push_back(std::move((*checkpoints)[i]));
  }
  // So they stay evenly spread over a log of any length.
  *checkpoints = std::move(kept);
}

}  // namespace

Result<std::shared_ptr<const bridge::RunModel>> ReadLogModel(const std::string& path) {
  const Result<std::string> description = logger::DescriptionInLog(path);
  if (!description) return Fail(description.error().message);
  auto model = bridge::ReadRunWithRobot(*description);
  if (!model) return Fail(path + ": " + model.error().message);
  return *model;
}

Result<std::shared_ptr<const LogIndex>> IndexLog(const std::string& path,
                                                 std::shared_ptr<const bridge::RunModel> run,
                                                 const std::string& source,
                                                 const bridge::ProgramText& text) {
  auto reader = logger::OrderedLogReader::Open(path, run->run);
  if (!reader) return Fail(reader.error().message);
  // The log's begin is a place to play from before anything was heard.
  auto index = std::make_shared<LogIndex>();
  index->path = path;
  const std::string clock_channel = bridge::Channel(run->run, "", bridge::Topic::kClock);
  index->run = run;
  index->disorder = (*reader)->disorder();
  bridge::Converter converter(run, source, text);
  index->checkpoints.push_back({0, 0, converter});
  ChannelRates rates;
  int64_t spacing_us = kFirstSpacingUs;
  int64_t first_wall_us = -1, last_wall_us = 0, tick = -1;
  logger::LogEvent event;
  while ((*reader)->Next(&event)) {
    // A tick begins with its CLOCK: before it is where one can begin to play.
    if (event.channel == clock_channel &&
        converter.time_us() >= index->checkpoints.back().time_us + spacing_us) {
      index->checkpoints.push_back(
          {converter.time_us(), std::min(event.offset, (*reader)->position()), converter});
      if (index->checkpoints.size() > kMostCheckpoints) {
        ThinOut(&index->checkpoints);
        spacing_us *= 2;
      }
    }
    // Rates are those by the wall clock of the recording, as on the bus.
    if (first_wall_us < 0) first_wall_us = event.timestamp_us;
    last_wall_us = event.timestamp_us - first_wall_us;
    rates.Take(event.channel, event.data.data(), event.data.size(),
               static_cast<double>(last_wall_us) * 1e-6);
    // Without a sink the converter only follows, which is much faster.
    converter.Take(event.channel, event.data.data(), event.data.size(), nullptr);
    if (tick < 0 && converter.tick() >= 0) index->begin_us = converter.time_us();
    tick = converter.tick();
  }
  index->end_us = converter.time_us();
  index->channels = rates.Roll(static_cast<double>(last_wall_us) * 1e-6);
  if (tick < 0) return Fail(path + " holds no tick of run " + run->run);
  return index;
}

}  // namespace morphbus::tools
