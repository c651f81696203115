#include "sim/docking.h"

#include <algorithm>
#include <cmath>

namespace morphbus::sim {
namespace {

using model::Docking;

// The state variable that a requirement speaks of, and the index of the value it wants.
struct Wanted {
  int module = 0;
  int connector = 0;
  size_t variable = 0;
  int value = 0;
};

// What `setting` needs of the two connectors of `docking`. A requirement for a variable or value
// that a connector does not have is no requirement.
std::vector<Wanted> WantedStates(const model::Model& model, const model::Robot& robot,
                                 const Docking& docking, const model::StateSetting& setting) {
  std::vector<Wanted> wanted;
  for (const model::StateRequirement& requirement : setting) {
    const int module = requirement.of_a ? docking.module_a : docking.module_b;
    const int connector = requirement.of_a ? docking.connector_a : docking.connector_b;
    const std::vector<model::StateVariable>& variables =
        model.TypeOf(robot, module).connectors[connector].states;
    for (size_t v = 0; v < variables.size(); ++v) {
      if (variables[v].name != requirement.variable) continue;
      // The model tells the value itself, states are told by index.
      const auto& values = variables[v].values;
      const auto found = std::find(values.begin(), values.end(), requirement.value);
      if (found == values.end()) continue;
      wanted.push_back({module, connector, v, static_cast<int>(found - values.begin())});
    }
  }
  return wanted;
}

// How far links La (of module a) and Lb are from where `option` wants them; infinite if too far.
double Misfit(const model::ConnectionOption& option, const Pose& X_WLa, const Pose& X_WLb,
              const Eigen::Vector3d& p_LbCo) {
  // The connector of b, where it is and where the option wants it, both seen from a.
  const Pose X_LaLb = X_WLa.inverse() * X_WLb;
  const double distance = (X_LaLb * p_LbCo - option.X_AB * p_LbCo).norm();
  const Eigen::AngleAxisd turn(X_LaLb.linear().transpose() * option.X_AB.linear());
  if (distance > kDockingDistance || std::abs(turn.angle()) > kDockingAngle) return INFINITY;
  // Metres and radians in one figure: a turn counts as a way at 5 cm from the axis.
  return distance + 0.05 * std::abs(turn.angle());
}

// One connector of one module.
struct End {
  int module = 0;
  int connector = 0;
};

// Looks through all options of all connection types with end `a` as their member a and end `b` as
// b; one that fits better than *best replaces *best and *mate.
void TryPair(const model::Model& model, const model::Robot& robot, const LinkPoseTable& X_WL, End a,
             End b, const ConnectorStates* states, double* best, std::optional<Docking>* mate) {
  const int type_a = robot.modules[a.module].type;
  const int type_b = robot.modules[b.module].type;
  const model::Connector& connector_a = model.TypeOf(robot, a.module).connectors[a.connector];
  const model::Connector& connector_b = model.TypeOf(robot, b.module).connectors[b.connector];
  for (size_t c = 0; c < model.connection_types.size(); ++c) {
    const model::ConnectionType& connection = model.connection_types[c];
    // Types and connectors must be those that the option is for,
    if (connection.type_a != type_a || connection.type_b != type_b) continue;
    for (size_t o = 0; o < connection.options.size(); ++o) {
      const model::ConnectionOption& option = connection.options[o];
      if (option.connector_a != a.connector || option.connector_b != b.connector) continue;
      // the links near enough to where it wants them, and nearer than for the best so far.
      const double misfit = Misfit(option, X_WL[a.module][connector_a.link],
                                   X_WL[b.module][connector_b.link], connector_b.p_MoCo_M);
      if (!(misfit < *best)) continue;
      const Docking docking{a.module,    a.connector,         b.module,
                            b.connector, static_cast<int>(c), static_cast<int>(o)};
      if (states != nullptr && !StatesAllow(model, robot, *states, docking)) continue;
      *best = misfit;
      *mate = docking;
    }
  }
}

}  // namespace

ConnectorStates InitialStates(const model::Model& model, const model::Robot& robot) {
  ConnectorStates states;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    std::vector<std::vector<int>>& module = states.emplace_back();
    for (const model::Connector& c : model.TypeOf(robot, static_cast<int>(m)).connectors) {
      module.emplace_back(c.states.size(), 0);
    }
  }
  // Connections that the model declares are closed: their hooks are out.
  for (const Docking& docking : robot.dockings) SetRequiredStates(model, robot, docking, &states);
  return states;
}

std::optional<size_t> FindDocking(const model::Robot& robot, int module, int connector) {
  for (size_t i = 0; i < robot.dockings.size(); ++i) {
    const Docking& d = robot.dockings[i];
    if ((d.module_a == module && d.connector_a == connector) ||
        (d.module_b == module && d.connector_b == connector)) {
      return i;
    }
  }
  return std::nullopt;
}

bool StatesAllow(const model::Model& model, const model::Robot& robot,
                 const ConnectorStates& states, const Docking& docking) {
  const auto holds = [&](const model::StateSetting& setting) {
    const std::vector<Wanted> wanted = WantedStates(model, robot, docking, setting);
    return std::all_of(wanted.begin(), wanted.end(), [&](const Wanted& w) {
      return states[w.module][w.connector][w.variable] == w.value;
    });
  };
  // Any of the settings will do.
  const model::ConnectionOption& option = model.OptionOf(docking);
  return holds(option.states) ||
         std::any_of(option.other_states.begin(), option.other_states.end(), holds);
}

void SetRequiredStates(const model::Model& model, const model::Robot& robot, const Docking& docking,
                       ConnectorStates* states) {
  // What allows the connection already stays as it is.
  if (StatesAllow(model, robot, *states, docking)) return;
  const model::StateSetting& setting = model.OptionOf(docking).states;
  for (const Wanted& w : WantedStates(model, robot, docking, setting)) {
    (*states)[w.module][w.connector][w.variable] = w.value;
  }
}

std::optional<Docking> FindMate(const model::Model& model, const model::Robot& robot,
                                const LinkPoseTable& X_WL, int module, int connector,
                                const ConnectorStates* states) {
  std::optional<Docking> mate;
  // Of several that fit the nearest wins, whatever the order in which they are tried.
  double best = INFINITY;
  const End own{module, connector};
  // Every free connector of every other module is tried, as b and, for unlike members, as a.
  for (int m = 0; m < static_cast<int>(robot.modules.size()); ++m) {
    if (m == module) continue;
    const auto count = static_cast<int>(model.TypeOf(robot, m).connectors.size());
    for (int c = 0; c < count; ++c) {
      if (FindDocking(robot, m, c)) continue;
      TryPair(model, robot, X_WL, own, {m, c}, states, &best, &mate);
      TryPair(model, robot, X_WL, {m, c}, own, states, &best, &mate);
    }
  }
  return mate;
}

}  // namespace morphbus::sim
