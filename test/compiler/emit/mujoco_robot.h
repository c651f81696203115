#pragma once
// An exported robot in MuJoCo.

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

#include "compiler/emit/exported.h"

namespace morphbus::test {

struct Simulation {
  std::unique_ptr<mjModel, void (*)(mjModel*)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, void (*)(mjData*)> data{nullptr, mj_deleteData};
};

/// Writes the files to a folder of their own, `name` the main one, and loads that; fails the test,
/// and leaves the model empty, if MuJoCo has anything to say against it.
Simulation LoadInMuJoCo(const emit::Exported& exported, const std::string& name = "robot.xml");

/// The value of a joint in qpos, rad or m.
double& Position(const Simulation& simulation, const std::string& joint);

/// Largest violation (m or rad) of an equality constraint at the present state.
double Residual(const Simulation& simulation);

/// To the keyframe "start".
void GoToStart(const Simulation& simulation);

}  // namespace morphbus::test
