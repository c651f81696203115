#include "compiler/model/mating_turn.h"

#include <cmath>
#include <numbers>

namespace morphbus::model {
namespace {

/// Lengths below this part of the module's extent, and angles (rad) below it, count as 0.
constexpr double kTurnTolerance = 1e-6;

}  // namespace

std::optional<Eigen::AngleAxisd> TurnOfOption(const ModuleType& type_a, double extent_m,
                                              const ConnectionOption& from,
                                              const ConnectionOption& to) {
  const Eigen::Vector3d& p = type_a.connectors[from.connector_a].p_MoCo_M;
  const Pose X_AA = to.X_AB * from.X_AB.inverse();
  if ((X_AA * p - p).norm() > kTurnTolerance * extent_m) return std::nullopt;
  return Eigen::AngleAxisd(X_AA.rotation());
}

std::optional<MatingTurn> TurnBetween(const ModuleType& type_a, double extent_m,
                                      const FaceNormal& normal, const ConnectionOption& from,
                                      const ConnectionOption& to) {
  const std::optional<Eigen::AngleAxisd> turn = TurnOfOption(type_a, extent_m, from, to);
  if (!turn) return std::nullopt;
  if (turn->angle() < 1e-9) return MatingTurn{};
  // A turn about another axis is no turn that `rot=` could name.
  if (turn->axis().cross(normal.direction).norm() > kTurnTolerance) return std::nullopt;
  double degrees = turn->angle() * 180.0 / std::numbers::pi;
  if (turn->axis().dot(normal.direction) < 0.0) degrees = -degrees;
  // Rounded to a micro-degree, so that quarter turns read as such; half a turn is told as +180.
  degrees = std::remainder(std::round(degrees * 1e6) / 1e6, 360.0);
  if (std::abs(degrees) == 180.0) return MatingTurn{180.0, true};
  return MatingTurn{degrees, normal.outward};
}

}  // namespace morphbus::model
