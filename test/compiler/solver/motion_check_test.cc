#include "compiler/solver/motion_check.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compiler/m3l/compile.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/solver/hull_overlap.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::solver {
namespace {

/// A flap that turns about the origin, 3 long and 0.4 thick, on a base whose end at x = 2 sits on a
/// wall: the flap's corner (0.2, 3) reaches the wall when turned by kContact towards it.
constexpr const char* kFlapAndWall = R"(
module FLAP:
point foot: coords=(2,-.5,0), connector, normal=(1,0,0)
link base: grouping=(foot), hull=box(size=(3,1,1), at=(.5,-.5,0))
link flap: hull=box(size=(.4,2.8,1), at=(0,1.6,0))
axis out: origin=(0,0,0), direction=(0,0,1)
axis in: origin=(0,0,0), direction=(0,0,-1)
joint hinge: type=revolute, value=[{},{}], pair=((flap,in),(base,out))

module WALL:
point foot: coords=(0,0,0), connector, normal=(-1,0,0)
link wall: grouping=(foot), hull=box(size=(1,5,1), at=(.5,2,0))
axis out: origin=(0,0,0), direction=(0,0,1)

connection HOLD: members=(FLAP a, WALL b), conditions=(
  a.point p coincident b.point q and p antiparallel q and a.out parallel b.out)
robot gate: modules=(FLAP f, WALL w), connections=((f.foot,w.foot)){}
)";
// 0.2 cos t + 3 sin t = 2.
const double kContact = std::asin(2.0 / std::hypot(0.2, 3.0)) - std::atan2(0.2, 3.0);

model::Model Compiled(const std::string& text) {
  const m3l::CompileOutput output = m3l::CompileText("motion_test.m3l", text);
  EXPECT_TRUE(output.model.has_value())
      << source::Render(output.diagnostics, output.sources, false);
  return output.model.value_or(model::Model());
}

model::Model Gate(double lower, double upper, const std::string& more = "") {
  return Compiled(fmt::format(fmt::runtime(kFlapAndWall), lower, upper, more));
}

MotionReport Check(const model::Model& model, const std::string& robot, int postures = 1000,
                   uint64_t seed = 1) {
  return CheckMotion(model, *model.FindRobot(robot), {postures, seed});
}

/// All that a report says of two links, apart from the modules' names.
void ExpectSame(const LinkMeeting& a, const LinkMeeting& b) {
  EXPECT_EQ(a.link_a, b.link_a);
  EXPECT_EQ(a.link_b, b.link_b);
  EXPECT_EQ(a.num_postures, b.num_postures);
  for (const auto part : {&LinkMeeting::first, &LinkMeeting::deepest}) {
    EXPECT_EQ((a.*part).depth_m, (b.*part).depth_m);
    EXPECT_EQ((a.*part).values, (b.*part).values);
  }
}

TEST(CheckMotion, FindsThatABoxOnAHingeMeetsAWallBeyondItsAngle) {
  const MotionReport report = Check(Gate(-1.0, M_PI / 3), "gate");
  EXPECT_EQ(report.postures, 1000);
  EXPECT_EQ(report.num_link_pairs, 1) << "the base is mated with the wall";
  ASSERT_EQ(report.meetings.size(), 1u);
  ASSERT_EQ(report.meetings[0].links.size(), 1u);
  const LinkMeeting& meeting = report.meetings[0].links[0];
  EXPECT_EQ(meeting.link_a, 1);
  EXPECT_EQ(meeting.link_b, 0);
  ASSERT_EQ(meeting.joints.size(), 1u);
  EXPECT_TRUE(meeting.joints[0].of_a);
  // The deepest is at the upper limit, which is one of the corners: how far the flap's corner is
  // behind the wall's face.
  EXPECT_EQ(meeting.deepest.values[0], M_PI / 3);
  EXPECT_NEAR(meeting.deepest.depth_m, 0.2 * 0.5 + 3.0 * std::sqrt(0.75) - 2.0, 1e-12);
  EXPECT_GT(meeting.first.values[0], kContact);
  // The share of the range in which they meet is that of the postures, to some five deviations.
  const double share = (M_PI / 3 - kContact) / (M_PI / 3 + 1.0);
  EXPECT_NEAR(meeting.num_postures / 1000.0, share, 0.07);
}

TEST(CheckMotion, FindsNothingBelowTheAngle) {
  const MotionReport report = Check(Gate(-1.0, kContact - 1e-3), "gate");
  EXPECT_EQ(report.postures, 1000);
  EXPECT_TRUE(report.meetings.empty());
}

TEST(CheckMotion, TriesTheLimitsAndTheStartValuesBeforeAnythingElse) {
  // Only the last of three postures meets: the upper limit.
  const model::Model upper = Gate(-1.0, kContact + 1e-3);
  EXPECT_TRUE(Check(upper, "gate", 2).meetings.empty());
  ASSERT_EQ(Check(upper, "gate", 3).meetings.size(), 1u);
  EXPECT_EQ(Check(upper, "gate", 3).meetings[0].links[0].num_postures, 1);
  // The start value alone is the first one.
  const model::Model start = Gate(-1.0, 1.2, ", joints=(f.hinge=1.1)");
  const MotionReport report = Check(start, "gate", 1);
  ASSERT_EQ(report.meetings.size(), 1u);
  EXPECT_EQ(report.meetings[0].links[0].first.values, std::vector<double>{1.1});
}

TEST(CheckMotion, TriesEveryCornerOfAFewRanges) {
  // Four joints lie between the blocks of two M-TRAN modules in a row: all ends of their ranges are
  // 16 corners, of which the mixed ones come behind the first three postures.
  const model::Model model = test::MtranModel();
  const model::Robot robot = test::Assemble(model, "pair", 2, {{"m1", "c1", "m2", "c5", {}}}, 0, 0,
                                            model::Pose::Identity());
  // Seeds do not matter in the first 17 postures: nothing is random yet.
  const MotionReport one = CheckMotion(model, robot, {17, 1});
  const MotionReport two = CheckMotion(model, robot, {17, 2});
  ASSERT_FALSE(one.meetings.empty());
  ASSERT_EQ(one.meetings[0].links.size(), two.meetings[0].links.size());
  for (size_t i = 0; i < one.meetings[0].links.size(); ++i) {
    ExpectSame(one.meetings[0].links[i], two.meetings[0].links[i]);
  }
  for (const LinkMeeting& meeting : one.meetings[0].links) {
    for (const double value : meeting.deepest.values) {
      EXPECT_TRUE(value == 0.0 || std::abs(value) == M_PI / 2) << value;
    }
  }
}

TEST(CheckMotion, IsTheSameForASeedAndAnotherForAnother) {
  const model::Model model = Gate(-1.0, M_PI / 3);
  const MotionReport report = Check(model, "gate", 200, 7);
  ExpectSame(report.meetings[0].links[0], Check(model, "gate", 200, 7).meetings[0].links[0]);
  EXPECT_NE(report.meetings[0].links[0].num_postures,
            Check(model, "gate", 200, 8).meetings[0].links[0].num_postures);
  // More postures are those of before, and more.
  const LinkMeeting more = Check(model, "gate", 400, 7).meetings[0].links[0];
  EXPECT_EQ(more.first.values, report.meetings[0].links[0].first.values);
  EXPECT_GT(more.num_postures, report.meetings[0].links[0].num_postures);
}

TEST(CheckMotion, AgreesWithForwardKinematicsOfTheRobot) {
  // By another route: the whole robot in the deepest posture, and the depth from the points.
  const model::Model model = test::MtranModel(0.0325);
  const model::Robot robot = test::Quadruped(model, 0.0325);
  const MotionReport report = CheckMotion(model, robot, {300, 1});
  ASSERT_FALSE(report.meetings.empty());
  int compared = 0;
  for (const MeetingsOfDockings& alike : report.meetings) {
    for (const int d : alike.dockings) {
      for (const LinkMeeting& meeting : alike.links) {
        // Of the robot only these two modules, so that no loop is in the way.
        model::Robot pair = robot;
        pair.dockings = {robot.dockings[d]};
        model::JointValues q = model::StartValues(robot);
        const int a = robot.dockings[d].module_a;
        const int b = robot.dockings[d].module_b;
        for (size_t i = 0; i < meeting.joints.size(); ++i) {
          q[meeting.joints[i].of_a ? a : b][meeting.joints[i].joint] = meeting.deepest.values[i];
        }
        pair.root_module = a;
        const model::KinematicState state = model::ForwardKinematics(model, pair, q);
        const model::ModuleType& type = model.module_types[0];
        EXPECT_NEAR(
            PenetrationDepth(type.links[meeting.link_a].hull, state.X_RL[a][meeting.link_a],
                             type.links[meeting.link_b].hull, state.X_RL[b][meeting.link_b]),
            meeting.deepest.depth_m, 1e-12);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 5);
}

TEST(CheckMotion, TellsOfEachDockingWhatARobotOfItAloneTells) {
  // Results are kept by kind of docking: nine modules in a row, all joined alike but for one.
  const model::Model model = test::MtranModel();
  std::vector<test::Mating> matings;
  for (int i = 1; i < 9; ++i) {
    const std::string a = "m" + std::to_string(i);
    const std::string b = "m" + std::to_string(i + 1);
    matings.push_back({a, i == 4 ? "c1" : "c2", b, "c5", {}});
  }
  const auto assembled = [&](int count, const std::vector<test::Mating>& some) {
    return test::Assemble(model, "row", count, some, 0, 0, model::Pose::Identity());
  };
  const MotionReport all = CheckMotion(model, assembled(9, matings), {300, 3});
  EXPECT_EQ(all.num_kinds, 2);
  EXPECT_EQ(all.num_link_pairs, 8 * 8) << "nine pairs of links less the mated ones";
  ASSERT_EQ(all.meetings.size(), 2u);
  EXPECT_EQ(all.meetings[0].dockings.size() + all.meetings[1].dockings.size(), 8u);
  for (const MeetingsOfDockings& alike : all.meetings) {
    const std::string connector = alike.dockings.size() == 1 ? "c1" : "c2";
    const MotionReport alone =
        CheckMotion(model, assembled(2, {{"m1", connector, "m2", "c5", {}}}), {300, 3});
    ASSERT_EQ(alone.meetings.size(), 1u);
    ASSERT_EQ(alone.meetings[0].links.size(), alike.links.size());
    for (size_t i = 0; i < alike.links.size(); ++i) {
      ExpectSame(alone.meetings[0].links[i], alike.links[i]);
    }
  }
}

TEST(CheckMotion, TellsApartDockingsThatStartInEachOther) {
  // Of one kind: one flap starts in the wall, the other meets it at the limit only.
  // Two gates side by side are no robot of M3L, so they are put together here.
  const model::Model model = Gate(-1.0, 1.01);
  model::Robot robot = model.robots[0];
  robot.modules = {robot.modules[0], robot.modules[1], robot.modules[0], robot.modules[1]};
  robot.modules[0].start = {1.0};
  robot.dockings.push_back(robot.dockings[0]);
  robot.dockings[1].module_a = 2;
  robot.dockings[1].module_b = 3;
  const MotionReport report = CheckMotion(model, robot, {3, 1});
  EXPECT_EQ(report.num_kinds, 1);
  ASSERT_EQ(report.meetings.size(), 2u);
  EXPECT_EQ(report.meetings[0].links[0].first.values, std::vector<double>{1.0});
  EXPECT_EQ(report.meetings[0].links[0].num_postures, 2);
  EXPECT_EQ(report.meetings[1].links[0].first.values, std::vector<double>{1.01});
  EXPECT_EQ(report.meetings[1].links[0].num_postures, 1);
}

TEST(CheckMotion, LeavesOutLinksThatAreRigidWithEachOther) {
  // A fixed joint makes the pole a part of the base, which is mated with the wall.
  std::string text = fmt::format(fmt::runtime(kFlapAndWall), -1.0, 0.5, "");
  const std::string pole =
      "link pole: hull=box(size=(.4,.4,.4), at=(0,-1.5,0))\n"
      "joint weld: type=fixed, pair=((pole,out),(base,in))\n\nmodule WALL:";
  text.replace(text.find("module WALL:"), 12, pole);
  const model::Model model = Compiled(text);
  ASSERT_EQ(model.module_types[0].links.size(), 3u);
  EXPECT_EQ(Check(model, "gate").num_link_pairs, 1);
}

TEST(CheckMotion, LeavesOutLinksThatAnotherDockingHoldsTogether) {
  // Two M-TRAN modules side by side, joined at both blocks: of nine pairs of links two are mated.
  const model::Model model = test::MtranModel();
  const model::Robot robot =
      test::Assemble(model, "raft", 2, {{"m1", "c1", "m2", "c4", {}}, {"m1", "c6", "m2", "c3", {}}},
                     0, 0, model::Pose::Identity());
  const MotionReport report = CheckMotion(model, robot, {10, 1});
  EXPECT_EQ(report.num_link_pairs, 2 * 7);
  EXPECT_EQ(report.num_loops, 1);
}

TEST(CheckMotion, TriesAWholeTurnOfAJointWithoutLimits) {
  std::string text = fmt::format(fmt::runtime(kFlapAndWall), 0.0, 0.0, "");
  const std::string limited = "type=revolute, value=[0,0]";
  ASSERT_NE(text.find(limited), std::string::npos);
  text.replace(text.find(limited), limited.size(), "type=continuous");
  const MotionReport report = Check(Compiled(text), "gate", 2000);
  ASSERT_EQ(report.meetings.size(), 1u);
  const LinkMeeting& meeting = report.meetings[0].links[0];
  // Where the flap points at the wall it lies in it by the wall's whole thickness.
  EXPECT_NEAR(meeting.deepest.depth_m, 1.0, 0.01);
  EXPECT_NEAR(meeting.deepest.values[0], M_PI / 2, 0.3);
}

TEST(CheckMotion, EndsWithFewerPosturesWhereTheWorkIsBounded) {
  const model::Model model = test::MtranModel();
  const model::Robot robot = test::Quadruped(model);
  MotionOptions options;
  options.postures = 1000;
  options.max_work = 1e6;
  const MotionReport bounded = CheckMotion(model, robot, options);
  ASSERT_GT(bounded.postures, 1);
  ASSERT_LT(bounded.postures, 1000);
  // What is told is what so many postures tell.
  const MotionReport asked = CheckMotion(model, robot, {bounded.postures, 1});
  ASSERT_EQ(bounded.meetings.size(), asked.meetings.size());
  for (size_t g = 0; g < asked.meetings.size(); ++g) {
    ASSERT_EQ(bounded.meetings[g].links.size(), asked.meetings[g].links.size());
    for (size_t i = 0; i < asked.meetings[g].links.size(); ++i) {
      ExpectSame(bounded.meetings[g].links[i], asked.meetings[g].links[i]);
    }
  }
  options.max_work = 1.0;
  const MotionReport none = CheckMotion(model, robot, options);
  EXPECT_EQ(none.postures, 0);
  EXPECT_TRUE(none.meetings.empty());
}

}  // namespace
}  // namespace morphbus::solver
