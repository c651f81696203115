// The programs of docs/roles.md do what the text beside them says.

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "test/support/compiled.h"
#include "test/support/doc_examples.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/image/print_line.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;

class RulesTest : public ::testing::Test {
 protected:
  /// The example of that name on a row of so many hinges.
  VmRobot& Run(const std::string& name, int modules) {
    std::string text;
    for (const test::DocExample& example : test::DocExamples("docs/roles.md")) {
      if (example.name == name) text = example.text;
    }
    EXPECT_FALSE(text.empty()) << name;
    robot_ = test::ChainRobot(model_, modules);
    vms_ = std::make_unique<VmRobot>(model_, robot_, test::ProgramFrom(text, model_));
    return *vms_;
  }

  /// Ticks, and keeps what module `m` prints and plays.
  void Tick(int count, int m = 0) {
    for (int i = 0; i < count; ++i) {
      vms_->Tick();
      const StatusReport& status = vms_->output(m).status;
      for (int k = 0; k < status.num_prints; ++k) {
        const PrintReport& print = status.prints[k];
        printed_.push_back(
            PrintText(vms_->program(), nullptr, print.text, print.values, print.num_values));
      }
      const std::string role = vms_->RoleOf(m);
      if (roles_.empty() || roles_.back() != role) roles_.push_back(role);
    }
  }

  const model::Model model_ = test::ToyModel();
  model::Robot robot_;
  std::unique_ptr<VmRobot> vms_;
  std::vector<std::string> printed_, roles_;
};

TEST_F(RulesTest, Overriding) {
  Run("overriding", 1);
  Tick(40);
  EXPECT_EQ(printed_, (std::vector<std::string>{"Careful.stand", "Leg.stand 6", "Leg.ready",
                                                "Test.last", "Test.raise", "Leg.raise"}));
  EXPECT_TRUE(vms_->faults().empty());
}

TEST_F(RulesTest, Ambiguity) {
  VmRobot& vms = Run("ambiguity", 3);
  Tick(100);
  EXPECT_EQ(vms.RoleOf(0), "First");
  EXPECT_EQ(vms.RoleOf(1), "Middle");
  EXPECT_EQ(vms.RoleOf(2), "First");
  EXPECT_EQ(roles_, (std::vector<std::string>{"", "First"}));
  std::vector<std::string> rivals;
  for (const auto& event : vms.faults()) {
    ASSERT_TRUE(event.fault.code == FaultCode::kAmbiguousRole);
    const Text name = vms.program().role(event.fault.rival_role).name;
    if (event.module == 0) rivals.emplace_back(name.data, name.size);
  }
  EXPECT_EQ(rivals, (std::vector<std::string>{"Second", "Derived"}));
}

TEST_F(RulesTest, Reevaluation) {
  VmRobot& vms = Run("reevaluation", 2);
  std::set<float> bends;
  for (int i = 0; i < 150; ++i) {
    Tick(1);
    bends.insert(vms.state(0).role.fields[0].AsFloat());
  }
  EXPECT_EQ(roles_, (std::vector<std::string>{"", "Pair"}));
  EXPECT_EQ(bends, (std::set<float>{0, 30})) << "it moves all the time";
  const auto ticks_until = [&](const std::string& role) {
    int ticks = 0;
    while (vms.RoleOf(0) != role && ticks < 100) {
      Tick(1);
      ++ticks;
    }
    return ticks;
  };
  const int settle = vms.program().settle_ticks();
  vms.SetDocked(0, false);
  EXPECT_NEAR(ticks_until("Alone"), settle, 3);
  vms.SetDocked(0, true);
  EXPECT_NEAR(ticks_until("Pair"), settle, 4);
}

TEST_F(RulesTest, Leaving) {
  VmRobot& vms = Run("leaving", 2);
  Tick(30);
  ASSERT_EQ(vms.RoleOf(0), "Pair");
  Tick(20);
  vms.SetDocked(0, false);
  Tick(60);
  ASSERT_EQ(vms.RoleOf(0), "Alone");
  ASSERT_EQ(printed_.size(), 1u);
  EXPECT_EQ(printed_[0].rfind("alone at", 0), 0u);
  // The joint goes on to its target, and the timer counts from when the role was taken.
  EXPECT_NEAR(vms.joints()[0][0], 40 * M_PI / 180, 1e-6);
  EXPECT_GT(vms.state(0).role.fields[0].AsInt(), 2);
  vms.SetDocked(0, true);
  Tick(40);
  ASSERT_EQ(vms.RoleOf(0), "Pair");
  vms.SetDocked(0, false);
  while (vms.RoleOf(0) != "Alone") Tick(1);
  EXPECT_EQ(vms.state(0).role.fields[0].AsInt(), 0);
  Tick(5);
  EXPECT_EQ(printed_, (std::vector<std::string>{printed_[0], "alone at 40"}));
}

}  // namespace
}  // namespace morphbus::vm
