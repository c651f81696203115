#include <morphbus/observe/log.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "logger/compare/kinematic_tracks.h"
#include "tools/libraries/log_content.h"
#include "tools/libraries/model_content.h"

namespace morphbus {
namespace {

using logger::ModuleSeries;

/// No time of a run is later.
constexpr int64_t kEver = std::numeric_limits<int64_t>::max();

/// The double nearest to so many microseconds.
double SecondsOf(int64_t time_us) { return static_cast<double>(time_us) / 1e6; }

/// "m1.joint_1"; by its number where the log has no model.
template <class Part>
std::string PartName(const logger::RunLog& log, const ModuleSeries& module,
                     std::vector<Part> model::ModuleType::*parts, const char* kind, int index) {
  const bool known = log.robot != nullptr && module.model_index >= 0;
  const auto* list = known ? &(log.model->TypeOf(*log.robot, module.model_index).*parts) : nullptr;
  const bool named = list != nullptr && bridge::IsIndex(index, list->size());
  return module.name + "." + (named ? (*list)[index].name : kind + std::to_string(index));
}

std::string JointName(const logger::RunLog& log, const ModuleSeries& module, int joint) {
  return PartName(log, module, &model::ModuleType::joints, "joint", joint);
}
std::string LinkName(const logger::RunLog& log, const ModuleSeries& module, int link) {
  return PartName(log, module, &model::ModuleType::links, "link", link);
}

/// A stretch of sim time in which a joint's values count, and by what they are multiplied.
struct Stretch {
  int64_t begin_us = std::numeric_limits<int64_t>::min();
  int64_t end_us = kEver;
  /// Null: by 1.
  const logger::JointSigns* signs = nullptr;

  [[nodiscard]] bool Has(int64_t time_us) const { return time_us >= begin_us && time_us < end_us; }
  [[nodiscard]] double SignAt(int64_t time_us) const {
    const int sign = signs == nullptr ? 1 : signs->At(time_us);
    return sign == 0 ? 1 : sign;
  }
};

/// Adds what became of a joint in a stretch of time to its series.
void AddStretch(const ModuleSeries& module, int joint, const Stretch& stretch,
                JointSeries* series) {
  const auto index = static_cast<size_t>(joint);
  for (const logger::SensorSample& sample : module.sensors) {
    // A sample of a damaged log may have fewer joints than its module's type.
    if (!stretch.Has(sample.time_us) || index >= sample.position.size()) continue;
    const double sign = stretch.SignAt(sample.time_us);
    series->time_s.push_back(SecondsOf(sample.time_us));
    series->position.push_back(sign * sample.position[index]);
    series->velocity.push_back(sign * sample.velocity[index]);
    series->effort.push_back(sign * static_cast<double>(sample.effort[index]));
  }
  for (const logger::ActuatorSample& sample : module.actuators) {
    if (!stretch.Has(sample.time_us) || index >= sample.joints.size()) continue;
    const morphbus::joint_command_t& command = sample.joints[index];
    const bool has_target = command.mode == morphbus::joint_command_t::MODE_POSITION;
    series->command_time_s.push_back(SecondsOf(sample.time_us));
    series->target.push_back(has_target ? stretch.SignAt(sample.time_us) * command.target_si
                                        : std::numeric_limits<double>::quiet_NaN());
  }
}

/// When the log ends, µs of sim time.
int64_t EndOf(const logger::RunLog& log) {
  return log.ticks_us.empty() ? 0 : log.ticks_us.back() + log.tick_us;
}

/// How many joints a module has, or links: by its model, else by its first message.
size_t NumJoints(const logger::RunLog& log, const ModuleSeries& module) {
  if (log.robot != nullptr && module.model_index >= 0) {
    return log.model->TypeOf(*log.robot, module.model_index).joints.size();
  }
  return module.sensors.empty() ? 0 : module.sensors.front().position.size();
}
size_t NumLinks(const logger::RunLog& log, const ModuleSeries& module) {
  if (log.robot != nullptr && module.model_index >= 0) {
    return log.model->TypeOf(*log.robot, module.model_index).links.size();
  }
  return module.transforms.empty() ? 0 : module.transforms.front().X_RL.size();
}

/// A part of a module of the log.
struct Part {
  const ModuleSeries* module = nullptr;
  int index = 0;
};

/// The part called "m1.joint_1". Throws Failure where there is none.
Part FindPart(const logger::RunLog& log, std::string_view what, std::string_view name,
              size_t (*count)(const logger::RunLog& log, const ModuleSeries& module),
              std::string (*name_of)(const logger::RunLog& log, const ModuleSeries& module,
                                     int index)) {
  std::vector<std::string> names;
  for (const ModuleSeries& module : log.modules) {
    for (int i = 0; i < static_cast<int>(count(log, module)); ++i) {
      names.push_back(name_of(log, module, i));
      if (names.back() == name) return {&module, i};
    }
  }
  ThrowUnknown(what, name, names);
}

}  // namespace

Log::Content::Content(logger::RunLog the_log) : log(std::move(the_log)) {
  if (log.robot == nullptr) return;
  auto of_model = std::make_shared<Model::Content>(*log.model);
  robot.emplace(std::make_shared<morphbus::Robot::Content>(of_model, *log.robot));
}

const ModuleSeries& Log::Content::FindModule(std::string_view name) const {
  std::vector<std::string> names;
  for (const ModuleSeries& module : log.modules) {
    if (module.name == name) return module;
    names.push_back(module.name);
  }
  ThrowUnknown("module", name, names);
}

Log::Log(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

Log Log::Open(const std::string& path, const LogOptions& options) {
  logger::RunLogOptions how;
  how.run = options.run;
  Result<logger::RunLog> log = logger::LoadRunLog(path, how);
  if (!log) throw Failure(log.error().message);
  return Log(std::make_shared<Content>(std::move(*log)));
}

const std::string& Log::run() const { return content_->log.facts.run; }
const std::string& Log::hash() const { return content_->log.facts.run_hash; }
double Log::seconds() const { return content_->log.facts.seconds; }
double Log::tick_s() const { return SecondsOf(content_->log.tick_us); }
bool Log::whole() const { return content_->log.facts.whole(); }

std::string Log::InfoJson() const {
  // File names are bytes and need not be UTF-8, which JSON must be.
  return logger::FactsJson(content_->log.facts)
      .dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

Robot Log::robot() const {
  if (content_->robot) return *content_->robot;
  const std::vector<std::string>& problems = content_->log.facts.problems;
  throw Failure("the log does not say which robot ran" +
                (problems.empty() ? "" : ": " + problems.front()));
}

std::vector<std::string> Log::ModuleNames() const {
  std::vector<std::string> names;
  for (const ModuleSeries& module : content_->log.modules) names.push_back(module.name);
  return names;
}

std::vector<RolePlayed> Log::Roles(std::string_view module) const {
  const ModuleSeries& series = content_->FindModule(module);
  std::vector<RolePlayed> roles;
  for (const logger::RoleSpan& span : logger::RoleSpans(series, EndOf(content_->log))) {
    RolePlayed& role = roles.emplace_back();
    role = {SecondsOf(span.begin_us), SecondsOf(span.end_us), span.role, {}};
    for (const auto& [label, joint] : span.joints) {
      role.labels.emplace_back(label, JointName(content_->log, series, joint));
    }
    for (const auto& [label, link] : span.links) {
      role.labels.emplace_back(label, LinkName(content_->log, series, link));
    }
  }
  return roles;
}

JointSeries Log::JointNamed(std::string_view name) const {
  const Part part = FindPart(content_->log, "joint", name, NumJoints, JointName);
  JointSeries series;
  series.joint = std::string(name);
  AddStretch(*part.module, part.index, {}, &series);
  return series;
}

std::vector<JointSeries> Log::JointsLabelled(std::string_view role, std::string_view label) const {
  std::vector<JointSeries> all;
  std::set<std::string> roles, labels;
  for (const ModuleSeries& module : content_->log.modules) {
    // A module may give the role up and take it again, and the label may then name another joint.
    std::map<int, JointSeries> by_joint;
    for (const logger::RoleSpan& span : logger::RoleSpans(module, kEver)) {
      if (!span.role.empty()) roles.insert(span.role);
      if (span.role != role) continue;
      for (const auto& [name, joint] : span.joints) {
        labels.insert(name);
        if (name != label || joint < 0) continue;
        const logger::JointSigns signs(module, joint);
        JointSeries& series = by_joint[joint];
        series.joint = JointName(content_->log, module, joint);
        AddStretch(module, joint, {span.begin_us, span.end_us, &signs}, &series);
      }
    }
    for (auto& [joint, series] : by_joint) all.push_back(std::move(series));
  }
  if (!all.empty()) return all;
  if (roles.count(std::string(role)) == 0) {
    ThrowUnknown("role in the log", role, {roles.begin(), roles.end()});
  }
  ThrowUnknown("joint of that role labelled", label, {labels.begin(), labels.end()});
}

PoseSeries Log::SimulatedPose(std::string_view link) const {
  const Part part = FindPart(content_->log, "link", link, NumLinks, LinkName);
  PoseSeries series;
  series.link = std::string(link);
  if (content_->log.robot == nullptr || part.module->model_index < 0) return series;
  const logger::SimulatedPoses poses(content_->log);
  for (size_t i = 0; i < content_->log.world.size(); ++i) {
    const auto X_WL = poses.X_WL(i, part.module->model_index, part.index);
    if (!X_WL) continue;
    series.time_s.push_back(SecondsOf(content_->log.world[i].time_us));
    series.pose.push_back(ToPublic(*X_WL));
  }
  return series;
}

PoseSeries Log::PropagatedPose(std::string_view link) const {
  const Part part = FindPart(content_->log, "link", link, NumLinks, LinkName);
  const logger::PoseTrack track = logger::PropagatedTrack(*part.module, part.index);
  PoseSeries series;
  series.link = std::string(link);
  for (size_t i = 0; i < track.time_us.size(); ++i) {
    series.time_s.push_back(SecondsOf(track.time_us[i]));
    series.pose.push_back(ToPublic(track.value[i]));
  }
  return series;
}

}  // namespace morphbus
