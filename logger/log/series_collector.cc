#include "logger/log/series_collector.h"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/wire/status_codec.h"

namespace morphbus::logger {
namespace {

/// Leaves one sample a time if `unique`, in order of sim time.
template <class Sample>
void SortByTime(std::vector<Sample>* samples, bool unique) {
  // Our own recorder writes in order, and then there is nothing to move.
  if (!std::ranges::is_sorted(*samples, {}, &Sample::time_us)) {
    std::ranges::stable_sort(*samples, {}, &Sample::time_us);
  }
  if (!unique) return;
  const auto at_one_time = [](const Sample& a, const Sample& b) { return a.time_us == b.time_us; };
  samples->erase(std::unique(samples->begin(), samples->end(), at_one_time), samples->end());
}

/// Moves the samples before `end_us` from those that were read ahead to a series, in order of time
/// and one a time.
template <class Sample>
void TakeBefore(int64_t end_us, std::vector<Sample>* ahead, std::vector<Sample>* series) {
  // What was read ahead may be out of order; what is older than `end_us` is whole by now.
  SortByTime(ahead, true);
  const auto end = std::ranges::lower_bound(*ahead, end_us, {}, &Sample::time_us);
  series->assign(std::make_move_iterator(ahead->begin()), std::make_move_iterator(end));
  ahead->erase(ahead->begin(), end);
}

/// Puts what is known of the world in order of time, with one sample for all parts of an instant.
void JoinParts(std::vector<WorldSample>* world) {
  SortByTime(world, false);
  // Samples are joined in place, so that the world is never held twice.
  size_t joined = 0;
  for (size_t i = 1; i < world->size(); ++i) {
    WorldSample& last = (*world)[joined];
    WorldSample& next = (*world)[i];
    if (next.time_us != last.time_us) {
      if (++joined != i) (*world)[joined] = std::move(next);
      continue;
    }
    last.bodies.insert(last.bodies.end(), next.bodies.begin(), next.bodies.end());
    last.contacts.insert(last.contacts.end(), next.contacts.begin(), next.contacts.end());
  }
  if (!world->empty()) world->resize(joined + 1);
}

/// Whether a module says the same of its role, conventions and pose.
bool SaysTheSame(const morphbus::status_t& a, const morphbus::status_t& b) {
  const auto plain = [](const morphbus::status_t& s) {
    return std::tie(s.role_name, s.role, s.joint_sign, s.has_pose, s.pose_stale, s.frozen,
                    s.incarnation);
  };
  return plain(a) == plain(b) &&
         std::ranges::equal(a.labels, b.labels,
                            [](const morphbus::label_t& p, const morphbus::label_t& q) {
                              return p.name == q.name && p.kind == q.kind && p.index == q.index;
                            });
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

bool SeriesCollector::Decodes(const bridge::RunMessage& message) {
  return message.name.topic != bridge::Topic::kTransform;
}

void SeriesCollector::OnSensors(const bridge::RunMessage& /*message*/,
                                morphbus::sensors_t&& sensors) {
  for (morphbus::module_sensors_t& reading : sensors.modules) {
    // Velocities are floats on the wire, and doubles in a series.
    const std::vector<float>& velocity = reading.joint_velocity_si;
    Module(reading.name)
        .sensors.push_back({sensors.header.sim_time_us, std::move(reading.joint_position_si),
                            std::vector<double>(velocity.begin(), velocity.end()),
                            std::move(reading.docked), std::move(reading.sensor_value),
                            std::move(reading.joint_effort_si)});
  }
}

void SeriesCollector::OnActuator(const bridge::RunMessage& message,
                                 morphbus::actuator_t&& actuator) {
  Module(message.name.process)
      .actuators.push_back({actuator.header.sim_time_us, std::move(actuator.joints),
                            std::move(actuator.connectors)});
}

void SeriesCollector::OnWorld(const bridge::RunMessage& /*message*/, morphbus::world_t&& world) {
  world_.push_back({world.header.sim_time_us, std::move(world.bodies), std::move(world.contacts)});
}

void SeriesCollector::TakeTransform(const bridge::RunMessage& message, bool only_changes) {
  std::vector<TransformSample>& transforms = Module(message.name.process).transforms;
  const bridge::RoleAndPose said = bridge::RoleAndPoseOf(message);
  const bool changed = transforms.empty() || transforms.back().role != said.role ||
                       (!transforms.back().has_pose && said.has_pose);
  // An outline needs only the samples in which a role changes or poses begin.
  if (only_changes && !changed) return;
  transforms.push_back({message.header.sim_time_us, said.role, said.has_pose, said.pose_stale,
                        bridge::LinkPosesOf(message)});
}

void SeriesCollector::TakeStatus(std::string_view module, int64_t time_us,
                                 morphbus::status_t&& status, bool only_changes) {
  std::vector<StatusSample>& known = Module(module).status;
  const bool came_to_trace =
      status.inspections.empty() && std::ranges::any_of(status.prints, bridge::IsTrace);
  if ((came_to_trace || only_changes) && !known.empty() &&
      SaysTheSame(known.back().status, status)) {
    return;
  }
  status.faults.clear();
  status.prints.clear();
  const int64_t tick = status.header.tick;
  known.push_back({time_us, tick, std::move(status)});
}

void SeriesCollector::TakeTraces(std::string_view module, int64_t time_us,
                                 const morphbus::status_t& status) {
  std::vector<TraceSample>& traces = Module(module).traces;
  for (const morphbus::print_t& print : status.prints) {
    if (!bridge::IsTrace(print)) continue;
    traces.push_back({time_us, status.header.tick,
                      static_cast<uint64_t>(status.header.program_hash), status.role,
                      status.role_name, bridge::FromTrace(print)});
  }
}

void SeriesCollector::Finish(RunLog* log) {
  // Only of STATUS may several have one time: a tick with many faults has more than one message.
  std::vector<ModuleSeries> all;
  for (auto& [name, module] : modules_) {
    SortByTime(&module.sensors, true);
    SortByTime(&module.transforms, true);
    SortByTime(&module.actuators, true);
    SortByTime(&module.status, false);
    SortByTime(&module.traces, false);
    if (log->robot != nullptr) module.model_index = log->robot->FindModule(name).value_or(-1);
    all.push_back(std::move(module));
  }
  modules_.clear();
  // Modules that the model lacks come last, in order of their number in SENSORS.
  std::ranges::sort(all, {}, [](const ModuleSeries& m) {
    const int rank = m.model_index >= 0 ? m.model_index : 1'000'000 + std::max(m.id, 0);
    return std::pair(rank, std::string_view(m.name));
  });
  log->modules = std::move(all);
  JoinParts(&world_);
  log->world = std::move(world_);
  world_.clear();
  // Ticks were kept in order of time from the beginning.
  log->ticks_us.assign(ticks_.begin(), ticks_.end());
  ticks_.clear();
}

void SeriesCollector::MoveBefore(int64_t end_us, RunLog* log) {
  for (ModuleSeries& series : log->modules) {
    ModuleSeries& ahead = Module(series.name);
    TakeBefore(end_us, &ahead.sensors, &series.sensors);
    TakeBefore(end_us, &ahead.transforms, &series.transforms);
    TakeBefore(end_us, &ahead.actuators, &series.actuators);
  }
  // A module that the outline does not have is in no comparison, and must not pile up.
  if (modules_.size() > log->modules.size()) {
    std::erase_if(modules_,
                  [log](const auto& module) { return log->FindModule(module.first) == nullptr; });
  }
  JoinParts(&world_);
  TakeBefore(end_us, &world_, &log->world);
}

}  // namespace morphbus::logger
