#include "test/compiler/congruence/assemblies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <string>

#include "compiler/base/check.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "test/support/source_dir.h"

namespace morphbus::test {

using model::Pose;

const model::Model& MtranFile() {
  static const model::Model model = [] {
    m3l::CompileOutput output = m3l::CompileFiles({SourcePath("models/mtran.m3l")});
    MORPHBUS_CHECK(output.model.has_value());
    return *output.model;
  }();
  return model;
}

namespace {

Pose RandomPose(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const Eigen::Quaterniond q(u(random), u(random), u(random), u(random) + 1.5);
  return Eigen::Translation3d(u(random), u(random), u(random)) * q.normalized();
}

}  // namespace

model::Robot Relabelled(const model::Model& model, const model::Robot& robot, uint64_t seed) {
  std::mt19937_64 random(seed);
  const size_t count = robot.modules.size();
  std::vector<int> to(count);
  std::iota(to.begin(), to.end(), 0);
  std::shuffle(to.begin(), to.end(), random);
  model::Robot other;
  other.name = robot.name + "_relabelled";
  other.modules.resize(count);
  for (size_t m = 0; m < count; ++m) {
    model::ModuleInstance& module = other.modules[to[m]];
    module = robot.modules[m];
    module.name = "n" + std::to_string(to[m]);
  }
  for (model::Docking docking : robot.dockings) {
    docking.module_a = to[docking.module_a];
    docking.module_b = to[docking.module_b];
    const std::optional<int> mirror = model::MirrorOption(model, docking);
    if (mirror && random() % 2 == 0) {
      std::swap(docking.module_a, docking.module_b);
      std::swap(docking.connector_a, docking.connector_b);
      docking.option = *mirror;
    }
    other.dockings.push_back(docking);
  }
  std::shuffle(other.dockings.begin(), other.dockings.end(), random);
  other.root_module = static_cast<int>(random() % count);
  other.root_link =
      static_cast<int>(random() % model.TypeOf(other, other.root_module).links.size());
  other.X_LR = RandomPose(random);
  return other;
}

model::Robot RandomTree(const model::Model& model, int modules, uint64_t seed) {
  std::mt19937_64 random(seed);
  model::Robot robot;
  robot.name = "tree";
  const model::ModuleType& type = model.module_types[0];
  std::set<std::pair<int, int>> used;
  const auto& options = model.connection_types[0].options;
  for (int m = 0; m < modules; ++m) {
    robot.modules.push_back(
        {"m" + std::to_string(m + 1), 0, std::vector<double>(type.joints.size(), 0.0)});
    while (m > 0 && robot.dockings.size() < static_cast<size_t>(m)) {
      const int other = static_cast<int>(random() % static_cast<uint64_t>(m));
      const int option = static_cast<int>(random() % options.size());
      const model::ConnectionOption& o = options[option];
      if (used.count({other, o.connector_a}) + used.count({m, o.connector_b}) > 0) continue;
      used.insert({other, o.connector_a});
      used.insert({m, o.connector_b});
      robot.dockings.push_back({other, o.connector_a, m, o.connector_b, 0, option});
    }
  }
  return robot;
}

model::Model HungModel(const std::vector<Hung>& joints) {
  model::Model model;
  model::ModuleType& type = model.module_types.emplace_back();
  type.name = "HUNG";
  type.links.emplace_back().name = "l0";
  for (size_t i = 0; i < joints.size(); ++i) {
    type.links.emplace_back().name = "l" + std::to_string(i + 1);
    model::Joint& joint = type.joints.emplace_back();
    joint.name = "j" + std::to_string(i + 1);
    joint.link_a = static_cast<int>(i) + 1;
    joint.link_b = joints[i].on;
    joint.p_MoJo_M = joints[i].through;
    joint.axis = joints[i].axis.normalized();
    joint.lower = joints[i].lower;
    joint.upper = joints[i].upper;
  }
  return model;
}

model::Robot Alone(const model::Model& model, const std::string& name) {
  model::Robot robot;
  robot.name = name;
  robot.modules.push_back({"m", 0, std::vector<double>(model.module_types[0].joints.size(), 0.0)});
  return robot;
}

std::vector<Pose> BodyPoses(const model::Model& model, const model::Robot& robot,
                            const model::JointValues& q) {
  const auto body_of = model::BodiesOf(model, robot);
  const auto start = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  const auto now = model::ForwardKinematics(model, robot, q).X_RL;
  std::vector<Pose> X_RT;
  std::vector<int> counts;
  for (size_t m = 0; m < body_of.size(); ++m) {
    for (size_t l = 0; l < body_of[m].size(); ++l) {
      const auto body = static_cast<size_t>(body_of[m][l]);
      if (body >= X_RT.size()) {
        X_RT.resize(body + 1, Pose::Identity());
        counts.resize(body + 1, 0);
      }
      X_RT[body].translation() += start[m][l].translation();
      ++counts[body];
    }
  }
  for (size_t b = 0; b < X_RT.size(); ++b) X_RT[b].translation() /= counts[b];
  std::vector<bool> done(X_RT.size(), false);
  for (size_t m = 0; m < body_of.size(); ++m) {
    for (size_t l = 0; l < body_of[m].size(); ++l) {
      const auto body = static_cast<size_t>(body_of[m][l]);
      if (done[body]) continue;
      done[body] = true;
      X_RT[body] = now[m][l] * start[m][l].inverse() * X_RT[body];
    }
  }
  return X_RT;
}

void ExpectSameMotion(const model::Model& model_a, const model::Robot& a,
                      const model::Model& model_b, const model::Robot& b,
                      const congruence::Congruence& congruence, const congruence::Mapping& mapping,
                      uint64_t seed, const std::vector<congruence::JointRef>& still) {
  std::mt19937_64 random(seed);
  model::JointValues q_a = model::StartValues(a);
  model::JointValues q_b = model::StartValues(b);
  for (size_t j = 0; j < mapping.joints.size(); ++j) {
    const congruence::JointRef from = congruence.joints_a[j];
    const congruence::JointImage& image = mapping.joints[j];
    const congruence::JointRef to = congruence.joints_b[image.to];
    const auto module = static_cast<size_t>(from.module);
    const auto index = static_cast<size_t>(from.joint);
    const model::Joint& joint = model_a.TypeOf(a, from.module).joints[index];
    double& q = q_a[module][index];
    const bool stays = std::any_of(still.begin(), still.end(), [&](const auto& ref) {
      return ref.module == from.module && ref.joint == from.joint;
    });
    if (!stays) {
      const bool bounded = std::isfinite(joint.lower);
      q = std::uniform_real_distribution<double>(bounded ? joint.lower : -3.0,
                                                 bounded ? joint.upper : 3.0)(random);
    }
    const double q_to = image.sign * q + image.offset;
    const model::Joint& joint_to = model_b.TypeOf(b, to.module).joints[to.joint];
    EXPECT_GE(q_to, joint_to.lower - 1e-4);
    EXPECT_LE(q_to, joint_to.upper + 1e-4);
    q_b[to.module][to.joint] = q_to;
  }
  const std::vector<Pose> X_RT = BodyPoses(model_a, a, q_a);
  const std::vector<Pose> X_RT_b = BodyPoses(model_b, b, q_b);
  ASSERT_EQ(X_RT.size(), X_RT_b.size());
  const auto C = [&](size_t body) {
    Pose X = Pose::Identity();
    X.linear() = mapping.R[body];
    return X;
  };
  // G at these joint values, from body 0; it must then hold for all.
  const Pose G = X_RT_b[mapping.body_to[0]] * C(0) * X_RT[0].inverse();
  for (size_t body = 0; body < X_RT.size(); ++body) {
    const Pose moved = G * X_RT[body] * C(body).inverse();
    const Pose& found = X_RT_b[mapping.body_to[body]];
    EXPECT_LT((moved.matrix() - found.matrix()).norm(), 1e-6) << "body " << body;
  }
}

}  // namespace morphbus::test
