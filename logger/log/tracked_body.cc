#include "logger/log/tracked_body.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/link_mass.h"

namespace morphbus::logger {

TrackedBody BodyOf(const model::Model& model, const model::Robot& robot, model::LinkRef link,
                   const model::Pose& X_RP) {
  const model::KinematicState start =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  const std::vector<std::vector<int>> body_of = model::BodiesOf(model, robot);
  // WORLD names a body by its first link, in order of modules and links.
  for (int m = 0; m < static_cast<int>(body_of.size()); ++m) {
    for (int l = 0; l < static_cast<int>(body_of[m].size()); ++l) {
      if (body_of[m][l] == body_of[link.module][link.link]) {
        return {{m, l}, start.X_RL[m][l].inverse() * X_RP};
      }
    }
  }
  return {};
}

TrackedBody Trunk(const model::Model& model, const model::Robot& robot) {
  const std::vector<std::vector<int>> body_of = model::BodiesOf(model, robot);
  const model::KinematicState start =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  // Mass, first moment and first link of every body, in the robot frame at the start values.
  struct Sum {
    double kg = 0.0;
    Eigen::Vector3d moment_R = Eigen::Vector3d::Zero();  // kg m
    model::LinkRef first;
  };
  std::map<int, Sum> bodies;
  model::LinkMasses masses(model);
  for (int m = 0; m < static_cast<int>(body_of.size()); ++m) {
    for (int l = 0; l < static_cast<int>(body_of[m].size()); ++l) {
      // The first moment of a link is its mass times the place of its centre of mass.
      Sum& sum = bodies.try_emplace(body_of[m][l], Sum{0.0, Eigen::Vector3d::Zero(), {m, l}})
                     .first->second;
      const model::LinkMass& mass = masses.Of(robot.modules[m].type, l);
      sum.kg += mass.mass_kg;
      sum.moment_R += mass.mass_kg * (start.X_RL[m][l] * mass.p_LoLcm_L);
    }
  }
  // A body without mass has no centre: its first link's frame is followed then.
  const auto trunk =
      std::max_element(bodies.begin(), bodies.end(),
                       [](const auto& a, const auto& b) { return a.second.kg < b.second.kg; });
  if (trunk == bodies.end()) return {};
  const Sum& sum = trunk->second;
  model::Pose X_RP = model::Pose::Identity();
  if (sum.kg > 0.0) X_RP.translation() = sum.moment_R / sum.kg;
  return BodyOf(model, robot, sum.first, X_RP);
}

double TiltBetween(const Eigen::Quaterniond& q_0, const Eigen::Quaterniond& q) {
  // Up is y in W.
  const Eigen::Vector3d up = (q * q_0.conjugate()) * Eigen::Vector3d::UnitY();
  return std::acos(std::clamp(up.y(), -1.0, 1.0));
}

}  // namespace morphbus::logger
