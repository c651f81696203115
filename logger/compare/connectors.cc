#include "logger/compare/connectors.h"

#include <algorithm>
#include <tuple>

#include "bridge/description/link_places.h"
#include "bridge/description/run_model.h"

namespace morphbus::logger {
namespace {

/// Mates that lie closer than this (m, rad) are mated alike; docs/log.md states them as
/// 1 mm and 0.6°.
constexpr double kSameMateM = 1e-3;
constexpr double kSameTurnRad = 1e-2;

/// The sim times (µs) of a series' samples.
template <class Samples>
std::vector<int64_t> TimesOf(const Samples& samples) {
  std::vector<int64_t> times;
  for (const auto& sample : samples) times.push_back(sample.time_us);
  return times;
}

/// Connector (of A), state variable, value.
using Command = std::tuple<int, int, int>;

/// The commands of one sample in order, each connector named by its index in A. `index_in_a` maps
/// the connectors of B; null for A's own.
std::vector<Command> CommandsIn(const ActuatorSample& sample, const std::vector<int>* index_in_a) {
  std::vector<Command> commands;
  for (const morphbus::connector_command_t& command : sample.connectors) {
    int connector = command.connector;
    // A connector without a counterpart in A is -1, and so never equals one of A's own.
    if (index_in_a != nullptr) {
      const bool known = connector >= 0 && connector < static_cast<int>(index_in_a->size());
      connector = known ? (*index_in_a)[connector] : -1;
    }
    commands.emplace_back(connector, command.state, command.value);
  }
  std::sort(commands.begin(), commands.end());
  return commands;
}

}  // namespace

CountTrack CommandDifferences(const RunLog& a, const RunLog& b, const ModulePair& pair,
                              int64_t end_us) {
  const auto& samples_a = a.modules[pair.a].actuators;
  const auto& samples_b = b.modules[pair.b].actuators;
  CountTrack track;
  // What stands in one sorted row and not in the other, only one of the two commanded.
  ForCommonTimes(TimesOf(samples_a), TimesOf(samples_b), end_us, [&](size_t i, size_t j) {
    const std::vector<Command> in_a = CommandsIn(samples_a[i], nullptr);
    const std::vector<Command> in_b = CommandsIn(samples_b[j], &pair.connector_a_of_b);
    std::vector<Command> unshared;
    std::set_symmetric_difference(in_a.begin(), in_a.end(), in_b.begin(), in_b.end(),
                                  std::back_inserter(unshared));
    track.Add(samples_a[i].time_us, static_cast<int>(unshared.size()));
  });
  return track;
}

CountTrack UnsharedCommands(const RunLog& a, const RunLog& b, const ModulePair& pair,
                            int64_t window_us, int64_t end_us) {
  // Every command with its time; a connector of B is named by that of A at its place.
  struct Given {
    int64_t time_us;
    Command command;
    bool met;
  };
  const auto all = [end_us](const std::vector<ActuatorSample>& samples,
                            const std::vector<int>* map) {
    std::vector<Given> given;
    for (const ActuatorSample& sample : samples) {
      if (sample.time_us > end_us) break;
      for (const Command& command : CommandsIn(sample, map)) {
        given.push_back({sample.time_us, command, false});
      }
    }
    return given;
  };
  std::vector<Given> in_a = all(a.modules[pair.a].actuators, nullptr);
  std::vector<Given> in_b = all(b.modules[pair.b].actuators, &pair.connector_a_of_b);
  // Each of A meets the first of B that is the same and near enough; both rows are in order of
  // time.
  size_t first = 0;
  for (Given& one : in_a) {
    while (first < in_b.size() && in_b[first].time_us < one.time_us - window_us) ++first;
    for (size_t j = first; j < in_b.size() && in_b[j].time_us <= one.time_us + window_us; ++j) {
      if (in_b[j].met || in_b[j].command != one.command) continue;
      one.met = in_b[j].met = true;
      break;
    }
  }
  // The count at every sample of A, and at the times of B's commands that nobody met.
  std::map<int64_t, int> counts;
  for (const ActuatorSample& sample : a.modules[pair.a].actuators) {
    if (sample.time_us <= end_us) counts[sample.time_us];
  }
  for (const auto* row : {&in_a, &in_b}) {
    for (const Given& one : *row) counts[one.time_us] += one.met ? 0 : 1;
  }
  CountTrack track;
  for (const auto& [time_us, count] : counts) track.Add(time_us, count);
  return track;
}

DockingComparer::DockingComparer(const RunLog& a, const RunLog& b, const Matching& matching)
    : a_{&a, a.described->X_RL_start, ModelIndices(a), {}},
      b_{&b, b.described->X_RL_start, ModelIndices(b), {}} {
  for (int i = 0; i < static_cast<int>(matching.pairs.size()); ++i) {
    a_.pair_of_id[a.modules[matching.pairs[i].a].id] = i;
    b_.pair_of_id[b.modules[matching.pairs[i].b].id] = i;
  }
}

DockingComparer::Docking DockingComparer::See(const Side& side, const ModuleSeries& module,
                                              const morphbus::docked_connector_t& docked) {
  const model::Robot& robot = *side.log->robot;
  const int own = module.model_index;
  const morphbus::docked_connector_t by_index = WithModelIndex(side.model_index_of_id, docked);
  const int mate = by_index.mate_module;
  const std::optional<model::Pose> X_OwnMate =
      bridge::DockedPose(*side.log->model, robot, own, by_index);
  if (!X_OwnMate) return {};
  // All link frames of a module coincide at joint values 0, for which X_OwnMate is given.
  const auto X_RL = [&](int m, int connector) -> const model::Pose& {
    return side.X_RL[m][side.log->model->TypeOf(robot, m).connectors[connector].link];
  };
  return {IndexById(side.pair_of_id, docked.mate_module),
          X_RL(own, docked.connector) * *X_OwnMate * X_RL(mate, docked.mate_connector).inverse()};
}

bool DockingComparer::Same(const Docking& a, const Docking& b) {
  // A mate that answers to nobody is -1 on both sides; then only its place counts.
  if (a.mate != b.mate) return false;
  const model::Pose apart = b.moved.inverse() * a.moved;
  // Near the robot frame's origin a turn moves nothing, so it is asked for by itself.
  return apart.translation().norm() < kSameMateM &&
         Eigen::AngleAxisd(apart.linear()).angle() < kSameTurnRad;
}

/// How many dockings only one of the two samples has.
int DockingComparer::Unshared(const ModulePair& pair, const SensorSample& a,
                              const SensorSample& b) const {
  // Each docking of A takes one of B that is the same; what is left on either side is not shared.
  std::vector<Docking> left;
  for (const auto& docked : b.docked) left.push_back(See(b_, b_.log->modules[pair.b], docked));
  int unshared = 0;
  for (const auto& docked : a.docked) {
    const Docking seen = See(a_, a_.log->modules[pair.a], docked);
    const auto found = std::find_if(left.begin(), left.end(),
                                    [&](const Docking& other) { return Same(seen, other); });
    if (found == left.end()) {
      ++unshared;
    } else {
      left.erase(found);
    }
  }
  return unshared + static_cast<int>(left.size());
}

CountTrack DockingComparer::Differences(const ModulePair& pair, int64_t end_us) const {
  const auto& samples_a = a_.log->modules[pair.a].sensors;
  const auto& samples_b = b_.log->modules[pair.b].sensors;
  CountTrack track;
  // Dockings change rarely: what was found for the last instant is mostly still true.
  const SensorSample* last_a = nullptr;
  const SensorSample* last_b = nullptr;
  ForCommonTimes(TimesOf(samples_a), TimesOf(samples_b), end_us, [&](size_t i, size_t j) {
    const bool unchanged = last_a != nullptr &&
                           bridge::SameDocked(last_a->docked, samples_a[i].docked) &&
                           bridge::SameDocked(last_b->docked, samples_b[j].docked);
    last_a = &samples_a[i];
    last_b = &samples_b[j];
    track.Add(last_a->time_us, unchanged ? track.value.back() : Unshared(pair, *last_a, *last_b));
  });
  return track;
}

}  // namespace morphbus::logger
