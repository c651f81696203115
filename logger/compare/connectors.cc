#include "logger/compare/connectors.h"

#include <algorithm>
#include <tuple>

namespace morphbus::logger {
namespace {

/// Mates that lie closer than this (m, rad) are mated alike; docs/log.md states them as
/// 1 mm and 0.6°.
constexpr double kSamePlaceM = 1e-3;
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

/// True if both samples of one module hold the same entries, so that nothing need be computed anew.
bool SameDockings(const SensorSample& a, const SensorSample& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.connector == y.connector && x.mate_connector == y.mate_connector &&
           x.mate_module == y.mate_module && x.connection_type == y.connection_type &&
           x.number == y.number;
  };
  return std::equal(a.docked.begin(), a.docked.end(), b.docked.begin(), b.docked.end(), same);
}

/// The value at `index`; -1 outside the row, as an index in a damaged message may be.
int At(const std::vector<int>& values, int index) {
  return index >= 0 && index < static_cast<int>(values.size()) ? values[index] : -1;
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
    track.time_us.push_back(samples_a[i].time_us);
    track.count.push_back(static_cast<int>(unshared.size()));
  });
  return track;
}

DockingComparer::DockingComparer(const RunLog& a, const RunLog& b, const Matching& matching)
    : a_{&a, RestPosesOf(a), {}, {}}, b_{&b, RestPosesOf(b), {}, {}} {
  // Module ids are small numbers from SENSORS, so rows by id stay short.
  const auto enter = [](const ModuleSeries& module, int pair, Side* side) {
    if (module.id < 0) return;
    if (module.id >= static_cast<int>(side->pair_of_id.size())) {
      side->pair_of_id.resize(module.id + 1, -1);
      side->model_index_of_id.resize(module.id + 1, -1);
    }
    side->pair_of_id[module.id] = pair;
    side->model_index_of_id[module.id] = module.model_index;
  };
  for (int i = 0; i < static_cast<int>(matching.pairs.size()); ++i) {
    enter(a.modules[matching.pairs[i].a], i, &a_);
    enter(b.modules[matching.pairs[i].b], i, &b_);
  }
}

/// Reads a docking by the connection that it names. Between unlike module types only one of them is
/// the connection's member a; the other's entry holds the inverse.
DockingComparer::Docking DockingComparer::See(const Side& side, const ModuleSeries& module,
                                              const morphbus::docked_connector_t& docked) const {
  const model::Model& model = *side.log->model;
  // An entry of a mate or a connection that the model lacks says nothing that could be compared.
  const int mate = At(side.model_index_of_id, docked.mate_module);
  const int type = docked.connection_type;
  if (mate < 0 || type < 0 || type >= static_cast<int>(model.connection_types.size())) return {};
  const model::ConnectionType& connection = model.connection_types[type];
  if (docked.number < 1 || docked.number > static_cast<int>(connection.options.size())) return {};
  const model::ConnectionOption& option = connection.options[docked.number - 1];

  // The option must be one of these two connectors, with this module as member a or b.
  const auto& modules = side.log->robot->modules;
  const auto fits = [&](int type_a, int type_b, int connector_a, int connector_b) {
    return connection.type_a == type_a && connection.type_b == type_b &&
           option.connector_a == connector_a && option.connector_b == connector_b;
  };
  const int own_type = modules[module.model_index].type;
  const int mate_type = modules[mate].type;
  model::Pose X_OwnMate = option.X_AB;
  if (!fits(own_type, mate_type, docked.connector, docked.mate_connector)) {
    if (!fits(mate_type, own_type, docked.mate_connector, docked.connector)) return {};
    X_OwnMate = option.X_AB.inverse();
  }

  // All link frames of a module coincide at joint values 0, for which X_AB is given.
  const int own_link = model.module_types[own_type].connectors[docked.connector].link;
  const int mate_link = model.module_types[mate_type].connectors[docked.mate_connector].link;
  const model::Pose X_RMate = side.X_RL[module.model_index][own_link] * X_OwnMate;
  return {At(side.pair_of_id, docked.mate_module), X_RMate * side.X_RL[mate][mate_link].inverse()};
}

bool DockingComparer::Same(const Docking& a, const Docking& b) const {
  // A mate that answers to nobody is -1 on both sides; then only its place counts.
  if (a.mate != b.mate) return false;
  const model::Pose apart = b.moved.inverse() * a.moved;
  // Near the robot frame's origin a turn moves nothing, so it is asked for by itself.
  return apart.translation().norm() < kSamePlaceM &&
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
    const bool unchanged = last_a != nullptr && SameDockings(*last_a, samples_a[i]) &&
                           SameDockings(*last_b, samples_b[j]);
    last_a = &samples_a[i];
    last_b = &samples_b[j];
    track.time_us.push_back(last_a->time_us);
    track.count.push_back(unchanged ? track.count.back() : Unshared(pair, *last_a, *last_b));
  });
  return track;
}

}  // namespace morphbus::logger
