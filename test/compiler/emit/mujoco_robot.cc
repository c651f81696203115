#include "test/compiler/emit/mujoco_robot.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace morphbus::test {
namespace {

void WriteBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace

Simulation LoadInMuJoCo(const emit::Exported& exported, const std::string& name) {
  // By default MuJoCo appends its warnings to a file in the current folder.
  mju_user_warning = [](const char* message) { ADD_FAILURE() << "MuJoCo: " << message; };
  static int count = 0;
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) /
      ("morphbus-mujoco-" + std::to_string(::getpid()) + "-" + std::to_string(++count));
  WriteBytes(folder / name, exported.text);
  for (const emit::CompanionFile& file : exported.companions) {
    WriteBytes(folder / file.path, file.bytes);
  }
  char error[500] = "";
  Simulation simulation;
  simulation.model.reset(mj_loadXML((folder / name).c_str(), nullptr, error, sizeof error));
  std::filesystem::remove_all(folder);
  EXPECT_NE(simulation.model, nullptr) << error << "\n" << exported.text;
  EXPECT_STREQ(error, "");
  if (simulation.model) simulation.data.reset(mj_makeData(simulation.model.get()));
  return simulation;
}

double& Position(const Simulation& simulation, const std::string& joint) {
  const int id = mj_name2id(simulation.model.get(), mjOBJ_JOINT, joint.c_str());
  EXPECT_GE(id, 0) << joint;
  return simulation.data->qpos[simulation.model->jnt_qposadr[id]];
}

double Residual(const Simulation& simulation) {
  double residual = 0.0;
  for (int i = 0; i < simulation.data->nefc; ++i) {
    if (simulation.data->efc_type[i] != mjCNSTR_EQUALITY) continue;
    residual = std::max(residual, std::abs(simulation.data->efc_pos[i]));
  }
  return residual;
}

void GoToStart(const Simulation& simulation) {
  const int key = mj_name2id(simulation.model.get(), mjOBJ_KEY, "start");
  ASSERT_GE(key, 0);
  mj_resetDataKeyframe(simulation.model.get(), simulation.data.get(), key);
}

}  // namespace morphbus::test
