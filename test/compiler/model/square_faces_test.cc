// Modules whose faces are squares along the axes of their modules mate in as many ways as one
// counts who knows nothing of the solver: of all rotations of a cube, each pair of faces is tried
// with each.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "compiler/m3l/compile.h"
#include "compiler/model/robot_model.h"
#include "test/support/source_dir.h"

namespace morphbus::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The 24 proper rotations that map a cube onto itself.
std::vector<Matrix3d> RotationsOfACube() {
  std::vector<Matrix3d> rotations;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d R = Matrix3d::Zero();
      for (int k = 0; k < 3; ++k) R(order[k], k) = (signs >> k & 1) != 0 ? -1.0 : 1.0;
      if (R.determinant() > 0) rotations.push_back(R);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return rotations;
}

/// The way out of a face: across its sub-points, and away from the middle of its link.
Vector3d WayOut(const ModuleType& type, const Connector& face) {
  const Vector3d across =
      (face.subpoints[0] - face.p_MoCo_M).cross(face.subpoints[1] - face.p_MoCo_M).normalized();
  const std::vector<Vector3d>& hull = type.links[face.link].hull;
  const Vector3d middle = std::accumulate(hull.begin(), hull.end(), Vector3d(0, 0, 0)) /
                          static_cast<double>(hull.size());
  return across.dot(face.p_MoCo_M - middle) > 0 ? across : Vector3d(-across);
}

/// Whether a fixed attribute lets two faces mate: where they have it, it differs.
bool Differ(const Connector& a, const Connector& b, const std::string& key) {
  return a.attributes.count(key) == 0 || a.attributes.at(key) != b.attributes.at(key);
}

/// All poses of b in a in which face looks at face and corners lie on corners.
std::vector<Pose> WaysToMate(const ModuleType& type_a, const Connector& a, const ModuleType& type_b,
                             const Connector& b) {
  std::vector<Pose> ways;
  if (!Differ(a, b, "gender") || !Differ(a, b, "kind")) return ways;
  for (const Matrix3d& R_AB : RotationsOfACube()) {
    Pose X_AB = Pose::Identity();
    X_AB.linear() = R_AB;
    X_AB.translation() = a.p_MoCo_M - R_AB * b.p_MoCo_M;
    if ((R_AB * WayOut(type_b, b) + WayOut(type_a, a)).norm() > 1e-9) continue;
    const auto lies_on_one = [&](const Vector3d& p_B) {
      return std::any_of(a.subpoints.begin(), a.subpoints.end(),
                         [&](const Vector3d& p_A) { return (X_AB * p_B - p_A).norm() < 1e-9; });
    };
    if (std::all_of(b.subpoints.begin(), b.subpoints.end(), lies_on_one)) ways.push_back(X_AB);
  }
  return ways;
}

struct FaceCount {
  std::string file;
  std::string connection;
  size_t ways;
};

/// Faces of a times faces of b that fit, times four turns.
const FaceCount kConnections[] = {
    {"smores", "SMORES_to_SMORES", 4 * 4 * 4},
    {"mtran", "MTRAN_to_MTRAN", 2 * 3 * 3 * 4},
    {"dtto", "DTTO_to_DTTO", 2 * 3 * 3 * 4},
    {"superbot", "SUPERBOT_to_SUPERBOT", 6 * 6 * 4},
    {"rofi", "ROFI_to_ROFI", 6 * 6 * 4},
    {"roombots", "ROOMBOT_to_ROOMBOT", 10 * 10 * 4},
    {"revolve2", "CORE_to_BRICK", 4 * 1 * 4},
    {"revolve2", "CORE_to_HINGE", 4 * 1 * 4},
    {"revolve2", "BRICK_to_BRICK", 2 * 3 * 1 * 4},
    {"revolve2", "BRICK_to_HINGE", (3 * 1 + 1 * 1) * 4},
    {"revolve2", "HINGE_to_HINGE", 2 * 1 * 1 * 4},
};

TEST(SquareFaces, MateInTheWaysThatRotationsOfACubeAllow) {
  for (const FaceCount& known : kConnections) {
    SCOPED_TRACE(known.connection);
    const m3l::CompileOutput output =
        m3l::CompileFiles({test::SourcePath("models/" + known.file + ".m3l")});
    ASSERT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
    EXPECT_TRUE(output.diagnostics.all().empty());
    for (const ConnectionType& type : output.model->connection_types) {
      if (type.name != known.connection) continue;
      const ModuleType& type_a = output.model->module_types[type.type_a];
      const ModuleType& type_b = output.model->module_types[type.type_b];
      EXPECT_EQ(type.options.size(), known.ways);
      size_t found = 0;
      for (int a = 0; a < std::ssize(type_a.connectors); ++a) {
        for (int b = 0; b < std::ssize(type_b.connectors); ++b) {
          for (const Pose& X_AB :
               WaysToMate(type_a, type_a.connectors[a], type_b, type_b.connectors[b])) {
            ++found;
            EXPECT_EQ(std::ranges::count_if(type.options,
                                            [&](const ConnectionOption& option) {
                                              return option.connector_a == a &&
                                                     option.connector_b == b &&
                                                     option.X_AB.isApprox(X_AB, 1e-9);
                                            }),
                      1)
                << type_a.connectors[a].name << " on " << type_b.connectors[b].name;
          }
        }
      }
      EXPECT_EQ(found, known.ways);
    }
  }
}

}  // namespace
}  // namespace morphbus::model
