#include "tools/benchmark/robot_track.h"

#include <algorithm>
#include <cmath>

#include "compiler/model/link_mass.h"

namespace morphbus::tools {
namespace {

/// The way on level ground: north and east.
Eigen::Vector2d OnGround(const Eigen::Vector3d& p) { return {p.x(), p.z()}; }

}  // namespace

RobotTrack::RobotTrack(const model::Model& model, const model::Robot& robot, uint64_t noise_seed)
    : trunk_(logger::Trunk(model, robot)) {
  model::LinkMasses masses(model);
  const model::MassFactors factors = model::DrawMassFactors(model, robot, noise_seed);
  for (int m = 0; m < static_cast<int>(robot.modules.size()); ++m) {
    for (int l = 0; l < static_cast<int>(model.TypeOf(robot, m).links.size()); ++l) {
      const model::LinkMass& mass = masses.Of(robot.modules[m].type, l);
      weights_.push_back({m, l, mass.mass_kg * model::FactorOf(factors, m, l), mass.p_LoLcm_L});
      mass_kg_ += weights_.back().kg;
    }
  }
}

void RobotTrack::Take(const sim::ControlledRobot& robot, int64_t time_us) {
  logger::RobotSample now;
  now.time_us = time_us;
  for (const Weight& weight : weights_) {
    now.p_WCm +=
        weight.kg / mass_kg_ * (robot.LinkPose(weight.module, weight.link) * weight.p_LoLcm_L);
  }
  const model::Pose X_WT = robot.LinkPose(trunk_.link.module, trunk_.link.link) * trunk_.X_LP;
  now.p_WT = X_WT.translation();
  now.q_WT = Eigen::Quaterniond(X_WT.linear());
  // From tick to tick no trunk turns half round, so that whole turns add up.
  if (!track_.empty()) {
    turned_rad_ += logger::TurnBetween(track_.back(), now);
    spot_m_ = std::max(spot_m_, (OnGround(now.p_WCm) - OnGround(track_.front().p_WCm)).norm());
  }
  track_.push_back(now);
}

Json RobotTrack::FiguresSoFar() const {
  const Eigen::Vector3d way = track_.back().p_WCm - track_.front().p_WCm;
  const int64_t time_us = track_.back().time_us - track_.front().time_us;
  return {{"seconds", static_cast<double>(time_us) * 1e-6},
          {"distance", OnGround(way).norm()},
          {"north", way.x()},
          {"up", way.y()},
          {"east", way.z()},
          {"turned", turned_rad_},
          {"spot", spot_m_}};
}

Json RobotTrack::FiguresOfAll() const {
  Json figures = FiguresSoFar();
  const Eigen::Vector2d begin = OnGround(track_.front().p_WCm);
  const Eigen::Vector2d way = OnGround(track_.back().p_WCm) - begin;
  // Of a robot that came nowhere every step leads away.
  double drift = 0;
  for (const logger::RobotSample& sample : track_) {
    const Eigen::Vector2d p = OnGround(sample.p_WCm) - begin;
    const double off = way.norm() < logger::kLeastDistanceM
                           ? p.norm()
                           : std::abs(way.x() * p.y() - way.y() * p.x()) / way.norm();
    drift = std::max(drift, off);
  }
  const double seconds = figures["seconds"].get<double>();
  figures["speed"] = seconds > 0 ? way.norm() / seconds : 0.0;
  figures["drift"] = drift;
  return figures;
}

const logger::RobotSample& RobotTrack::At(double seconds) const {
  const auto time_us = std::llround(seconds * 1e6);
  const auto found =
      std::ranges::lower_bound(track_, time_us, std::less<>(), &logger::RobotSample::time_us);
  return found == track_.end() ? track_.back() : *found;
}

double RobotTrack::SpeedBetween(double begin_s, double end_s) const {
  const logger::RobotSample& begin = At(begin_s);
  const logger::RobotSample& end = At(end_s);
  if (end.time_us <= begin.time_us) return 0.0;
  const double seconds = static_cast<double>(end.time_us - begin.time_us) * 1e-6;
  return (OnGround(end.p_WCm) - OnGround(begin.p_WCm)).norm() / seconds;
}

double RobotTrack::HeightBetween(double begin_s, double end_s) const {
  double sum = 0;
  const logger::RobotSample* begin = &At(begin_s);
  const logger::RobotSample* end = &At(end_s);
  for (const logger::RobotSample* sample = begin; sample <= end; ++sample) sum += sample->p_WT.y();
  return sum / static_cast<double>(end - begin + 1);
}

}  // namespace morphbus::tools
