#include "compiler/emit/webots_docks.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <deque>

#include "compiler/model/link_mass.h"

namespace morphbus::emit {
namespace {

using Eigen::Vector3d;

/// Out of the module: as declared, else normal to the plane of the sub-points, away from the link's
/// centre of mass.
Vector3d NormalOf(const model::ModuleType& type, const model::Connector& connector) {
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
  if (solver.eigenvalues()(1) <= 1e-9 * solver.eigenvalues()(2)) {
    // No plane: fewer than two directions.
    return outward.norm() > 1e-9 ? outward.normalized() : Vector3d::UnitX();
  }
  const Vector3d normal = solver.eigenvectors().col(0);
  return normal.dot(outward) < 0.0 ? Vector3d(-normal) : normal;
}

/// Number of equal parts into which the sub-points divide a turn, else 0. Odd numbers are doubled:
/// a turn by half a part is what an odd face sees of its mirror image.
int RotationsOf(const model::Connector& connector, const Vector3d& x, const Vector3d& z) {
  const Vector3d y = z.cross(x);
  std::vector<double> angles;
  for (const Vector3d& p : connector.subpoints) {
    const Vector3d r = p - connector.p_MoCo_M;
    if (r.norm() < 1e-9) return 0;
    angles.push_back(std::atan2(r.dot(y), r.dot(z)));
  }
  if (angles.empty()) return 0;
  std::sort(angles.begin(), angles.end());
  const double part = 2.0 * EIGEN_PI / static_cast<double>(angles.size());
  for (size_t i = 1; i < angles.size(); ++i) {
    if (std::abs(angles[i] - angles[i - 1] - part) > 1e-6) return 0;
  }
  const int count = static_cast<int>(angles.size());
  return count % 2 == 0 ? count : 2 * count;
}

DockFace FaceOf(const model::ModuleType& type, const model::Connector& connector) {
  DockFace face;
  const Vector3d x = NormalOf(type, connector);
  Vector3d z = Vector3d::Zero();
  if (!connector.subpoints.empty()) z = connector.subpoints[0] - connector.p_MoCo_M;
  z -= z.dot(x) * x;
  z = z.norm() > 1e-9 ? Vector3d(z.normalized()) : x.unitOrthogonal();
  face.X_LC.linear() << x, z.cross(x), z;
  face.X_LC.translation() = connector.p_MoCo_M;
  face.rotations = RotationsOf(connector, x, z);
  return face;
}

/// The graph of which connectors can mate, over all types.
class Sides {
 public:
  Sides(const model::Model& model, std::vector<std::vector<DockFace>>* faces)
      : model_(model), faces_(*faces) {
    for (const model::ModuleType& type : model.module_types) {
      first_.push_back(count_);
      count_ += type.connectors.size();
    }
    edges_.resize(count_);
    for (const model::ConnectionType& connection : model.connection_types) {
      for (const model::ConnectionOption& option : connection.options) {
        const size_t a = At(connection.type_a, option.connector_a);
        const size_t b = At(connection.type_b, option.connector_b);
        edges_[a].push_back(b);
        edges_[b].push_back(a);
      }
    }
  }

  /// Names models and types.
  void Assign() {
    std::vector<int> side(count_, -1);
    for (size_t start = 0; start < count_; ++start) {
      if (side[start] >= 0) continue;
      bool two_sided = true;
      std::deque<size_t> queue = {start};
      std::vector<size_t> part = {start};
      side[start] = 0;
      while (!queue.empty()) {
        const size_t at = queue.front();
        queue.pop_front();
        for (const size_t next : edges_[at]) {
          if (side[next] == side[at]) two_sided = false;
          if (side[next] >= 0) continue;
          side[next] = 1 - side[at];
          queue.push_back(next);
          part.push_back(next);
        }
      }
      Name(part, side, two_sided && part.size() > 1);
    }
  }

 private:
  [[nodiscard]] size_t At(int type, int connector) const {
    return first_[static_cast<size_t>(type)] + static_cast<size_t>(connector);
  }

  /// (type, connector) of a vertex.
  [[nodiscard]] std::pair<size_t, size_t> Place(size_t vertex) const {
    size_t type = 0;
    while (vertex - first_[type] >= model_.module_types[type].connectors.size()) ++type;
    return {type, vertex - first_[type]};
  }

  void Name(const std::vector<size_t>& part, const std::vector<int>& side, bool two_sided) {
    const auto [first_type, first_connector] = Place(part.front());
    const std::string name = model_.module_types[first_type].name + "." +
                             model_.module_types[first_type].connectors[first_connector].name;
    int active = side[part.front()];
    for (const size_t vertex : part) {
      const auto [type, connector] = Place(vertex);
      if (model_.module_types[type].connectors[connector].states.empty()) continue;
      active = side[vertex];
      break;
    }
    for (const size_t vertex : part) {
      const auto [type, connector] = Place(vertex);
      DockFace& face = faces_[type][connector];
      face.model = name;
      if (two_sided) face.type = side[vertex] == active ? "active" : "passive";
    }
  }

  const model::Model& model_;
  std::vector<std::vector<DockFace>>& faces_;
  std::vector<size_t> first_;
  size_t count_ = 0;
  std::vector<std::vector<size_t>> edges_;
};

}  // namespace

std::vector<std::vector<DockFace>> DockFaces(const model::Model& model) {
  std::vector<std::vector<DockFace>> faces;
  for (const model::ModuleType& type : model.module_types) {
    faces.emplace_back();
    for (const model::Connector& connector : type.connectors) {
      faces.back().push_back(FaceOf(type, connector));
    }
  }
  Sides(model, &faces).Assign();
  return faces;
}

bool Aligned(const model::Pose& X_WC, const model::Pose& X_WD, int rotations) {
  constexpr double kTolerance = 1e-3;
  const Eigen::Matrix3d R = X_WC.linear().transpose() * X_WD.linear();
  if ((X_WC.translation() - X_WD.translation()).norm() > kTolerance) return false;
  if ((R.col(0) + Vector3d::UnitX()).norm() > kTolerance) return false;
  if (rotations == 0) return true;
  const double part = 2.0 * EIGEN_PI / rotations;
  const double parts = std::atan2(R(1, 2), R(2, 2)) / part;
  return std::abs(parts - std::round(parts)) * part < kTolerance;
}

}  // namespace morphbus::emit
