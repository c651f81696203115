#include "tools/commands/inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "bridge/wire/channels.h"
#include "tools/base/files.h"
#include "tools/base/inspection_report.h"
#include "tools/base/messages.h"
#include "tools/launch/control_script.h"

namespace morphbus::tools {
namespace {

using bridge::Topic;

/// Ticks of which is kept what was heard.
constexpr size_t kKeptTicks = 64;

/// Keeps the newest ticks only.
template <class Map>
void DropOld(Map* ticks) {
  while (ticks->size() > kKeptTicks) ticks->erase(ticks->begin());
}

}  // namespace

InspectionListener::InspectionListener(bridge::Bus* bus, const ControlledRun& run,
                                       std::string module)
    : bus_(*bus), run_(run), module_(std::move(module)) {
  const bridge::SubscriptionBatch together(bus);
  const std::string& name = run.entry.name;
  const auto take = [this](std::string_view channel, const uint8_t* data, size_t size) {
    Take(channel, data, size);
  };
  bus_.Subscribe(bridge::Channel(name, "", Topic::kClock), take);
  bus_.Subscribe(bridge::Channel(name, "", Topic::kSensors), take);
  for (const model::ModuleInstance& each : run.plan.robot().modules) {
    if (!module_.empty() && each.name != module_) continue;
    bus_.Subscribe(bridge::Channel(name, each.name, Topic::kStatus), take);
  }
}

void InspectionListener::Take(std::string_view channel, const uint8_t* data, size_t size) {
  const Result<bridge::RunMessage> message = bridge::OpenMessage(channel, data, size);
  const auto model_hash = static_cast<int64_t>(run_.plan.description.model_hash());
  if (message && message->header.model_hash == model_hash) bridge::ReadMessage(*message, this);
}

void InspectionListener::OnClock(const bridge::RunMessage& /*message*/,
                                 morphbus::sim_clock_t&& clock) {
  clock_heard_ = true;
  clock_tick_ = clock.header.tick;
  ended_ = clock.phase == morphbus::sim_clock_t::PHASE_END;
}

void InspectionListener::OnSensors(const bridge::RunMessage& /*message*/,
                                   morphbus::sensors_t&& sensors) {
  Asked& asked = asked_[sensors.header.tick];
  asked.parts.insert(sensors.part);
  asked.num_parts = sensors.num_parts;
  for (const int16_t id : sensors.inspected) {
    for (const morphbus::module_sensors_t& reading : sensors.modules) {
      if (reading.module_id == id) asked.modules.insert(reading.name);
    }
  }
  DropOld(&asked_);
}

void InspectionListener::OnStatus(const bridge::RunMessage& message, morphbus::status_t&& status) {
  if (status.inspections.empty()) return;
  std::map<int64_t, Parts>& ticks = parts_[std::string(message.name.process)];
  const int16_t part = status.inspections.front().part;
  ticks[message.header.tick].insert_or_assign(part, std::move(status));
  DropOld(&ticks);
}

const InspectionListener::Parts* InspectionListener::AnswerOf(const std::string& module) const {
  const auto ticks = parts_.find(module);
  if (ticks == parts_.end()) return nullptr;
  // In real time a module may answer a tick later.
  for (auto it = ticks->second.lower_bound(asked_tick_); it != ticks->second.end(); ++it) {
    const morphbus::status_t& any = it->second.begin()->second;
    if (std::ssize(it->second) == any.inspections.front().num_parts) return &it->second;
  }
  return nullptr;
}

std::vector<std::string> InspectionListener::Missing() const {
  // A module that is lost is not asked.
  const auto asked = asked_.find(asked_tick_);
  const bool known =
      asked != asked_.end() && std::ssize(asked->second.parts) == asked->second.num_parts;
  std::vector<std::string> missing;
  for (const model::ModuleInstance& module : run_.plan.robot().modules) {
    if (!module_.empty() && module.name != module_) continue;
    if (known && !asked->second.modules.contains(module.name)) continue;
    if (AnswerOf(module.name) == nullptr) missing.push_back(module.name);
  }
  return missing;
}

std::string InspectionListener::Await(int64_t tick, const bridge::TimeSource& time,
                                      const std::function<bool()>& stop) {
  asked_tick_ = tick;
  // Time counts anew while the run is alive and has not got there: it may hold still.
  int64_t until_us = time.NowUs() + kControlPatienceUs;
  while (!Missing().empty()) {
    const bool on_its_way = std::exchange(clock_heard_, false) && clock_tick_ < tick;
    if (on_its_way) until_us = time.NowUs() + kControlPatienceUs;
    if (ended_ && clock_tick_ <= tick) return "the run ended before";
    if (stop()) return "interrupted";
    if (time.NowUs() > until_us) return "no answer from " + NameSome(Missing());
    bus_.Handle(20);
  }
  return "";
}

Json InspectionListener::AnswerJson(int module, const Parts& parts) const {
  std::vector<morphbus::status_t> statuses;
  for (const auto& [number, part] : parts) statuses.push_back(part);
  // A program that was deployed since lies in the run's folder, and names its source.
  const auto hash = static_cast<uint64_t>(statuses.front().header.program_hash);
  const auto& description = run_.plan.description;
  const std::string image =
      hash == description.program_hash()
          ? description.program_image()
          : ReadFile(ImagePath(run_.entry.folder, hash), vm::kMaxImageBytes).value_or("");
  return InspectionJson(run_.plan.robot().modules[module].name,
                        run_.plan.model.TypeOf(run_.plan.robot(), module), statuses,
                        SourceOfImage(image));
}

Json InspectionListener::answers() const {
  Json answers = Json::array();
  for (int m = 0; m < std::ssize(run_.plan.robot().modules); ++m) {
    const Parts* parts = AnswerOf(run_.plan.robot().modules[m].name);
    if (parts != nullptr) answers.push_back(AnswerJson(m, *parts));
  }
  return answers;
}

}  // namespace morphbus::tools
