#include "bridge/description/link_places.h"

#include <algorithm>
#include <deque>
#include <optional>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::bridge {
namespace {

/// A link that is rigid with another one, and where it is in that one's frame.
template <class Pose>
struct RigidNeighbour {
  int module = 0;
  int link = 0;
  Pose X_FromTo;
};
/// By module and link.
template <class Pose>
using RigidNeighbours = std::vector<std::vector<std::vector<RigidNeighbour<Pose>>>>;

model::Pose Inverse(const model::Pose& X_AB) { return X_AB.inverse(); }

/// Enters that two links are rigid with each other; X_AB is the pose of the second in the first.
template <class Pose>
void Join(int a, int link_a, int b, int link_b, const model::Pose& X_AB,
          RigidNeighbours<Pose>* neighbours) {
  const Pose X = PoseAs<Pose>(X_AB);
  (*neighbours)[a][link_a].push_back({b, link_b, X});
  (*neighbours)[b][link_b].push_back({a, link_a, Inverse(X)});
}

/// Which links are rigid with which. All link frames of a module are one at joint values 0, for
/// which X_AB of a docking is given, so it is also the pose of the one link in the other.
template <class Pose>
RigidNeighbours<Pose> NeighboursOf(const model::Model& model, const model::Robot& robot,
                                   const Dockings& dockings) {
  const int num_modules = static_cast<int>(robot.modules.size());
  RigidNeighbours<Pose> neighbours(num_modules);
  // Within a module, the links of fixed joints.
  for (int m = 0; m < num_modules; ++m) {
    const model::ModuleType& type = model.TypeOf(robot, m);
    neighbours[m].resize(type.links.size());
    for (const model::Joint& joint : type.joints) {
      if (joint.type != model::JointType::kFixed) continue;
      Join(m, joint.link_b, m, joint.link_a, model::JointMotion(joint, 0.0), &neighbours);
    }
  }
  // Between modules, whatever is docked.
  for (int m = 0; m < num_modules && m < static_cast<int>(dockings.size()); ++m) {
    // Both sides sense a docking, so that a link may be entered twice, which does no harm.
    for (const morphbus::docked_connector_t& docked : dockings[m]) {
      const std::optional<model::Pose> X_OwnMate = DockedPose(model, robot, m, docked);
      if (!X_OwnMate) continue;
      Join(m, model.TypeOf(robot, m).connectors[docked.connector].link, docked.mate_module,
           model.TypeOf(robot, docked.mate_module).connectors[docked.mate_connector].link,
           *X_OwnMate, &neighbours);
    }
  }
  return neighbours;
}

}  // namespace

LinkPose operator*(const LinkPose& X_AB, const LinkPose& X_BC) {
  return {X_AB.position + X_AB.rotation * X_BC.position, X_AB.rotation * X_BC.rotation};
}

LinkPose Inverse(const LinkPose& X_AB) {
  // The rotation has length 1, so that its conjugate is its inverse.
  const Eigen::Quaterniond q_BA = X_AB.rotation.conjugate();
  return {q_BA * -X_AB.position, q_BA};
}

LinkPose ToLinkPose(const model::Pose& X) {
  return {X.translation(), Eigen::Quaterniond(X.linear()).normalized()};
}

Dockings DeclaredDockings(const model::Model& model, const model::Robot& robot) {
  Dockings dockings(robot.modules.size());
  for (const model::Docking& d : robot.dockings) {
    // One side is enough: both see the same pose.
    morphbus::docked_connector_t docked;
    docked.connector = static_cast<int8_t>(d.connector_a);
    docked.mate_connector = static_cast<int8_t>(d.connector_b);
    docked.mate_module = static_cast<int16_t>(d.module_b);
    docked.connection_type = static_cast<int8_t>(d.connection_type);
    docked.number = static_cast<int16_t>(model.OptionOf(d).number);
    dockings[d.module_a].push_back(docked);
  }
  return dockings;
}

bool SameDocked(const std::vector<morphbus::docked_connector_t>& a,
                const std::vector<morphbus::docked_connector_t>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.connector == y.connector && x.mate_module == y.mate_module &&
           x.mate_connector == y.mate_connector && x.number == y.number &&
           x.connection_type == y.connection_type;
  });
}

std::optional<model::Pose> DockedPose(const model::Model& model, const model::Robot& robot,
                                      int module, const morphbus::docked_connector_t& docked) {
  const int mate = docked.mate_module;
  // Every number may come from a damaged message, and is checked before it is used.
  if (!IsIndex(mate, robot.modules.size()) ||
      !IsIndex(docked.connection_type, model.connection_types.size())) {
    return std::nullopt;
  }
  const model::ConnectionType& connection = model.connection_types[docked.connection_type];
  if (!IsIndex(docked.number - 1, connection.options.size())) return std::nullopt;
  const model::ConnectionOption& option = connection.options[docked.number - 1];
  // The option must be one of these two connectors, with the module as member a, or as member b
  // where a connection joins unlike types.
  const auto fits = [&](int a, int connector_a, int b, int connector_b) {
    return robot.modules[a].type == connection.type_a &&
           robot.modules[b].type == connection.type_b && option.connector_a == connector_a &&
           option.connector_b == connector_b;
  };
  if (fits(module, docked.connector, mate, docked.mate_connector)) return option.X_AB;
  if (!fits(mate, docked.mate_connector, module, docked.connector)) return std::nullopt;
  return option.X_AB.inverse();
}

template <class Pose>
std::vector<std::vector<PlacedLink<Pose>>> PlacesInBodies(
    const model::Model& model, const model::Robot& robot, const Dockings& dockings,
    const std::vector<std::pair<int, int>>& bodies) {
  const RigidNeighbours<Pose> neighbours = NeighboursOf<Pose>(model, robot, dockings);
  std::vector<std::vector<PlacedLink<Pose>>> places(neighbours.size());
  for (size_t m = 0; m < neighbours.size(); ++m) places[m].resize(neighbours[m].size());
  // From the link that stands for a body all links are reached that are rigid with it.
  for (size_t body = 0; body < bodies.size(); ++body) {
    const auto [module, link] = bodies[body];
    if (!IsIndex(module, places.size()) || !IsIndex(link, places[module].size())) continue;
    // A link that an earlier body carries stays with that body.
    if (places[module][link].body >= 0) continue;
    places[module][link].body = static_cast<int>(body);
    std::deque<std::pair<int, int>> queue = {{module, link}};
    while (!queue.empty()) {
      const auto [m, l] = queue.front();
      queue.pop_front();
      for (const RigidNeighbour<Pose>& neighbour : neighbours[m][l]) {
        PlacedLink<Pose>& place = places[neighbour.module][neighbour.link];
        if (place.body >= 0) continue;
        place = {static_cast<int>(body), places[m][l].X_BL * neighbour.X_FromTo};
        queue.emplace_back(neighbour.module, neighbour.link);
      }
    }
  }
  return places;
}

template std::vector<std::vector<PlacedLink<LinkPose>>> PlacesInBodies(
    const model::Model&, const model::Robot&, const Dockings&,
    const std::vector<std::pair<int, int>>&);
template std::vector<std::vector<PlacedLink<model::Pose>>> PlacesInBodies(
    const model::Model&, const model::Robot&, const Dockings&,
    const std::vector<std::pair<int, int>>&);

}  // namespace morphbus::bridge
