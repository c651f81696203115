#include "tools/monitor/log_index.h"

#include <algorithm>

#include "bridge/wire/channels.h"
#include "logger/log/description.h"
#include "logger/log/ordered_log.h"
#include "tools/monitor/channel_rates.h"

namespace morphbus::tools {
namespace {

constexpr size_t kMostCheckpoints = 256;
constexpr size_t kMostCounts = 1024;
/// Sim time between two checkpoints at first; it doubles as often as there are too many.
constexpr int64_t kFirstSpacingUs = 1'000'000;

/// Leaves every second one, the first among them.
template <class Place>
void ThinOut(std::vector<Place>* places) {
  std::vector<Place> kept;
  for (size_t i = 0; i < places->size(); i += 2) kept.push_back(std::move((*places)[i]));
  // So they stay evenly spread over a log of any length.
  *places = std::move(kept);
}

}  // namespace

Result<std::shared_ptr<const bridge::RunModel>> ReadLogModel(const std::string& path,
                                                             std::string* description) {
  const Result<std::string> found = logger::DescriptionInLog(path);
  if (!found) return Fail(found.error().message);
  auto model = bridge::ReadRunWithRobot(*found);
  if (!model) return Fail(path + ": " + model.error().message);
  *description = *found;
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
  int64_t spacing_us = kFirstSpacingUs, counts_spacing_us = kFirstSpacingUs;
  int64_t tick = -1;
  const auto count = [&] {
    morphbus::Channels counts = rates.Roll(static_cast<double>(converter.time_us()) * 1e-6);
    bridge::SetTime(converter.time_us(), counts.mutable_timestamp());
    index->counts.emplace_back(converter.time_us(), counts.SerializeAsString());
  };
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
    // What was said by the end of a stretch of sim time.
    if (event.channel == clock_channel && tick >= 0 &&
        (index->counts.empty() ||
         converter.time_us() >= index->counts.back().first + counts_spacing_us)) {
      count();
      if (index->counts.size() > kMostCounts) {
        ThinOut(&index->counts);
        counts_spacing_us *= 2;
      }
    }
    rates.Take(event.channel, event.data.data(), event.data.size(),
               static_cast<double>(converter.time_us()) * 1e-6);
    // Without a sink the converter only follows, which is much faster.
    converter.Take(event.channel, event.data.data(), event.data.size(), nullptr);
    if (tick < 0 && converter.tick() >= 0) index->begin_us = converter.time_us();
    tick = converter.tick();
  }
  index->end_us = converter.time_us();
  if (tick < 0) return Fail(path + " holds no tick of run " + run->run);
  count();
  return index;
}

}  // namespace morphbus::tools
