#include "compiler/emit/webots_docks.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <deque>
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
/// an edge a numbered way of docking. It finds which connectors pair up, and who of a pair is
/// active.
class ConnectorPairing {
 public:
  ConnectorPairing(const model::Model& model, DockFaces* faces)
      : model_(model), faces_(*faces), tolerance_(DockScaleOf(model).tolerance) {
    for (size_t type = 0; type < model.module_types.size(); ++type) {
      first_.push_back(places_.size());
      const size_t connectors = model.module_types[type].connectors.size();
      for (size_t c = 0; c < connectors; ++c) places_.emplace_back(type, c);
    }
    // A way of docking joins two vertices, whichever of the two is member a.
    edges_.resize(places_.size());
    for (const model::ConnectionType& connection : model.connection_types) {
      for (const model::ConnectionOption& option : connection.options) {
        const size_t a = At(connection.type_a, option.connector_a);
        const size_t b = At(connection.type_b, option.connector_b);
        edges_[a].push_back({b, &connection, &option});
        if (a != b) edges_[b].push_back({a, &connection, &option});
      }
    }
  }

  /// Gives models, types, docking directions and numbers of rotations.
  void Assign() {
    // Each connected part of the graph is coloured with two sides, breadth first. That works out
    // unless a connector can dock to one of its own side.
    std::vector<int> side(places_.size(), -1);
    for (size_t start = 0; start < places_.size(); ++start) {
      if (side[start] >= 0) continue;
      bool two_sided = true;
      std::deque<size_t> queue = {start};
      std::vector<size_t> part = {start};
      side[start] = 0;
      while (!queue.empty()) {
        const size_t at = queue.front();
        queue.pop_front();
        for (const Edge& edge : edges_[at]) {
          if (side[edge.to] == side[at]) two_sided = false;
          if (side[edge.to] >= 0) continue;
          // Faces met for the first time are turned to meet the one they were reached from.
          side[edge.to] = 1 - side[at];
          TurnTo(edge);
          queue.push_back(edge.to);
          part.push_back(edge.to);
        }
      }
      Name(part, side, two_sided && part.size() > 1);
      CountRotations(part);
    }
  }

 private:
  struct Edge {
    size_t to;
    const model::ConnectionType* connection;
    const model::ConnectionOption* option;
  };

  [[nodiscard]] size_t At(int type, int connector) const { return first_[type] + connector; }

  DockFace& Face(size_t vertex) {
    const auto [type, connector] = places_[vertex];
    return faces_[type][connector];
  }

  /// Turns the far face so that the docking directions meet in this way of docking, if it is one of
  /// faces that look at each other.
  void TurnTo(const Edge& edge) {
    const model::Pose X_CD = FaceInFace(faces_, *edge.connection, *edge.option);
    if (!LooksBack(X_CD, tolerance_)) return;
    const bool is_b = At(edge.connection->type_b, edge.option->connector_b) == edge.to;
    const model::Pose X_far = is_b ? X_CD : X_CD.inverse();
    // Turning D's z about its own x, which is against C's, takes the roll away.
    Face(edge.to).X_LC.linear() *=
        Eigen::AngleAxisd(-RollOf(X_far), Vector3d::UnitX()).toRotationMatrix();
  }

  void CountRotations(const std::vector<size_t>& part) {
    // After the turning, the rolls that are left tell in how many ways the part docks.
    std::vector<double> rolls;
    for (const size_t vertex : part) {
      for (const Edge& edge : edges_[vertex]) {
        const model::Pose X_CD = FaceInFace(faces_, *edge.connection, *edge.option);
        if (LooksBack(X_CD, tolerance_)) rolls.push_back(RollOf(X_CD));
      }
    }
    const int rotations = RotationsOf(rolls);
    for (const size_t vertex : part) Face(vertex).rotations = rotations;
  }

  void Name(const std::vector<size_t>& part, const std::vector<int>& side, bool two_sided) {
    // Connectors of one Webots model dock; it is named after the first connector of the part.
    const auto [first_type, first_connector] = places_[part.front()];
    const std::string name = model_.module_types[first_type].name + "." +
                             model_.module_types[first_type].connectors[first_connector].name;
    // Who has something to set, such as hooks, is the one that locks.
    int active = side[part.front()];
    for (const size_t vertex : part) {
      const auto [type, connector] = places_[vertex];
      if (model_.module_types[type].connectors[connector].states.empty()) continue;
      active = side[vertex];
      break;
    }
    for (const size_t vertex : part) {
      DockFace& face = Face(vertex);
      face.model = name;
      if (two_sided) face.type = side[vertex] == active ? "active" : "passive";
    }
  }

  const model::Model& model_;
  DockFaces& faces_;
  double tolerance_;                               ///< DockScale's.
  std::vector<std::pair<size_t, size_t>> places_;  ///< (type, connector) of each vertex.
  std::vector<size_t> first_;                      ///< The first vertex of each type.
  std::vector<std::vector<Edge>> edges_;
};

/// The rolls, about the normals of their faces, in which two connectors can dock face to face.
class DockingRolls {
 public:
  DockingRolls(const model::Model& model, const DockFaces& faces) {
    const double tolerance = DockScaleOf(model).tolerance;
    for (const model::ConnectionType& connection : model.connection_types) {
      for (const model::ConnectionOption& option : connection.options) {
        const model::Pose X_CD = FaceInFace(faces, connection, option);
        if (!LooksBack(X_CD, tolerance)) continue;
        const End a = {connection.type_a, option.connector_a};
        const End b = {connection.type_b, option.connector_b};
        // A roll is the same from either side: the faces look at each other.
        const auto parts = std::lround(RollOf(X_CD) * kParts / (2.0 * EIGEN_PI));
        rolls_[std::minmax(a, b)].insert((parts + kParts) % kParts);
      }
    }
  }
  using End = std::pair<int, int>;  ///< Module type, connector.
  [[nodiscard]] int Count(End a, End b) const {
    const auto found = rolls_.find(std::minmax(a, b));
    return found == rolls_.end() ? 0 : static_cast<int>(found->second.size());
  }

 private:
  static constexpr long kParts = 36000;
  std::map<std::pair<End, End>, std::set<long>> rolls_;
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
  const bool symmetric = std::string(a.type) == "symmetric";
  return a.model == b.model && (symmetric || std::string(a.type) != b.type);
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

model::Pose FaceInFace(const DockFaces& faces, const model::ConnectionType& connection,
                       const model::ConnectionOption& option) {
  const auto face = [&](int type, int connector) -> const model::Pose& {
    return faces[type][connector].X_LC;
  };
  return face(connection.type_a, option.connector_a).inverse() * option.X_AB *
         face(connection.type_b, option.connector_b);
}

std::vector<std::string> LooseDocking(const model::Model& model, const DockFaces& faces,
                                      const std::set<int>& types) {
  const DockingRolls rolls(model, faces);
  std::vector<std::string> warnings;
  // The first pair of connectors of two types that Webots would let dock in other rolls than the
  // model has.
  const auto first_loose = [&](int s, int t) -> std::string {
    for (size_t c = 0; c < faces[s].size(); ++c) {
      for (size_t d = 0; d < faces[t].size(); ++d) {
        const DockFace& a = faces[s][c];
        const int count = rolls.Count({s, static_cast<int>(c)}, {t, static_cast<int>(d)});
        if (!MayDock(a, faces[t][d]) || count == a.rotations) continue;
        const model::ModuleType& S = model.module_types[s];
        const model::ModuleType& T = model.module_types[t];
        return fmt::format("Webots will let {}.{} dock to {}.{} in {} turns, the model has {}",
                           S.name, S.connectors[c].name, T.name, T.connectors[d].name,
                           a.rotations == 0 ? "all" : std::to_string(a.rotations), count);
      }
    }
    return "";
  };
  for (const int s : types) {
    for (const int t : types) {
      if (t < s) continue;
      const std::string warning = first_loose(s, t);
      if (!warning.empty()) warnings.push_back(warning);
    }
  }
  return warnings;
}

bool Aligned(const model::Pose& X_WC, const model::Pose& X_WD, int rotations, double tolerance) {
  // The centres meet, the normals oppose each other, and the docking directions are whole parts of
  // a turn apart.
  const Eigen::Matrix3d R = X_WC.linear().transpose() * X_WD.linear();
  if ((X_WC.translation() - X_WD.translation()).norm() > tolerance) return false;
  if ((R.col(0) + Vector3d::UnitX()).norm() > kDirectionTolerance) return false;
  if (rotations == 0) return true;
  const double part = 2.0 * EIGEN_PI / rotations;
  const double parts = std::atan2(R(1, 2), R(2, 2)) / part;
  return std::abs(parts - std::round(parts)) * part < kDirectionTolerance;
}

}  // namespace morphbus::emit
