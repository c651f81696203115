#include "logger/log/series_collector.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace morphbus::logger {
namespace {

/// Leaves one sample a time if `unique`, in order of sim time.
template <class Sample>
void SortByTime(std::vector<Sample>* samples, bool unique) {
  // Our own recorder writes in order, and then there is nothing to move.
  const auto earlier = [](const Sample& a, const Sample& b) { return a.time_us < b.time_us; };
  if (!std::is_sorted(samples->begin(), samples->end(), earlier)) {
    std::stable_sort(samples->begin(), samples->end(), earlier);
  }
  if (!unique) return;
  const auto same = [](const Sample& a, const Sample& b) { return a.time_us == b.time_us; };
  samples->erase(std::unique(samples->begin(), samples->end(), same), samples->end());
}

}  // namespace

ModuleSeries& SeriesCollector::Module(std::string_view name) {
  // Looked up without making a string, since this is done for every message.
  const auto found = modules_.find(name);
  if (found != modules_.end()) return found->second;
  ModuleSeries& series = modules_[std::string(name)];
  series.name = name;
  return series;
}

WorldSample& SeriesCollector::World(int64_t time_us) {
  WorldSample& sample = world_[time_us];
  sample.time_us = time_us;
  return sample;
}

void SeriesCollector::Finish(RunLog* log) {
  // Only of STATUS may several have one time: a tick with many faults has more than one message.
  std::vector<ModuleSeries> all;
  for (auto& [name, module] : modules_) {
    SortByTime(&module.sensors, true);
    SortByTime(&module.transforms, true);
    SortByTime(&module.actuators, true);
    SortByTime(&module.status, false);
    if (log->robot != nullptr) module.model_index = log->robot->FindModule(name).value_or(-1);
    all.push_back(std::move(module));
  }
  modules_.clear();
  // Modules that the model lacks come last, in order of their number in SENSORS.
  std::stable_sort(all.begin(), all.end(), [](const ModuleSeries& a, const ModuleSeries& b) {
    const auto rank = [](const ModuleSeries& m) {
      return m.model_index >= 0 ? m.model_index : 1'000'000 + std::max(m.id, 0);
    };
    return rank(a) < rank(b);
  });
  log->modules = std::move(all);
  // World and ticks were kept in order of time from the beginning.
  log->world.reserve(world_.size());
  for (auto& [time, sample] : world_) log->world.push_back(std::move(sample));
  world_.clear();
  log->ticks_us.assign(ticks_.begin(), ticks_.end());
  ticks_.clear();
}

}  // namespace morphbus::logger
