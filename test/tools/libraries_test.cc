// The libraries for other people's programs, against what is behind them.

#include <gtest/gtest.h>
#include <morphbus/dynarole/program.h>
#include <morphbus/m3l/m3l.h>
#include <morphbus/observe/log.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

// Only so that a message with the name of a public class does not compile: one program has both.
#include "bridge/outward/monitor.pb.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/pose_numbers.h"
#include "logger/compare/kinematic_tracks.h"
#include "test/logger/recorded_walk.h"
#include "test/support/source_dir.h"

namespace morphbus {
namespace {

Model Mtran() { return CompileM3l(test::SourcePath("models/mtran.m3l")); }

/// What `call` throws, as text; empty if it throws nothing.
template <class Call>
std::string WhyNot(const Call& call) {
  try {
    call();
  } catch (const Failure& failure) {
    return failure.what();
  }
  return "";
}

TEST(ModelLibrary, NamesThePartsOfTypesConnectionsAndRobots) {
  const Model model = Mtran();
  ASSERT_EQ(model.module_types().size(), 1U);
  const ModuleType& type = model.module_types().front();
  EXPECT_EQ(type.name, "MTRAN");
  EXPECT_EQ(type.joints, (std::vector<std::string>{"joint_1", "joint_2"}));
  EXPECT_EQ(type.connectors.size(), 6U);
  const ConnectionType& connection = model.connection_types().front();
  EXPECT_EQ(connection.type_a, "MTRAN");
  ASSERT_EQ(connection.options.size(), 72U);
  EXPECT_EQ(connection.options[9].number, 10);
  const Robot robot = model.robot("quadruped");
  EXPECT_EQ(robot.modules().size(), 9U);
  EXPECT_EQ(robot.connections().size(), 10U);
  EXPECT_EQ(robot.links()[robot.FindLink("m2.connecting_bar")].module, 1);
  EXPECT_EQ(robot.joints()[robot.FindJoint("m3.joint_2")].name, "m3.joint_2");
  EXPECT_EQ(robot.model().Hash(), model.Hash());
}

TEST(ModelLibrary, SaysWhichNameWasMeant) {
  const Model model = Mtran();
  EXPECT_EQ(WhyNot([&] { (void)model.robot("quadrupet"); }),
            "there is no robot 'quadrupet' (did you mean 'quadruped'?)");
  EXPECT_EQ(WhyNot([&] { (void)model.robot("quadruped").FindJoint("m1.joint_3"); }).substr(0, 59),
            "there is no joint 'm1.joint_3' (did you mean 'm1.joint_1'?)");
  EXPECT_EQ(WhyNot([&] { (void)model.robot(); }), "the model has several robots: name one of them");
}

TEST(ModelLibrary, GivesThePosesOfForwardKinematicsToTheBit) {
  const std::string path = test::SourcePath("models/mtran.m3l");
  const m3l::CompileOutput output = m3l::CompileFiles({path});
  const model::Robot* expected = output.model->FindRobot("quadruped");
  model::JointValues q = model::StartValues(*expected);
  q[0][0] = 0.3;
  q[4][1] = -0.1;
  const model::KinematicState state = model::ForwardKinematics(*output.model, *expected, q);

  const Robot robot = Mtran().robot("quadruped");
  std::vector<double> values = robot.StartValues();
  values[robot.FindJoint("m1.joint_1")] = 0.3;
  values[robot.FindJoint("m5.joint_2")] = -0.1;
  const LinkPoses poses = robot.ForwardKinematics(values);
  ASSERT_EQ(poses.X_RL.size(), 27U);
  for (size_t i = 0; i < poses.X_RL.size(); ++i) {
    const model::PoseNumbers numbers = model::NumbersOf(state.X_RL[i / 3][i % 3]);
    EXPECT_EQ(poses.X_RL[i].position, numbers.position);
    EXPECT_EQ(poses.X_RL[i].rotation, numbers.rotation);
  }
  EXPECT_EQ(poses.closure_m, state.closure_m);
  EXPECT_GT(poses.closure_m, 0);
  // The same poses as matrices turn the link's x axis as the internal ones do.
  const std::array<double, 16> matrix = poses.X_RL[1].Matrix();
  for (int row = 0; row < 3; ++row) {
    EXPECT_NEAR(matrix[4 * row], state.X_RL[0][1].linear()(row, 0), 1e-12);
    EXPECT_EQ(matrix[4 * row + 3], poses.X_RL[1].position[row]);
  }
}

TEST(ModelLibrary, RefusesAnotherNumberOfJointValues) {
  const Robot robot = Mtran().robot("quadruped");
  const std::vector<double> few(3);
  EXPECT_EQ(WhyNot([&] { (void)robot.ForwardKinematics(few); }),
            "robot quadruped has 18 joints, and here are 3 values");
  EXPECT_NE(WhyNot([&] { (void)robot.JacobianOf(0, few); }), "");
  EXPECT_EQ(WhyNot([&] { (void)robot.JacobianOf(27, robot.StartValues()); }),
            "there is no link number 27 in robot quadruped");
}

TEST(ModelLibrary, TellsHowFastALinkMoves) {
  const Robot robot = Mtran().robot("quadruped");
  const int joint = robot.FindJoint("m1.joint_1");
  std::vector<double> values = robot.StartValues();
  const int link = robot.FindLink("m1.active_block");
  const Jacobian jacobian = robot.JacobianOf(link, values);
  EXPECT_EQ(jacobian.columns, 18U);
  const Pose before = robot.ForwardKinematics(values).X_RL[link];
  constexpr double kStep = 1e-6;
  values[joint] += kStep;
  const Pose after = robot.ForwardKinematics(values).X_RL[link];
  for (int row = 0; row < 3; ++row) {
    EXPECT_NEAR(jacobian.At(row, joint), (after.position[row] - before.position[row]) / kStep,
                1e-6);
  }
}

TEST(ModelLibrary, KnowsBodiesLockedJointsAndMobility) {
  const KinematicGraph graph = Mtran().robot("quadruped").Graph();
  EXPECT_EQ(graph.joints.size(), 18U);
  EXPECT_EQ(graph.bodies.size(), 18U);
  ASSERT_TRUE(graph.mobility.has_value());
  int locked = 0;
  for (const KinematicGraph::Edge& edge : graph.joints) locked += edge.locked.value_or(false);
  EXPECT_EQ(*graph.mobility + locked, 18);
  EXPECT_EQ(Mtran().robot("quadruped").CongruenceHash(),
            Mtran().robot("equivalent_quadruped").CongruenceHash());
}

TEST(ModelLibrary, FindsCongruentRobotsAndMakesThem) {
  const Model model = Mtran();
  const Robot robot = model.robot("quadruped");
  const Congruence answer = robot.CompareWith(model.robot("equivalent_quadruped"));
  EXPECT_TRUE(answer.congruent) << answer.reason;
  EXPECT_TRUE(answer.keeps_frame);
  EXPECT_EQ(answer.joints.size(), 18U);
  const std::vector<Robot> variants = robot.Variants(2, 7);
  ASSERT_EQ(variants.size(), 2U);
  EXPECT_TRUE(robot.CompareWith(variants[1]).congruent);
  EXPECT_EQ(variants[0].name(), "quadruped_variant_1");
}

TEST(ModelLibrary, ReadsItsBytesAndNoOthers) {
  const Model model = Mtran();
  const std::string bytes = model.Bytes();
  EXPECT_EQ(Model::FromBytes(bytes).Bytes(), bytes);
  EXPECT_NE(WhyNot([&] { (void)Model::FromBytes(bytes.substr(0, bytes.size() / 2)); }), "");
}

TEST(M3lLibrary, ThrowsTheDiagnosticsWithTheirPlaces) {
  const std::string text = "module M:\n  unit=1\n  pont a: coords=(0, 0, 0)\n";
  try {
    (void)CompileM3lText("bad.m3l", text);
    FAIL() << "it compiled";
  } catch (const TextError& error) {
    ASSERT_FALSE(error.diagnostics().empty());
    const auto found =
        std::ranges::find(error.diagnostics(), 3, [](const Diagnostic& d) { return d.where.line; });
    ASSERT_NE(found, error.diagnostics().end()) << error.what();
    EXPECT_TRUE(found->is_error);
    EXPECT_EQ(found->where.file, "bad.m3l");
    EXPECT_EQ(found->where.column, 3);
    EXPECT_NE(std::string(error.what()).find("bad.m3l:3:3: error: "), std::string::npos);
  }
  EXPECT_NE(WhyNot([] { (void)CompileM3l("/nowhere.m3l"); }), "");
  EXPECT_NE(WhyNot([&] { (void)FormatM3l("bad.m3l", "module {"); }), "");
}

TEST(M3lLibrary, FormatsAsTheCommandLineDoes) {
  const std::string once = FormatM3l("x.m3l", "module M:\n  unit=1\n");
  EXPECT_EQ(FormatM3l("x.m3l", once), once);
}

TEST(DynaRoleLibrary, TellsRolesAndParametersAndSetsThem) {
  const Model model = Mtran();
  const Program program =
      CompileDynaRole(test::SourcePath("models/programs/quadruped_tuned.dyn"), model);
  ASSERT_FALSE(program.Parameters().empty());
  const Parameter parameter = program.Parameters().front();
  const double other = std::floor((parameter.value + parameter.most) / 2);
  const Program changed = program.With(parameter.name, other);
  EXPECT_NE(changed.hash(), program.hash());
  EXPECT_NEAR(changed.Parameters().front().value, other, 1e-5);
  EXPECT_EQ(changed.Parameters().front().source_value, parameter.value);
  EXPECT_NE(WhyNot([&] { (void)program.With(parameter.name, parameter.most + 1); }), "");
  EXPECT_NE(WhyNot([&] { (void)program.With("no_such", 1); }), "");
  bool found = false;
  for (const Role& role : program.Roles()) found |= !role.extends.empty() && !role.is_abstract;
  EXPECT_TRUE(found);
  EXPECT_NE(program.Disassemble().find("load_field"), std::string::npos);
  EXPECT_EQ(Program::FromImage(program.image()).hash(), program.hash());
}

TEST(DynaRoleLibrary, RefusesDamagedImagesAndBrokenTexts) {
  const Model model = Mtran();
  const Program program = CompileDynaRole(test::SourcePath("models/programs/quadruped.dyn"), model);
  std::string image = program.image();
  image[image.size() / 2] ^= 0x55;
  EXPECT_NE(WhyNot([&] { (void)Program::FromImage(image); }).find("is damaged"), std::string::npos);
  EXPECT_NE(WhyNot([&] { (void)CompileDynaRole("/nowhere.dyn", model); }), "");
  EXPECT_THROW((void)CompileDynaRoleText("x.dyn", "role {", model), TextError);
  EXPECT_THROW((void)FormatDynaRole("x.dyn", "role {"), TextError);
}

class LogLibrary : public ::testing::Test {
 protected:
  const Log log = Log::Open(logger::walk->path);
};

TEST_F(LogLibrary, GivesEverySampleOfAJoint) {
  const logger::ModuleSeries* module = logger::walk->log->FindModule("m2");
  const JointSeries series = log.JointNamed("m2.joint_2");
  ASSERT_EQ(series.position.size(), module->sensors.size());
  ASSERT_EQ(series.time_s.size(), module->sensors.size());
  for (size_t i = 0; i < module->sensors.size(); ++i) {
    EXPECT_EQ(series.position[i], module->sensors[i].position[1]);
    EXPECT_EQ(series.velocity[i], module->sensors[i].velocity[1]);
  }
  ASSERT_EQ(series.target.size(), module->actuators.size());
  EXPECT_EQ(log.robot().name(), "quadruped");
  EXPECT_EQ(log.ModuleNames().size(), 9U);
  EXPECT_EQ(log.tick_s(), 0.02);
  EXPECT_TRUE(log.whole());
  EXPECT_EQ(log.hash(), logger::walk->log->facts.run_hash);
  EXPECT_EQ(nlohmann::json::parse(log.InfoJson())["run"], log.run());
}

TEST_F(LogLibrary, FindsJointsByRoleAndLabelUnderTheirConvention) {
  const std::vector<JointSeries> hips = log.JointsLabelled("FrontLeftUpperHalf", "hip");
  ASSERT_EQ(hips.size(), 1U);
  const JointSeries raw = log.JointNamed(hips[0].joint);
  ASSERT_FALSE(hips[0].position.empty());
  EXPECT_LT(hips[0].position.size(), raw.position.size()) << "no role was held before it was taken";
  EXPECT_EQ(std::abs(hips[0].position.back()), std::abs(raw.position.back()));
  // The roles say when it was.
  const std::string module = hips[0].joint.substr(0, 2);
  bool played = false;
  for (const RolePlayed& role : log.Roles(module)) {
    if (role.role != "FrontLeftUpperHalf") continue;
    played = true;
    EXPECT_GE(hips[0].time_s.front(), role.begin_s);
    const std::pair<std::string, std::string> hip = {"hip", hips[0].joint};
    EXPECT_NE(std::ranges::find(role.labels, hip), role.labels.end());
  }
  EXPECT_TRUE(played);
  EXPECT_NE(WhyNot([&] {
              (void)log.JointsLabelled("FrontLeftUpperHalf", "knie");
            }).find("there is no joint of that role labelled 'knie'"),
            std::string::npos);
  EXPECT_NE(WhyNot([&] { (void)log.JointsLabelled("FrontLeft", "hip"); }).find("role in the log"),
            std::string::npos);
}

TEST_F(LogLibrary, KnowsWhereLinksWereAndWhereModulesBelievedThemToBe) {
  const PoseSeries simulated = log.SimulatedPose("m1.active_block");
  const PoseSeries believed = log.PropagatedPose("m1.active_block");
  ASSERT_EQ(simulated.pose.size(), logger::walk->log->world.size());
  ASSERT_FALSE(believed.pose.empty());
  const auto X_WL = logger::SimulatedPoses(*logger::walk->log).X_WL(0, 0, 0);
  EXPECT_EQ(simulated.pose[0].position, model::NumbersOf(*X_WL).position);
  EXPECT_NE(WhyNot([&] { (void)log.SimulatedPose("m1.foot"); }), "");
  EXPECT_NE(WhyNot([&] { (void)log.Roles("m11"); }), "");
}

TEST_F(LogLibrary, SaysWhatCannotBeRead) {
  EXPECT_NE(WhyNot([] { (void)Log::Open("/nowhere.log"); }), "");
  EXPECT_NE(WhyNot([] { (void)Log::Open(logger::walk->path, {.run = "another"}); }), "");
}

}  // namespace
}  // namespace morphbus
