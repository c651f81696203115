#include "compiler/m3l/docking_turn.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace morphbus::m3l::internal {
namespace {

using Eigen::Vector3d;

/// Lengths below this part of the module's extent, and angles (rad) below it, count as 0.
constexpr double kTolerance = 1e-6;

Vector3d MeanOf(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// The middle of the box round a hull's points.
Vector3d MiddleOf(const std::vector<Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  return box.center();
}

/// Adds all points and sub-points of a table to `points`, in M (m).
void Append(const std::map<std::string, PointSymbol>& symbols, std::vector<Vector3d>& points) {
  for (const auto& [name, symbol] : symbols) {
    if (symbol.p_M) points.push_back(*symbol.p_M);
    points.insert(points.end(), symbol.subpoints.begin(), symbol.subpoints.end());
  }
}

/// The link's own points and its connectors.
std::vector<Vector3d> PointsOfLink(const CheckedModule& module, int link) {
  std::vector<Vector3d> points;
  Append(module.link_points[link], points);
  for (const model::Connector& c : module.type.connectors) {
    if (c.link != link) continue;
    points.push_back(c.p_MoCo_M);
    points.insert(points.end(), c.subpoints.begin(), c.subpoints.end());
  }
  return points;
}

/// All points of the module, whichever link they belong to.
std::vector<Vector3d> PointsOfModule(const CheckedModule& module) {
  std::vector<Vector3d> points;
  Append(module.points, points);
  for (const auto& own : module.link_points) Append(own, points);
  return points;
}

/// A unit normal of the plane through `points`, if they span a plane and no more.
std::optional<Vector3d> PlaneNormal(const std::vector<Vector3d>& points, double extent) {
  if (points.size() < 3) return std::nullopt;
  const Vector3d mean = MeanOf(points);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  // The eigenvalues, in rising order, are the squares of the spreads along the principal
  // directions: a plane has none along its normal and some along the two others.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(spread);
  const Vector3d sizes = principal.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  if (sizes[1] <= kTolerance * extent || sizes[0] > kTolerance * extent) return std::nullopt;
  return Vector3d(principal.eigenvectors().col(0));
}

/// The turn of member b from one option to another, if it leaves member a's connector where it is.
std::optional<Eigen::AngleAxisd> TurnOf(const CheckedModule& module,
                                        const model::ConnectionOption& from,
                                        const model::ConnectionOption& to) {
  const Vector3d& p = module.type.connectors[from.connector_a].p_MoCo_M;
  const model::Pose X_AA = to.X_AB * from.X_AB.inverse();
  if ((X_AA * p - p).norm() > kTolerance * module.extent_m) return std::nullopt;
  return Eigen::AngleAxisd(X_AA.rotation());
}

/// The axis of the first option that is a turn of the first one about the connector.
std::optional<Vector3d> AxisOfTurns(const CheckedModule& module,
                                    const std::vector<const model::ConnectionOption*>& options) {
  for (const model::ConnectionOption* option : options) {
    const std::optional<Eigen::AngleAxisd> turn = TurnOf(module, *options.front(), *option);
    if (turn && turn->angle() > kTolerance) return turn->axis();
  }
  return std::nullopt;
}

}  // namespace

std::optional<FaceNormal> NormalOf(const CheckedModule& module, int index,
                                   const std::vector<const model::ConnectionOption*>& options) {
  const model::Connector& connector = module.type.connectors[index];
  // What the source declares goes before all guesses.
  const auto declared = connector.normals.find("");
  if (declared != connector.normals.end()) return FaceNormal{declared->second, true};
  // Next come the plane of the sub-points, with the centre if they need it, and the axis of the
  // turns.
  std::vector<Vector3d> face = connector.subpoints;
  std::optional<Vector3d> line = PlaneNormal(face, module.extent_m);
  if (!line) {
    face.push_back(connector.p_MoCo_M);
    line = PlaneNormal(face, module.extent_m);
  }
  if (!line) line = AxisOfTurns(module, options);
  if (!line) return std::nullopt;
  // The line has two ends. Out is away from what lies inside: the hull's middle first, then the
  // means of all points of the link and of the module.
  std::vector<Vector3d> inner;
  const std::vector<Vector3d>& hull = module.type.links[connector.link].hull;
  if (!hull.empty()) inner.push_back(MiddleOf(hull));
  inner.push_back(MeanOf(PointsOfLink(module, connector.link)));
  inner.push_back(MeanOf(PointsOfModule(module)));
  for (const Vector3d& p : inner) {
    const double height = line->dot(connector.p_MoCo_M - p);
    if (std::abs(height) <= kTolerance * module.extent_m) continue;
    return FaceNormal{height > 0.0 ? *line : Vector3d(-*line), true};
  }
  return FaceNormal{*line, false};
}

std::optional<DockingTurn> TurnBetween(const CheckedModule& module_a, const FaceNormal& normal,
                                       const model::ConnectionOption& from,
                                       const model::ConnectionOption& to) {
  const std::optional<Eigen::AngleAxisd> turn = TurnOf(module_a, from, to);
  if (!turn) return std::nullopt;
  if (turn->angle() < 1e-9) return DockingTurn{};
  // A turn about another axis is no turn that `rot=` could name.
  if (turn->axis().cross(normal.direction).norm() > kTolerance) return std::nullopt;
  double degrees = turn->angle() * 180.0 / std::numbers::pi;
  if (turn->axis().dot(normal.direction) < 0.0) degrees = -degrees;
  // Rounded to a micro-degree, so that quarter turns read as such; half a turn is told as +180.
  degrees = std::remainder(std::round(degrees * 1e6) / 1e6, 360.0);
  if (std::abs(degrees) == 180.0) return DockingTurn{180.0, true};
  return DockingTurn{degrees, normal.outward};
}

}  // namespace morphbus::m3l::internal
