// Known congruences: the quadrupeds of the paper's Fig. 9, modules alone, what must not be
// congruent.

#include "compiler/congruence/congruence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "compiler/base/check.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::congruence {
namespace {

using Eigen::Vector3d;

const model::Robot& RobotOf(const model::Model& model, const std::string& name) {
  const model::Robot* robot = model.FindRobot(name);
  MORPHBUS_CHECK(robot != nullptr);
  return *robot;
}

/// m5's joints are locked by the loops.
const std::vector<JointRef> kLocked = {{4, 0}, {4, 1}};

/// Where m1 goes, by mapping.
std::multiset<std::string> ImagesOfM1(const Congruence& c, const model::Robot& b) {
  std::multiset<std::string> images;
  for (const Mapping& mapping : c.mappings) {
    images.insert(b.modules[mapping.module_to[0]].name);
  }
  return images;
}

TEST(Quadruped, IsCongruentToItselfInFourWays) {
  const model::Model& model = test::MtranFile();
  const model::Robot& robot = RobotOf(model, "quadruped");
  const Congruence c = Compare(model, robot, model, robot);
  EXPECT_EQ(c.count, 4);
  ASSERT_EQ(c.mappings.size(), 4u);
  // Each leg can stand for each other; left and right are exchanged where m1 goes to m6.
  EXPECT_EQ(ImagesOfM1(c, robot), (std::multiset<std::string>{"m1", "m4", "m6", "m9"}));
  EXPECT_TRUE(c.mappings[0].keeps_frame);
  for (size_t m = 0; m < 9; ++m) EXPECT_EQ(c.mappings[0].module_to[m], static_cast<int>(m));
  for (const Mapping& mapping : c.mappings) {
    EXPECT_EQ(mapping.module_to[4], 4);
    for (const JointImage& image : mapping.joints) EXPECT_EQ(image.offset, 0.0);
    test::ExpectSameMotion(model, robot, model, robot, c, mapping, 1, kLocked);
  }
  EXPECT_TRUE(c.masses.masses_equal);
  EXPECT_TRUE(c.masses.hulls_equal);
}

TEST(Quadruped, ExchangingLeftAndRightTurnsAllJointsRound) {
  const model::Model& model = test::MtranFile();
  const model::Robot& robot = RobotOf(model, "quadruped");
  const Congruence c = Compare(model, robot, model, robot);
  for (const Mapping& mapping : c.mappings) {
    if (robot.modules[mapping.module_to[0]].name != "m6") continue;
    // A half turn about north: m1 and m6 stand alike, so their axes come out opposite.
    for (const JointImage& image : mapping.joints) EXPECT_EQ(image.sign, -1.0);
    return;
  }
  FAIL() << "no such mapping";
}

TEST(Quadruped, IsCongruentToTheOtherInFourWaysOneOfWhichKeepsTheFrame) {
  const model::Model& model = test::MtranFile();
  const model::Robot& a = RobotOf(model, "quadruped");
  const model::Robot& b = RobotOf(model, "equivalent_quadruped");
  const Congruence c = Compare(model, a, model, b);
  EXPECT_EQ(c.count, 4);
  EXPECT_EQ(ImagesOfM1(c, b), (std::multiset<std::string>{"m1", "m4", "m6", "m9"}));
  const Mapping& first = c.mappings[0];
  EXPECT_TRUE(first.keeps_frame);
  for (size_t i = 1; i < c.mappings.size(); ++i) EXPECT_FALSE(c.mappings[i].keeps_frame);
  const std::vector<int> expected = {5, 6, 7, 8, 4, 0, 1, 2, 3};
  EXPECT_EQ(first.module_to, expected);
  // Only the modules that stand the other way round turn the other way: m1 and m9.
  for (size_t j = 0; j < first.joints.size(); ++j) {
    const int module = c.joints_a[j].module;
    EXPECT_EQ(first.joints[j].sign, module == 0 || module == 8 ? -1.0 : 1.0) << "module " << module;
  }
  for (const Mapping& mapping : c.mappings) {
    test::ExpectSameMotion(model, a, model, b, c, mapping, 2, kLocked);
  }
  EXPECT_TRUE(c.masses.masses_equal) << c.masses.mass_difference;
  EXPECT_TRUE(c.masses.hulls_equal) << c.masses.hull_difference;
}

TEST(Quadruped, IsNotCongruentWithOtherLimitsInOneLowerLeg) {
  model::Model model = test::MtranFile();
  const model::Robot robot = RobotOf(model, "quadruped");
  model.module_types.push_back(model.module_types[0]);
  model.module_types[1].joints[0].lower = -M_PI / 4;
  model.module_types[1].joints[0].upper = M_PI / 4;
  model::Robot changed = robot;
  changed.name = "changed";
  changed.modules[0].type = 1;
  const Congruence c = Compare(model, robot, model, changed);
  EXPECT_FALSE(c.congruent());
  EXPECT_TRUE(c.decided);
  EXPECT_EQ(c.reason,
            "joint m1.joint_1 of changed turns from -45 to 45 degrees: quadruped has no joints of "
            "this kind and range, changed has 1 joint");
}

TEST(Quadruped, IsNotCongruentWithOneConnectionMovedByAQuarterTurn) {
  const model::Model& model = test::MtranFile();
  const model::Robot robot = RobotOf(model, "quadruped");
  model::Robot changed = robot;
  changed.name = "changed";
  ++changed.dockings[0].option;  // m1.c2 to m2.c5, 54 for 53: a quarter turn
  const Congruence c = Compare(model, robot, model, changed);
  EXPECT_FALSE(c.congruent());
  EXPECT_NE(c.reason.find("is off by 90 degrees"), std::string::npos) << c.reason;
  EXPECT_NE(c.reason.find("joint m1.joint_"), std::string::npos) << c.reason;
  EXPECT_NE(c.reason.find("turn about (0, 0, "), std::string::npos) << c.reason;
  EXPECT_NE(c.reason.find("the nearest, m1.joint_"), std::string::npos) << c.reason;
}

TEST(Quadruped, IsNotCongruentWithOneModuleMore) {
  const model::Model& model = test::MtranFile();
  const model::Robot robot = RobotOf(model, "quadruped");
  model::Robot changed = robot;
  changed.name = "changed";
  changed.modules.push_back(robot.modules[0]);
  changed.modules.back().name = "m10";
  model::Docking docking = robot.dockings[0];  // a module's c2 to another's c5
  docking.module_a = 9;
  docking.module_b = 0;
  changed.dockings.push_back(docking);
  EXPECT_EQ(Compare(model, robot, model, changed).reason,
            "quadruped has 9 modules with 18 bodies and 18 joints, changed has 10 modules with 20 "
            "bodies and 20 joints");
}

TEST(Quadruped, MayWeighMoreAndStillBeCongruent) {
  model::Model model = test::MtranFile();
  const model::Robot robot = RobotOf(model, "quadruped");
  model.module_types.push_back(model.module_types[0]);
  model.module_types[1].links[0].mass_kg *= 2.0;
  model.module_types[1].links[1].hull[0] *= 1.1;
  model::Robot changed = robot;
  changed.modules[0].type = 1;
  const Congruence c = Compare(model, robot, model, changed);
  EXPECT_EQ(c.count, 4);
  EXPECT_FALSE(c.masses.masses_equal);
  EXPECT_NE(c.masses.mass_difference.find("kg"), std::string::npos) << c.masses.mass_difference;
}

TEST(Quadruped, IsCongruentWhateverItsStartValues) {
  const model::Model& model = test::MtranFile();
  const model::Robot& robot = RobotOf(model, "quadruped");
  model::Robot moved = robot;
  moved.modules[0].start = {0.3, -0.7};
  moved.modules[8].start = {1.1, 0.2};
  const Congruence c = Compare(model, robot, model, moved);
  EXPECT_EQ(c.count, 4);
  EXPECT_TRUE(c.mappings[0].keeps_frame);
  for (const Mapping& mapping : c.mappings) {
    test::ExpectSameMotion(model, robot, model, moved, c, mapping, 3, kLocked);
  }
}

// --- Modules alone -------------------------------------------------------------------------------

model::Robot Alone(const model::Model& model) {
  model::Robot robot;
  robot.name = "alone";
  robot.modules.push_back({"m1", 0, std::vector<double>(model.module_types[0].joints.size(), 0.0)});
  return robot;
}

TEST(Modules, AnMtranIsCongruentToItselfByItsThreeHalfTurns) {
  const model::Model model = test::MtranModel();
  const model::Robot robot = Alone(model);
  const Congruence c = Compare(model, robot, model, robot);
  EXPECT_EQ(c.count, 4);
  for (const Mapping& mapping : c.mappings) {
    for (const Vector3d& axis : mapping.free_axis) EXPECT_EQ(axis, Vector3d(0, 0, 0));
    test::ExpectSameMotion(model, robot, model, robot, c, mapping, 4);
  }
}

TEST(Modules, TwoHalvesOnOneAxisCanBeExchangedAndTurnedRound) {
  model::Model model;
  model.module_types = {test::Atron(false)};
  model.module_types[0].joints[0].lower = -INFINITY;
  model.module_types[0].joints[0].upper = INFINITY;
  const model::Robot robot = Alone(model);
  const Congruence c = Compare(model, robot, model, robot);
  EXPECT_EQ(c.count, 4);
  for (const Mapping& mapping : c.mappings) {
    EXPECT_EQ(mapping.joints[0].offset, 0.0) << "it is free";
    EXPECT_NE(mapping.free_axis[0], Vector3d(0, 0, 0));
    EXPECT_NE(mapping.free_group[0], mapping.free_group[1]);
    test::ExpectSameMotion(model, robot, model, robot, c, mapping, 5);
  }
}

/// One link `hub` and `count` others that turn about its z axis, all origins on that axis.
model::Model Wheels(int count, double lower, double upper) {
  model::Model model;
  model::ModuleType& type = model.module_types.emplace_back();
  type.name = "WHEELS";
  type.links.emplace_back().name = "hub";
  for (int i = 1; i <= count; ++i) {
    type.links.emplace_back().name = "wheel_" + std::to_string(i);
    model::Joint& joint = type.joints.emplace_back();
    joint.name = "joint_" + std::to_string(i);
    joint.link_a = i;
    joint.p_MoJo_M = Vector3d(0, 0, 1);
    joint.axis = Vector3d(0, 0, 1);
    joint.lower = lower;
    joint.upper = upper;
  }
  return model;
}

TEST(Modules, WheelsOnOneAxisCanAllBeExchanged) {
  const model::Model model = Wheels(3, -INFINITY, INFINITY);
  const model::Robot robot = Alone(model);
  const Congruence c = Compare(model, robot, model, robot);
  EXPECT_EQ(c.count, 12) << "six orders, each of them two ways round";
  for (const Mapping& mapping : c.mappings) {
    test::ExpectSameMotion(model, robot, model, robot, c, mapping, 6);
  }
}

TEST(Modules, LimitsDetermineTheOffsetWhereNothingElseDoes) {
  const model::Model model_a = Wheels(1, 0.0, M_PI);
  const model::Model model_b = Wheels(1, -M_PI / 2, M_PI / 2);
  const model::Robot a = Alone(model_a);
  const model::Robot b = Alone(model_b);
  const Congruence c = Compare(model_a, a, model_b, b);
  EXPECT_EQ(c.count, 4);
  for (const Mapping& mapping : c.mappings) {
    EXPECT_NEAR(mapping.joints[0].offset, -mapping.joints[0].sign * M_PI / 2, 1e-12);
    test::ExpectSameMotion(model_a, a, model_b, b, c, mapping, 7);
  }
}

TEST(Modules, LimitsThatAskForAnotherPostureAreNotTheSame) {
  // As above, but the wheel's origin is off the axis, which pins the offset to 0.
  model::Model model_a = Wheels(1, 0.0, M_PI);
  model::Model model_b = Wheels(1, -M_PI / 2, M_PI / 2);
  for (model::Model* model : {&model_a, &model_b}) {
    model->module_types[0].joints[0].p_MoJo_M = Vector3d(1, 0, 0);
  }
  const Congruence c = Compare(model_a, Alone(model_a), model_b, Alone(model_b));
  EXPECT_FALSE(c.congruent());
  EXPECT_FALSE(c.reason.empty());
}

TEST(Modules, ASlideIsTurnedRoundAboutAnyAxisAcrossIt) {
  model::Model model = Wheels(1, -0.25, 0.25);
  model.module_types[0].joints[0].type = model::JointType::kPrismatic;
  const model::Robot robot = Alone(model);
  const Congruence c = Compare(model, robot, model, robot);
  EXPECT_EQ(c.count, 4) << "the links can be exchanged, and the axis turned round";
  for (const Mapping& mapping : c.mappings) {
    test::ExpectSameMotion(model, robot, model, robot, c, mapping, 8);
    EXPECT_EQ(mapping.free_group[0], mapping.free_group[1]) << "a slide does not turn";
  }
  // Limits that are not alike on both sides leave one way round for each choice of links.
  model.module_types[0].joints[0].lower = 0.0;
  const Congruence one_sided = Compare(model, robot, model, robot);
  EXPECT_EQ(one_sided.count, 2);
}

TEST(Modules, ALinkAloneIsCongruentInOneWay) {
  const model::Model model = Wheels(0, 0.0, 0.0);
  const model::Robot robot = Alone(model);
  const Congruence c = Compare(model, robot, model, robot);
  EXPECT_EQ(c.count, 1);
  EXPECT_TRUE(c.mappings[0].keeps_frame);
}

TEST(Modules, AMirrorImageIsNotCongruent) {
  // Three axes that no proper motion takes to their mirror image.
  const auto chain = [](double side) {
    model::Model model = Wheels(3, -1.0, 1.5);
    std::vector<model::Joint>& joints = model.module_types[0].joints;
    joints[0].axis = Vector3d(1, 0, 0);
    joints[1].axis = Vector3d(0, 1, 0);
    joints[2].axis = Vector3d(0, 0, 1);
    joints[0].p_MoJo_M = Vector3d(0, side * 0.5, 0);
    joints[1].p_MoJo_M = Vector3d(0, 0, 0.7);
    joints[2].p_MoJo_M = Vector3d(1.1, 0, 0);
    return model;
  };
  const model::Model left = chain(-1.0);
  const model::Model right = chain(1.0);
  EXPECT_EQ(Compare(right, Alone(right), right, Alone(right)).count, 1);
  const Congruence c = Compare(right, Alone(right), left, Alone(left));
  EXPECT_FALSE(c.congruent());
  EXPECT_FALSE(c.reason.empty());
}

TEST(Chains, AStraightMtranChainHasThreeHalfTurns) {
  const model::Model& model = test::MtranFile();
  for (const int modules : {2, 5, 8}) {
    std::vector<test::Mating> matings;
    for (int m = 1; m < modules; ++m) {
      matings.push_back({"m" + std::to_string(m), "c2", "m" + std::to_string(m + 1), "c5", {}});
    }
    const model::Robot robot =
        test::Assemble(model, "chain", modules, matings, 0, 0, model::Pose::Identity());
    const Congruence c = Compare(model, robot, model, robot);
    EXPECT_EQ(c.count, 4) << modules;
    for (const Mapping& mapping : c.mappings) {
      test::ExpectSameMotion(model, robot, model, robot, c, mapping, 9);
    }
  }
}

}  // namespace
}  // namespace morphbus::congruence
