#include "tools/commands/inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <utility>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/held_state.h"
#include "tools/base/messages.h"
#include "tools/convert/held_report.h"

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

/// The name of a label's part; nothing for one that is not resolved.
Json LabelJson(const model::ModuleType& type, const morphbus::label_t& label) {
  if (label.index < 0) return nullptr;
  if (label.kind == morphbus::label_t::KIND_JOINT) {
    if (label.index < std::ssize(type.joints)) return type.joints[label.index].name;
  } else if (label.index < std::ssize(type.links)) {
    return type.links[label.index].name;
  }
  return label.index;
}

}  // namespace

InspectionListener::InspectionListener(bridge::Bus* bus, const ControlledRun& run,
                                       std::string module)
    : bus_(*bus), run_(run), module_(std::move(module)) {
  const bridge::HeldSubscriptions together(bus);
  const std::string& name = run.entry.name;
  bus_.Subscribe(
      bridge::Channel(name, "", Topic::kClock),
      [this](std::string_view, const uint8_t* data, size_t size) { OnClock(data, size); });
  bus_.Subscribe(
      bridge::Channel(name, "", Topic::kSensors),
      [this](std::string_view, const uint8_t* data, size_t size) { OnSensors(data, size); });
  for (const model::ModuleInstance& each : run.plan.robot().modules) {
    if (!module_.empty() && each.name != module_) continue;
    bus_.Subscribe(bridge::Channel(name, each.name, Topic::kStatus),
                   [this, of = each.name](std::string_view, const uint8_t* data, size_t size) {
                     OnStatus(of, data, size);
                   });
  }
}

void InspectionListener::OnClock(const uint8_t* data, size_t size) {
  morphbus::sim_clock_t clock;
  if (!bridge::Decode(data, size, {run_.plan.description.model_hash(), 0}, &clock)) return;
  clock_heard_ = true;
  clock_tick_ = clock.header.tick;
  ended_ = clock.phase == morphbus::sim_clock_t::PHASE_END;
}

void InspectionListener::OnSensors(const uint8_t* data, size_t size) {
  morphbus::sensors_t sensors;
  if (!bridge::Decode(data, size, {run_.plan.description.model_hash(), 0}, &sensors)) return;
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

void InspectionListener::OnStatus(const std::string& module, const uint8_t* data, size_t size) {
  morphbus::status_t status;
  if (!bridge::Decode(data, size, {run_.plan.description.model_hash(), 0}, &status)) return;
  if (status.inspections.empty()) return;
  std::map<int64_t, Parts>& ticks = parts_[module];
  ticks[status.header.tick].insert_or_assign(status.inspections.front().part, status);
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
  // Every part says the rest as well.
  const morphbus::status_t& status = parts.begin()->second;
  const model::ModuleType& type = run_.plan.model.TypeOf(run_.plan.robot(), module);
  Json labels = Json::object(), conventions = Json::object();
  for (const morphbus::label_t& label : status.labels) labels[label.name] = LabelJson(type, label);
  for (int j = 0; j < std::min(std::ssize(status.joint_sign), std::ssize(type.joints)); ++j) {
    conventions[type.joints[j].name] = status.joint_sign[j];
  }
  std::vector<morphbus::inspection_t> told;
  for (const auto& [number, part] : parts) told.push_back(part.inspections.front());
  const Result<bridge::HeldState> held = bridge::JoinHeld(told);
  return {{"module", run_.plan.robot().modules[module].name},
          {"type", status.type_name},
          {"tick", status.header.tick},
          {"seconds", static_cast<double>(status.header.sim_time_us) * 1e-6},
          {"role", status.role < 0 ? Json(nullptr) : Json(status.role_name)},
          {"frozen", status.frozen != 0},
          {"has_pose", status.has_pose != 0},
          {"pose_stale", status.pose_stale != 0},
          {"labels", labels},
          {"conventions", conventions},
          {"fields", FieldsJson(held ? held->fields : std::vector<bridge::HeldValue>())},
          {"tasks", TasksJson(held ? held->tasks : std::vector<bridge::HeldTask>())}};
}

Json InspectionListener::answers() const {
  Json answers = Json::array();
  for (int m = 0; m < std::ssize(run_.plan.robot().modules); ++m) {
    const Parts* parts = AnswerOf(run_.plan.robot().modules[m].name);
    if (parts != nullptr) answers.push_back(AnswerJson(m, *parts));
  }
  return answers;
}

std::string AnswersText(const Json& answers) {
  std::string text;
  for (const Json& answer : answers) {
    text += fmt::format("{}: role {}{}, pose {}\n", answer["module"].get<std::string>(),
                        answer["role"].is_null() ? "none" : answer["role"].get<std::string>(),
                        answer["frozen"].get<bool>() ? " (frozen)" : "",
                        !answer["has_pose"].get<bool>()    ? "unknown"
                        : answer["pose_stale"].get<bool>() ? "stale"
                                                           : "known");
    for (const auto& [name, part] : answer["labels"].items()) {
      text += fmt::format("  label {} = {}\n", name,
                          part.is_string() ? part.get<std::string>() : "(not resolved)");
    }
    for (const auto& [joint, sign] : answer["conventions"].items()) {
      if (sign.get<int>() == 0) continue;
      text += fmt::format("  joint {}: sign {}\n", joint, sign.get<int>() > 0 ? "+" : "-");
    }
    text += FieldsText(answer["fields"]) + TasksText(answer["tasks"]);
  }
  return text;
}

}  // namespace morphbus::tools
