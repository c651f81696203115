// Poses of all 27 links of the quadruped at changing joint values: the generated C, the library,
// and beside them Orocos KDL (a plain loop over its segments, its fastest way) and MuJoCo's
// mj_kinematics.

#include <benchmark/benchmark.h>
#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <kdl/segment.hpp>
#include <vector>

#include "compiler/emit/back_ends.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/model/kinematic_tree.h"
#include "quadruped.h"
#include "test/support/compiled.h"

namespace morphbus::model {
namespace {

constexpr size_t kJoints = quadruped_num_joints;
constexpr size_t kLinks = quadruped_num_links;
constexpr size_t kConfigurations = 64;

const Model& Mtran() {
  static const Model* const model = new Model(test::ModelFrom("models/mtran.m3l"));
  return *model;
}

const Robot& Quadruped() { return *Mtran().FindRobot("quadruped"); }

/// Joint values within the limits, the same for all.
template <typename T>
std::vector<std::array<T, kJoints>> Values() {
  std::vector<std::array<T, kJoints>> values(kConfigurations);
  unsigned state = 1;
  for (auto& q : values) {
    for (T& value : q) {
      state = state * 1664525u + 1013904223u;
      value = static_cast<T>(state >> 8) / static_cast<T>(1 << 23) - static_cast<T>(1);
    }
  }
  return values;
}

void GeneratedC(benchmark::State& state) {
  const auto values = Values<float>();
  float X[kLinks][12];
  size_t i = 0;
  for (auto _ : state) {
    quadruped_forward_kinematics(values[i++ % kConfigurations].data(), X);
    benchmark::DoNotOptimize(X);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(GeneratedC);

void Library(benchmark::State& state) {
  const KinematicTree tree(Mtran(), Quadruped());
  const auto values = Values<double>();
  std::vector<Pose> X_RL(kLinks);
  size_t i = 0;
  for (auto _ : state) {
    tree.Evaluate(values[i++ % kConfigurations].data(), X_RL.data());
    benchmark::DoNotOptimize(X_RL.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(Library);

KDL::Vector ToKdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void Kdl(benchmark::State& state) {
  const emit::RobotTree tree = emit::TreeOf(Mtran(), Quadruped());
  std::vector<KDL::Segment> segments;
  for (const emit::TreeLink& link : tree.links) {
    if (link.joint >= 0) {
      const emit::TreeJoint& joint = tree.joints[static_cast<size_t>(link.joint)];
      segments.emplace_back(
          KDL::Joint(joint.name, ToKdl(joint.origin), ToKdl(joint.axis), KDL::Joint::RotAxis));
      continue;
    }
    const Eigen::Matrix3d R = link.X_PL.linear();
    segments.emplace_back(KDL::Joint(KDL::Joint::None),
                          KDL::Frame(KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1),
                                                   R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
                                     ToKdl(Eigen::Vector3d(link.X_PL.translation()))));
  }
  const auto values = Values<double>();
  std::vector<KDL::Frame> frames(kLinks);
  size_t round = 0;
  for (auto _ : state) {
    const auto& q = values[round++ % kConfigurations];
    for (size_t i = 0; i < kLinks; ++i) {
      const emit::TreeLink& link = tree.links[i];
      const KDL::Frame X_PL =
          segments[i].pose(link.joint < 0 ? 0.0 : q[static_cast<size_t>(link.joint)]);
      frames[i] = link.parent < 0 ? X_PL : frames[static_cast<size_t>(link.parent)] * X_PL;
    }
    benchmark::DoNotOptimize(frames.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(Kdl);

void MuJoCo(benchmark::State& state) {
  const std::string xml =
      emit::ToMjcf(Mtran(), emit::TreeOf(Mtran(), Quadruped()), "quadruped").text;
  mjVFS files;
  mj_defaultVFS(&files);
  mj_makeEmptyFileVFS(&files, "robot.xml", static_cast<int>(xml.size()));
  std::memcpy(files.filedata[0], xml.data(), xml.size());
  char error[200] = "";
  mjModel* const model = mj_loadXML("robot.xml", &files, error, sizeof error);
  mj_deleteVFS(&files);
  if (model == nullptr) {
    state.SkipWithError(error);
    return;
  }
  mjData* const data = mj_makeData(model);
  const auto values = Values<double>();
  size_t i = 0;
  for (auto _ : state) {
    const auto& q = values[i++ % kConfigurations];
    std::copy(q.begin(), q.end(), data->qpos + 7);  // After the free base.
    mj_kinematics(model, data);
    benchmark::DoNotOptimize(data->xpos);
    benchmark::ClobberMemory();
  }
  mj_deleteData(data);
  mj_deleteModel(model);
}
BENCHMARK(MuJoCo);

}  // namespace
}  // namespace morphbus::model

BENCHMARK_MAIN();
