// A second route to the number of mappings: all bijections of bodies and of joints with all signs
// are tried on small robots, and those kept under which the bodies, placed by forward kinematics at
// random joint values, move alike under one proper rigid motion. Nothing of the search is used.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "compiler/base/check.h"
#include "compiler/congruence/congruence.h"
#include "compiler/m3l/compile.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/support/source_dir.h"

namespace morphbus::congruence {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using model::Pose;

constexpr int kSamples = 3;

struct Small {
  const model::Model* model;
  const model::Robot* robot;
  std::vector<JointRef> joints;
};

Small SmallOf(const model::Model& model, const model::Robot& robot) {
  Small small{&model, &robot, {}};
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const size_t count = model.TypeOf(robot, static_cast<int>(m)).joints.size();
    for (size_t j = 0; j < count; ++j) {
      small.joints.push_back({static_cast<int>(m), static_cast<int>(j)});
    }
  }
  return small;
}

const model::Joint& JointOf(const Small& small, size_t joint) {
  const JointRef& ref = small.joints[joint];
  return small.model->TypeOf(*small.robot, ref.module).joints[ref.joint];
}

/// Poses of the bodies at each sample of joint values (by index of joint).
std::vector<std::vector<Pose>> PosesAt(const Small& small,
                                       const std::vector<std::vector<double>>& samples) {
  std::vector<std::vector<Pose>> poses;
  for (const std::vector<double>& values : samples) {
    model::JointValues q = model::StartValues(*small.robot);
    for (size_t j = 0; j < values.size(); ++j) {
      const JointRef& ref = small.joints[j];
      q[ref.module][ref.joint] = values[j];
    }
    poses.push_back(test::BodyPoses(*small.model, *small.robot, q));
  }
  return poses;
}

/// What a rigid motion of all turns as one: for each body (in the order given) and sample the place
/// seen from the first body, and the rotation vector since the first sample.
Matrix3Xd VectorsOf(const std::vector<std::vector<Pose>>& poses, const std::vector<int>& order) {
  Matrix3Xd vectors(3, 2 * static_cast<Eigen::Index>(order.size() * poses.size()));
  Eigen::Index column = 0;
  const auto seen = [&](size_t sample, int body) {
    return poses[sample][order[0]].inverse() * poses[sample][body];
  };
  for (size_t sample = 0; sample < poses.size(); ++sample) {
    for (const int body : order) {
      const Pose X = seen(sample, body);
      const Matrix3d turned = X.linear() * seen(0, body).linear().transpose();
      const Eigen::AngleAxisd turn(turned);
      vectors.col(column++) = X.translation();
      vectors.col(column++) = 0.05 * std::sin(turn.angle()) * turn.axis();
    }
  }
  return vectors;
}

/// Is there a proper rotation that takes the columns of x to those of y? (Kabsch 1976)
bool RotateInto(const Matrix3Xd& x, const Matrix3Xd& y) {
  constexpr double kTolerance = 1e-7;
  if (((x.colwise().norm() - y.colwise().norm()).array().abs() > kTolerance).any()) return false;
  const Eigen::JacobiSVD<Matrix3d> svd(y * x.transpose(),
                                       Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d flip = Matrix3d::Identity();
  flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0 ? 1.0 : -1.0;
  const Matrix3d C = svd.matrixU() * flip * svd.matrixV().transpose();
  return (C * x - y).colwise().norm().maxCoeff() <= kTolerance;
}

/// Quick: are all bodies of a (in their order) as far from the first one as those of b in `order`?
bool SameDistances(const std::vector<std::vector<Pose>>& a, const std::vector<std::vector<Pose>>& b,
                   const std::vector<int>& order) {
  for (size_t sample = 0; sample < a.size(); ++sample) {
    const auto at = [&](size_t i) -> const Pose& { return b[sample][order[i]]; };
    for (size_t i = 1; i < order.size(); ++i) {
      const double far = (a[sample][i].translation() - a[sample][0].translation()).norm();
      const double far_b = (at(i).translation() - at(0).translation()).norm();
      if (std::abs(far - far_b) > 1e-7) return false;
    }
  }
  return true;
}

/// For joints with limits, all widths alike.
int64_t CountByEnumeration(const Small& a, const Small& b, uint64_t seed) {
  std::mt19937_64 random(seed);
  const size_t joints = a.joints.size();
  std::vector<std::vector<double>> samples(kSamples);
  for (std::vector<double>& values : samples) {
    for (size_t j = 0; j < joints; ++j) {
      const model::Joint& joint = JointOf(a, j);
      values.push_back(std::uniform_real_distribution<double>(joint.lower, joint.upper)(random));
    }
  }
  const std::vector<std::vector<Pose>> poses = PosesAt(a, samples);
  const size_t bodies = poses[0].size();
  std::vector<int> order(bodies);
  std::iota(order.begin(), order.end(), 0);
  const Matrix3Xd vectors = VectorsOf(poses, order);

  int64_t count = 0;
  std::vector<size_t> joint_to(joints);
  std::iota(joint_to.begin(), joint_to.end(), size_t{0});
  do {
    for (unsigned signs = 0; signs < 1u << joints; ++signs) {
      std::vector<std::vector<double>> mapped(kSamples, std::vector<double>(joints));
      for (size_t j = 0; j < joints; ++j) {
        const double sign = (signs >> j & 1u) != 0 ? -1.0 : 1.0;
        const model::Joint& from = JointOf(a, j);
        const model::Joint& to = JointOf(b, joint_to[j]);
        const double offset = 0.5 * (to.lower + to.upper) - sign * 0.5 * (from.lower + from.upper);
        for (size_t s = 0; s < kSamples; ++s) {
          mapped[s][joint_to[j]] = sign * samples[s][j] + offset;
        }
      }
      const std::vector<std::vector<Pose>> poses_b = PosesAt(b, mapped);
      if (poses_b[0].size() != bodies) return 0;
      std::iota(order.begin(), order.end(), 0);
      do {
        if (!SameDistances(poses, poses_b, order)) continue;
        if (RotateInto(vectors, VectorsOf(poses_b, order))) ++count;
      } while (std::next_permutation(order.begin(), order.end()));
    }
  } while (std::next_permutation(joint_to.begin(), joint_to.end()));
  return count;
}

/// Random robots of `modules` modules of the file's first type, each against itself, a relabelled
/// copy and one with a connection changed.
void ExpectEnumerated(const std::string& file, int modules, double lower, uint64_t seeds) {
  const m3l::CompileOutput output = m3l::CompileFiles({test::SourcePath("models/") + file});
  MORPHBUS_CHECK(output.model.has_value());
  model::Model model = *output.model;
  for (model::Joint& joint : model.module_types[0].joints) {
    if (joint.type == model::JointType::kFixed) continue;
    joint.lower = lower;
    joint.upper = 1.0;
  }
  int congruent = 0;
  for (uint64_t seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE(fmt::format("{} seed {}", file, seed));
    const model::Robot robot = test::RandomTree(model, modules, seed);
    const model::Robot same = test::Relabelled(model, robot, seed);
    model::Robot changed = robot;
    model::Docking& docking = changed.dockings[0];
    docking.option = docking.option / 4 * 4 + (docking.option + 1 + static_cast<int>(seed % 3)) % 4;
    for (const model::Robot* other : {&robot, &same, &std::as_const(changed)}) {
      const int64_t expected =
          CountByEnumeration(SmallOf(model, robot), SmallOf(model, *other), seed);
      EXPECT_EQ(Compare(model, robot, model, *other).count, expected);
      congruent += expected > 0 ? 1 : 0;
    }
  }
  EXPECT_GE(congruent, 2 * static_cast<int>(seeds));
}

TEST(Enumerated, MtransHaveTheMappingsThatTryingAllGives) {
  ExpectEnumerated("mtran.m3l", 2, -1.0, 6);
  ExpectEnumerated("mtran.m3l", 2, -0.25, 4);
}

TEST(Enumerated, MolecubesHaveTheMappingsThatTryingAllGives) {
  ExpectEnumerated("molecube.m3l", 3, -1.0, 12);
  ExpectEnumerated("molecube.m3l", 3, -0.25, 8);
}

TEST(Enumerated, CkbotsHaveTheMappingsThatTryingAllGives) {
  ExpectEnumerated("ckbot.m3l", 3, -1.0, 12);
  ExpectEnumerated("ckbot.m3l", 4, -0.25, 2);
}

}  // namespace
}  // namespace morphbus::congruence
