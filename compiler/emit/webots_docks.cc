#include "compiler/emit/webots_docks.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "compiler/model/link_mass.h"

namespace morphbus::emit {
namespace {

using Eigen::Vector3d;

constexpr double kDirectionTolerance = 1e-3;  // rad

/// Out of the module: as declared, else normal to the plane of the sub-points, away from the link's
/// centre of mass.
Vector3d NormalOf(const model::ModuleType& type, const model::Connector& connector) {
  // The sub-points of a connector lie in its face, so the direction in which they spread least is
  // its normal; the sign is that which leads out of the link.
  const auto declared = connector.normals.find("");
  if (declared != connector.normals.end()) return declared->second;
  const Vector3d outward =
      connector.p_MoCo_M - model::ComputeLinkMass(type, connector.link).p_LoLcm_L;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : connector.subpoints) {
    const Vector3d r = p - connector.p_MoCo_M;
    spread += r * r.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  // Sub-points on one line, or none, leave the normal open.
  if (solver.eigenvalues()(1) <= 1e-9 * solver.eigenvalues()(2)) {
    // No plane: fewer than two directions.
    return outward.norm() > 1e-9 ? outward.normalized() : Vector3d::UnitX();
  }
  const Vector3d normal = solver.eigenvectors().col(0);
  return normal.dot(outward) < 0.0 ? Vector3d(-normal) : normal;
}

/// How far a face's z is turned from that of the face it looks at (rad); X_CD is that of the
/// latter.
double RollOf(const model::Pose& X_CD) { return std::atan2(X_CD(1, 2), X_CD(2, 2)); }

bool LooksBack(const model::Pose& X_CD, double tolerance) {
  return X_CD.translation().norm() < tolerance &&
         (X_CD.linear().col(0) + Vector3d::UnitX()).norm() < kDirectionTolerance;
}

bool IsWhole(double value, double tolerance) {
  return std::abs(value - std::round(value)) < tolerance;
}

/// The least number of parts of a turn of which all rolls are multiples; 0 (any) if there is none.
int RotationsOf(const std::vector<double>& rolls) {
  // Rolls of finer steps than a degree come from no drawing.
  constexpr int kMost = 360;
  for (int n = 1; n <= kMost; ++n) {
    const auto fits = [n](double roll) { return IsWhole(n * roll / (2.0 * EIGEN_PI), 1e-4); };
    if (std::all_of(rolls.begin(), rolls.end(), fits)) return n;
  }
  return 0;
}

DockFace FaceOf(const model::ModuleType& type, const model::Connector& connector) {
  DockFace face;
  // The docking direction z points from the centre to the first sub-point, as far as that lies in
  // the face.
  const Vector3d x = NormalOf(type, connector);
  Vector3d z = Vector3d::Zero();
  if (!connector.subpoints.empty()) z = connector.subpoints[0] - connector.p_MoCo_M;
  z -= z.dot(x) * x;
  z = z.norm() > 1e-9 ? Vector3d(z.normalized()) : x.unitOrthogonal();
  face.X_LC.linear() << x, z.cross(x), z;
  face.X_LC.translation() = connector.p_MoCo_M;
  return face;
}

/// The graph of which connectors can dock, over all module types: a vertex a connector of a type,
/// an edge a numbered way of docking. It finds which connectors pair up, and which of a pair is
/// active.
class ConnectorPairing {
 public:
  ConnectorPairing(const model::Model& model, DockFaces* faces)
      : model_(model), faces_(*faces), tolerance_(DockScaleOf(model).tolerance) {}

  /// Gives models, types, docking directions and numbers of rotations.
  void Assign() {
    for (int type = 0; type < std::ssize(faces_); ++type) {
      for (int c = 0; c < std::ssize(faces_[type]); ++c) {
        if (side_.count({type, c}) == 0) AssignPart({type, c});
      }
    }
  }

 private:
  /// The same for all that hangs together with one connector.
  void AssignPart(DockEnd start) {
    // The part is coloured with two sides, breadth first. That works out unless a connector can
    // dock to one of its own side.
    bool two_sided = true;
    std::vector<DockEnd> part = {start};
    std::vector<DockWay> ways;
    side_[start] = 0;
    for (size_t i = 0; i < part.size(); ++i) {
      const DockEnd at = part[i];
      for (const DockWay& way : DockWaysOf(model_, at.type)) {
        if (way.own != at) continue;
        ways.push_back(way);
        const auto [mate, is_new] = side_.try_emplace(way.mate, 1 - side_[at]);
        if (mate->second == side_[at]) two_sided = false;
        if (!is_new) continue;
        // Faces met for the first time are turned to meet the one they were reached from.
        TurnMate(way);
        part.push_back(way.mate);
      }
    }
    Name(part, two_sided && part.size() > 1);
    // After the turning, the rolls that are left tell in how many ways the part docks.
    std::vector<double> rolls;
    for (const DockWay& way : ways) {
      const model::Pose X_CD = MateFace(faces_, way);
      if (LooksBack(X_CD, tolerance_)) rolls.push_back(RollOf(X_CD));
    }
    const int rotations = RotationsOf(rolls);
    for (const DockEnd& end : part) Face(end).rotations = rotations;
  }

  DockFace& Face(const DockEnd& end) { return faces_[end.type][end.connector]; }

  /// Turns the mate's face so that the docking directions meet in this way of docking, if it is one
  /// of faces that look at each other.
  void TurnMate(const DockWay& way) {
    const model::Pose X_CD = MateFace(faces_, way);
    if (!LooksBack(X_CD, tolerance_)) return;
    // Turning D's z about its own x, which is against C's, takes the roll away.
    Face(way.mate).X_LC.linear() *=
        Eigen::AngleAxisd(-RollOf(X_CD), Vector3d::UnitX()).toRotationMatrix();
  }

  void Name(const std::vector<DockEnd>& part, bool two_sided) {
    // Connectors of one Webots model dock; it is named after the first connector of the part.
    const auto connector = [&](const DockEnd& end) -> const model::Connector& {
      return model_.module_types[end.type].connectors[end.connector];
    };
    const std::string name =
        model_.module_types[part.front().type].name + "." + connector(part.front()).name;
    // The end that has something to set, such as hooks, is the one that locks.
    const auto settable = std::ranges::find_if(
        part, [&](const DockEnd& end) { return !connector(end).states.empty(); });
    const int active = side_[settable == part.end() ? part.front() : *settable];
    for (const DockEnd& end : part) {
      Face(end).model = name;
      if (two_sided) Face(end).type = side_[end] == active ? "active" : "passive";
    }
  }

  const model::Model& model_;
  DockFaces& faces_;
  double tolerance_;             ///< DockScale's.
  std::map<DockEnd, int> side_;  ///< 0 or 1, of each connector that has been reached.
};

/// Between two connectors of a module type (m); infinite if all lie at one place.
double LeastDistance(const model::ModuleType& type) {
  std::vector<double> distances;
  for (size_t c = 0; c < type.connectors.size(); ++c) {
    for (size_t d = 0; d < c; ++d) {
      distances.push_back((type.connectors[c].p_MoCo_M - type.connectors[d].p_MoCo_M).norm());
    }
  }
  std::ranges::sort(distances);
  // No reach tells connectors at one place apart.
  for (const double distance : distances) {
    if (distance > 1e-6 * distances.back()) return distance;
  }
  return std::numeric_limits<double>::infinity();
}

bool MayDock(const DockFace& a, const DockFace& b) {
  return a.model == b.model && (a.type == "symmetric" || a.type != b.type);
}

/// Says of the first pair of connectors of types `s` and `t` that Webots would let dock in other
/// rolls than the model has; empty if there is none.
std::string FirstLoose(const model::Model& model, const DockFaces& faces, int s, int t) {
  // The rolls in which the model has two connectors face to face, in parts of a turn.
  constexpr long kParts = 36000;
  const double tolerance = DockScaleOf(model).tolerance;
  std::map<std::pair<int, int>, std::set<long>> rolls;
  for (const DockWay& way : DockWaysOf(model, s)) {
    const model::Pose X_CD = MateFace(faces, way);
    if (way.mate.type != t || !LooksBack(X_CD, tolerance)) continue;
    const long parts = std::lround(RollOf(X_CD) * kParts / (2.0 * EIGEN_PI));
    // Rolls that rounding parts are one: to a hundredth of a degree.
    rolls[{way.own.connector, way.mate.connector}].insert((parts + kParts) % kParts);
  }
  for (int c = 0; c < std::ssize(faces[s]); ++c) {
    for (int d = 0; d < std::ssize(faces[t]); ++d) {
      // Webots lets two faces dock in as many rolls as numberOfRotations says, 0 standing for all,
      // whatever the model's ways are.
      const int rotations = faces[s][c].rotations;
      const int count = static_cast<int>(rolls[{c, d}].size());
      if (!MayDock(faces[s][c], faces[t][d]) || count == rotations) continue;
      const model::ModuleType& S = model.module_types[s];
      const model::ModuleType& T = model.module_types[t];
      return fmt::format("Webots will let {}.{} dock to {}.{} in {} turns, the model has {}",
                         S.name, S.connectors[c].name, T.name, T.connectors[d].name,
                         rotations == 0 ? "all" : std::to_string(rotations), count);
    }
  }
  return "";
}

}  // namespace

DockScale DockScaleOf(const model::Model& model) {
  // Webots' Connector senses another within 1 cm unless it is told otherwise (distanceTolerance).
  double reach = 0.01;
  for (const model::ModuleType& type : model.module_types) {
    reach = std::min(reach, LeastDistance(type) / 3.0);
  }
  return {reach, reach / 5.0, reach / 10.0};
}

DockFaces DockFacesOf(const model::Model& model) {
  DockFaces faces;
  for (const model::ModuleType& type : model.module_types) {
    faces.emplace_back();
    for (const model::Connector& connector : type.connectors) {
      faces.back().push_back(FaceOf(type, connector));
    }
  }
  ConnectorPairing(model, &faces).Assign();
  return faces;
}

std::vector<DockWay> DockWaysOf(const model::Model& model, int type) {
  std::vector<DockWay> ways;
  for (int c = 0; c < std::ssize(model.connection_types); ++c) {
    const model::ConnectionType& connection = model.connection_types[c];
    for (const model::ConnectionOption& option : connection.options) {
      const DockEnd a = {connection.type_a, option.connector_a};
      const DockEnd b = {connection.type_b, option.connector_b};
      if (a.type == type) ways.push_back({a, b, c, false, &option});
      if (b.type == type) ways.push_back({b, a, c, true, &option});
    }
  }
  return ways;
}

model::Pose MateFace(const DockFaces& faces, const DockWay& way) {
  // From the connector to its module's frame, on to the mate's, and from there to its connector.
  const model::Pose& X_own = faces[way.own.type][way.own.connector].X_LC;
  const model::Pose& X_mate = faces[way.mate.type][way.mate.connector].X_LC;
  if (way.is_member_b) return (X_mate.inverse() * way.option->X_AB * X_own).inverse();
  return X_own.inverse() * way.option->X_AB * X_mate;
}

std::vector<std::string> LooseDocking(const model::Model& model, const DockFaces& faces,
                                      const std::set<int>& types) {
  std::vector<std::string> warnings;
  for (const int s : types) {
    for (const int t : types) {
      if (t < s) continue;
      const std::string warning = FirstLoose(model, faces, s, t);
      if (!warning.empty()) warnings.push_back(warning);
    }
  }
  return warnings;
}

bool Aligned(const model::Pose& X_WC, const model::Pose& X_WD, int rotations, double tolerance) {
  // The docking directions are whole parts of a turn apart.
  const model::Pose X_CD = X_WC.inverse() * X_WD;
  if (!LooksBack(X_CD, tolerance)) return false;
  const double parts_per_rad = rotations / (2.0 * EIGEN_PI);
  return rotations == 0 ||
         IsWhole(RollOf(X_CD) * parts_per_rad, kDirectionTolerance * parts_per_rad);
}

}  // namespace morphbus::emit
