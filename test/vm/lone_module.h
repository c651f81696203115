#pragma once
// One module of a toy type with a program of one role, for tests of what statements do.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"

namespace morphbus::vm {

using test::VmRobot;
using test::VmRobotOptions;

class LoneModuleTest : public ::testing::Test {
 protected:
  static constexpr double kDegree = M_PI / 180;
  /// One module of toy type `type` (0 Hinge, 1 Rail), start values 0, with roles' bodies as given.
  VmRobot& Lone(const std::string& members, int type = 0, VmRobotOptions options = {}) {
    robot_ = test::ChainRobot(model_, 1);
    robot_.modules[0].type = type;
    robot_.modules[0].start.assign(model_.module_types[static_cast<size_t>(type)].joints.size(),
                                   0.0);
    vms_ = std::make_unique<VmRobot>(
        model_, robot_, test::ProgramFrom("role R extends Module {\n" + members + "\n}\n", model_),
        options);
    return *vms_;
  }
  /// Ticks until the role is held; the startup has run its first stretch then.
  void TakeRole() {
    for (int i = 0; i < 30 && vms_->output(0).status.role < 0; ++i) vms_->Tick();
    ASSERT_EQ(vms_->output(0).status.role, 0);
  }
  [[nodiscard]] double Target(int joint = 0) const {
    return vms_->output(0).joints[joint].target / kDegree;
  }
  /// Distinct targets of joint 0 in the order they were set, over `ticks` ticks.
  std::vector<int> Targets(int ticks) {
    std::vector<int> targets;
    for (int i = 0; i < ticks; ++i) {
      vms_->Tick();
      const int target = static_cast<int>(std::lround(Target()));
      if (targets.empty() || targets.back() != target) targets.push_back(target);
    }
    return targets;
  }
  const model::Model model_ = test::ToyModel();
  model::Robot robot_;
  std::unique_ptr<VmRobot> vms_;
};

}  // namespace morphbus::vm
