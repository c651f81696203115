#include "tools/commands/inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "bridge/wire/channels.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/plan/control_script.h"

namespace morphbus::tools {
namespace {

using bridge::Topic;

/// Ticks of which is kept what was heard.
constexpr size_t kMostTicksOfAnswer = 64;

/// Keeps the newest ticks only.
template <class Map>
void DropOld(Map* ticks) {
  while (ticks->size() > kMostTicksOfAnswer) ticks->erase(ticks->begin());
}

}  // namespace

InspectionListener::InspectionListener(bridge::Bus* bus, const ControlledRun& run,
                                       std::string module)
    : bus_(*bus), run_(run), module_(std::move(module)) {
  // One batch, so that the bus sets itself up once for all channels.
  const bridge::SubscriptionBatch together(bus);
  const std::string& name = run.entry.name;
  const auto take = [this](std::string_view channel, const uint8_t* data, size_t size) {
    Take(channel, data, size);
  };
  bus_.Subscribe(bridge::Channel(name, "", Topic::kClock), take);
  bus_.Subscribe(bridge::Channel(name, "", Topic::kSensors), take);
  // All modules, or the one that is asked.
  for (const model::ModuleInstance& each : run.plan.robot().modules) {
    if (!module_.empty() && each.name != module_) continue;
    bus_.Subscribe(bridge::Channel(name, each.name, Topic::kStatus), take);
  }
}

void InspectionListener::Take(std::string_view channel, const uint8_t* data, size_t size) {
  const Result<bridge::RunMessage> message = bridge::OpenMessage(channel, data, size);
  const auto model_hash = static_cast<int64_t>(run_.plan.description.model_hash());
  // A message of another model is of another run, which had the same name before.
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
  // SENSORS name the modules that are to answer in this tick, each part those that it holds.
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
  const std::string module(message.name.process);
  // An answer may come in several STATUS messages; it counts once it is whole.
  auto held = collectors_.try_emplace(module, kMostTicksOfAnswer).first->second.Take(status);
  if (!held) return;
  auto& answers = answers_[module];
  // Of several answers of one tick, as after a restart, the last one counts.
  answers.insert_or_assign(message.header.tick, Inspection{std::move(status), *std::move(held)});
  DropOld(&answers);
}

const Inspection* InspectionListener::AnswerOf(const std::string& module) const {
  const auto answers = answers_.find(module);
  if (answers == answers_.end()) return nullptr;
  // In real time a module may answer a tick later.
  const auto answer = answers->second.lower_bound(asked_tick_);
  return answer == answers->second.end() ? nullptr : &answer->second;
}

std::vector<std::string> InspectionListener::Missing() const {
  // A module that is lost is not asked.
  // Until all parts have come, every module counts as asked.
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
  // From here on SENSORS of that tick say which modules must answer; those that came before are
  // kept.
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

Json InspectionListener::AnswerJson(int module, const Inspection& answer) const {
  // A program that was deployed since lies in the run's folder, and names its source.
  const auto hash = static_cast<uint64_t>(answer.status.header.program_hash);
  const auto& description = run_.plan.description;
  // Names of roles and fields are in the answer; only the source's name is in the image.
  const std::string image =
      hash == description.program_hash()
          ? description.program_image()
          : ReadFile(ImagePath(run_.entry.folder, hash), vm::kMaxImageBytes).value_or("");
  return InspectionJson(run_.plan.robot().modules[module].name,
                        run_.plan.model.TypeOf(run_.plan.robot(), module), answer,
                        SourceOfImage(image));
}

Json InspectionListener::answers() const {
  Json answers = Json::array();
  for (int m = 0; m < std::ssize(run_.plan.robot().modules); ++m) {
    const Inspection* answer = AnswerOf(run_.plan.robot().modules[m].name);
    if (answer != nullptr) answers.push_back(AnswerJson(m, *answer));
  }
  return answers;
}

}  // namespace morphbus::tools
