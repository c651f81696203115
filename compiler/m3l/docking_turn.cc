#include "compiler/m3l/docking_turn.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

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

/// The axis of the first option that is a turn of the first one about the connector.
std::optional<Vector3d> AxisOfTurns(const CheckedModule& module,
                                    const std::vector<const model::ConnectionOption*>& options) {
  for (const model::ConnectionOption* option : options) {
    const auto turn = model::TurnOfOption(module.type, module.extent_m, *options.front(), *option);
    if (turn && turn->angle() > kTolerance) return turn->axis();
  }
  return std::nullopt;
}

}  // namespace

std::optional<model::FaceNormal> NormalOf(
    const CheckedModule& module, int index,
    const std::vector<const model::ConnectionOption*>& options) {
  const model::Connector& connector = module.type.connectors[index];
  // What the source declares goes before all guesses.
  const auto declared = connector.normals.find("");
  if (declared != connector.normals.end()) return model::FaceNormal{declared->second, true};
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
    return model::FaceNormal{height > 0.0 ? *line : Vector3d(-*line), true};
  }
  return model::FaceNormal{*line, false};
}

}  // namespace morphbus::m3l::internal
