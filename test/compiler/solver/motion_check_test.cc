#include "compiler/solver/motion_check.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compiler/m3l/compile.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/solver/hull_overlap.h"
#include "test/compiler/solver/known_modules.h"
#include "test/support/source_dir.h"

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

/// Two carriages that meet only where a's is at its upper limit and b's at its lower one.
constexpr const char* kRails = R"(
module LEFT:
point foot: coords=(0,0,0), connector, normal=(1,0,0)
link base: grouping=(foot), hull=box(size=(1,1,1), at=(-.5,0,0))
link carriage: hull=box(size=(.25,.5,.5), at=(-1.075,.85,0))
axis out: origin=(0,0,0), direction=(1,0,0)
axis in: origin=(0,0,0), direction=(-1,0,0)
axis up: origin=(0,0,0), direction=(0,1,0)
joint rail: type=prismatic, value=[0,1], pair=((carriage,out),(base,in))

module RIGHT:
point foot: coords=(0,0,0), connector, normal=(-1,0,0)
link base: grouping=(foot), hull=box(size=(1,1,1), at=(.5,0,0))
link carriage: hull=box(size=(.25,.5,.5), at=(1.075,.85,0))
axis out: origin=(0,0,0), direction=(1,0,0)
axis in: origin=(0,0,0), direction=(-1,0,0)
axis up: origin=(0,0,0), direction=(0,1,0)
joint rail: type=prismatic, value=[-1,0], pair=((carriage,out),(base,in))

connection HOLD: members=(LEFT a, RIGHT b), conditions=(
  a.point p coincident b.point q and p antiparallel q and a.up parallel b.up)
robot rails: modules=(LEFT a, RIGHT b), connections=((a.foot,b.foot))
)";

/// A triangle of corners, whose hinges it locks where its sides, at right angles in a corner's own
/// frame, stand at 60 degrees; on each corner a long flap that can turn. The chain is open.
constexpr const char* kTriangle = R"(
module CORNER:
point head: coords=(1,0,0), connector, normal=(1,0,0), side=1
point tail: coords=(0,1,0), connector, normal=(0,1,0), side=2
link a: grouping=(head), hull=box(size=(.8,.1,.1), at=(.6,0,0))
link b: grouping=(tail), hull=box(size=(.1,.8,.1), at=(0,.6,0))
link flap: hull=box(size=(.1,2.2,.1), at=(.5,-1.3,0))
axis out: origin=(0,0,0), direction=(0,0,1)
axis in: origin=(0,0,0), direction=(0,0,-1)
axis flap_out: origin=(.5,-.2,0), direction=(0,0,1)
axis flap_in: origin=(.5,-.2,0), direction=(0,0,-1)
joint hinge: type=revolute, value=[-pi/2,pi/2], pair=((a,out),(b,in))
joint turn: type=revolute, value=[-pi,pi], pair=((flap,flap_out),(a,flap_in))

connection HOLD: members=(CORNER a, CORNER b), conditions=(
  a.point p coincident b.point q and p antiparallel q and a.out parallel b.out
  and p.side==2 and q.side==1)
robot triangle: modules=(CORNER c1, CORNER c2, CORNER c3),
  connections=((c1.tail,c2.head), (c2.tail,c3.head), (c3.tail,c1.head)),
  joints=(c1.hinge=pi/6, c2.hinge=pi/6, c3.hinge=pi/6)
robot chain: modules=(CORNER c1, CORNER c2, CORNER c3),
  connections=((c1.tail,c2.head), (c2.tail,c3.head)),
  joints=(c1.hinge=pi/6, c2.hinge=pi/6, c3.hinge=pi/6)
)";

/// The model that came out; an empty one, and a failure, if there is none.
model::Model ModelOf(const m3l::CompileOutput& output) {
  EXPECT_TRUE(output.model.has_value())
      << source::Render(output.diagnostics, output.sources, false);
  return output.model.value_or(model::Model());
}

model::Model Compiled(const std::string& text) {
  return ModelOf(m3l::CompileText("motion_test.m3l", text));
}

/// A file of models/.
model::Model Shipped(const std::string& name) {
  return ModelOf(m3l::CompileFiles({test::SourcePath("models/" + name)}));
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

/// Holds each posture of a report against another route: the forward kinematics of the whole robot,
/// and the depth from the points of the hulls. Returns how many postures there were.
int ExpectAgreesWithForwardKinematics(const model::Model& model, const model::Robot& robot,
                                      const MotionReport& report) {
  int compared = 0;
  for (const MeetingsOfDockings& alike : report.meetings) {
    for (const int d : alike.dockings) {
      const int a = robot.dockings[d].module_a;
      const int b = robot.dockings[d].module_b;
      for (const LinkMeeting& meeting : alike.links) {
        for (const MeetingPosture& posture : {meeting.first, meeting.deepest}) {
          model::JointValues q = model::StartValues(robot);
          for (size_t i = 0; i < meeting.joints.size(); ++i) {
            q[meeting.joints[i].of_a ? a : b][meeting.joints[i].joint] = posture.values[i];
          }
          const model::KinematicState state = model::ForwardKinematics(model, robot, q);
          EXPECT_GT(posture.depth_m, 0.0);
          EXPECT_NEAR(PenetrationDepth(model.TypeOf(robot, a).links[meeting.link_a].hull,
                                       state.X_RL[a][meeting.link_a],
                                       model.TypeOf(robot, b).links[meeting.link_b].hull,
                                       state.X_RL[b][meeting.link_b]),
                      posture.depth_m, 1e-12);
          ++compared;
        }
      }
    }
  }
  return compared;
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
  // One half of the postures is spread evenly over the range, of the other half a quarter is at the
  // upper limit and a half is spread evenly; to some five deviations.
  const double share = (M_PI / 3 - kContact) / (M_PI / 3 + 1.0);
  EXPECT_NEAR(meeting.num_postures / 1000.0, 0.5 * share + 0.5 * (0.25 + 0.5 * share), 0.07);
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
  // Two joints have four corners: both lower, both upper, then the mixed ones. Nothing of them is
  // random, so that any seed will do.
  const model::Model model = Compiled(kRails);
  EXPECT_TRUE(Check(model, "rails", 3).meetings.empty());
  for (const uint64_t seed : {1, 2}) {
    const MotionReport report = Check(model, "rails", 4, seed);
    ASSERT_EQ(report.meetings.size(), 1u);
    ASSERT_EQ(report.meetings[0].links.size(), 1u);
    const LinkMeeting& meeting = report.meetings[0].links[0];
    EXPECT_EQ(meeting.num_postures, 1);
    EXPECT_EQ(meeting.first.values, (std::vector<double>{1.0, -1.0}));
    EXPECT_EQ(meeting.deepest.values, meeting.first.values);
    // The carriages' faces start 1.9 apart.
    EXPECT_NEAR(meeting.deepest.depth_m, 0.1, 1e-12);
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
  // The crawler's legs meet its spine in few postures, of four joints each, and so do the modules
  // of its spine.
  const model::Model model = Shipped("mtran_robots.m3l");
  const model::Robot& robot = *model.FindRobot("crawler");
  const MotionReport report = CheckMotion(model, robot, {1000, 1});
  ASSERT_EQ(report.meetings.size(), 5u);
  for (const MeetingsOfDockings& alike : report.meetings) {
    EXPECT_EQ(alike.links[0].joints.size(), 4u);
  }
  EXPECT_EQ(ExpectAgreesWithForwardKinematics(model, robot, report), 6 * 2);
}

TEST(CheckMotion, FindsWhatMeetsOnlyNearLimitsOfSomeJoints) {
  // M-TRAN's far blocks meet where the two joints between them are at their limits and the two
  // outer ones are not: in one of 1000 postures that are spread evenly.
  const model::Model model = test::MtranModel();
  const model::Robot robot = test::Assemble(model, "pair", 2, {{"m1", "c2", "m2", "c5", {}}}, 0, 0,
                                            model::Pose::Identity());
  for (const uint64_t seed : {1, 2, 3, 4, 5}) {
    const MotionReport report = CheckMotion(model, robot, {1000, seed});
    ASSERT_EQ(report.meetings.size(), 1u) << seed;
    EXPECT_GT(report.meetings[0].links[0].num_postures, 3) << seed;
  }
}

TEST(CheckMotion, TellsOfEachDockingWhatARobotOfItAloneTells) {
  // Results are kept by kind of docking, and must not depend on what else there is.
  const model::Model model = Shipped("mtran_robots.m3l");
  const model::Robot& robot = *model.FindRobot("crawler");
  const MotionReport all = CheckMotion(model, robot, {1000, 3});
  std::vector<const MeetingsOfDockings*> of_docking(robot.dockings.size());
  for (const MeetingsOfDockings& alike : all.meetings) {
    for (const int d : alike.dockings) of_docking[d] = &alike;
  }
  int64_t link_pairs = 0;
  for (size_t d = 0; d < robot.dockings.size(); ++d) {
    model::Robot pair = robot;
    pair.dockings = {robot.dockings[d]};
    const MotionReport alone = CheckMotion(model, pair, {1000, 3});
    link_pairs += alone.num_link_pairs;
    ASSERT_EQ(alone.meetings.empty(), of_docking[d] == nullptr) << d;
    if (alone.meetings.empty()) continue;
    ASSERT_EQ(alone.meetings[0].links.size(), of_docking[d]->links.size());
    for (size_t i = 0; i < of_docking[d]->links.size(); ++i) {
      ExpectSame(alone.meetings[0].links[i], of_docking[d]->links[i]);
    }
  }
  EXPECT_EQ(all.num_link_pairs, link_pairs);
  EXPECT_EQ(link_pairs, 6 * 8) << "nine pairs of links less the mated ones";
}

TEST(CheckMotion, LooksAtDockingsOfOneKindOnce) {
  // The halves of a Molecube, whose cut is a hexagon, stand out of the cube while they turn.
  const model::Model model = Shipped("molecube.m3l");
  const MotionReport report = Check(model, "snake");
  EXPECT_EQ(report.num_kinds, 1);
  EXPECT_EQ(report.num_link_pairs, 3 * 3);
  ASSERT_EQ(report.meetings.size(), 1u);
  EXPECT_EQ(report.meetings[0].dockings, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(Check(model, "arm").num_kinds, 3);
}

TEST(CheckMotion, KeepsJointsThatLoopsLockAtTheirStartValues) {
  const model::Model model = Compiled(kTriangle);
  constexpr int kHinge = 0;
  // How many postures have a hinge at, and how many away from its start value.
  const auto count_hinges = [](const MotionReport& report) {
    std::pair<int, int> counts;
    for (const MeetingsOfDockings& alike : report.meetings) {
      for (const LinkMeeting& meeting : alike.links) {
        for (size_t i = 0; i < meeting.joints.size(); ++i) {
          if (meeting.joints[i].joint != kHinge) continue;
          ++(std::abs(meeting.deepest.values[i] - M_PI / 6) < 1e-12 ? counts.first : counts.second);
        }
      }
    }
    return counts;
  };
  const MotionReport chain = Check(model, "chain");
  EXPECT_EQ(chain.num_loops, 0);
  EXPECT_GT(count_hinges(chain).second, 0);
  const MotionReport triangle = Check(model, "triangle");
  EXPECT_EQ(triangle.num_loops, 1);
  EXPECT_EQ(triangle.num_locked, 3);
  EXPECT_EQ(triangle.num_kinds, 1);
  EXPECT_GT(count_hinges(triangle).first, 0);
  EXPECT_EQ(count_hinges(triangle).second, 0);
  EXPECT_GT(ExpectAgreesWithForwardKinematics(model, *model.FindRobot("triangle"), triangle), 0);
  // Of the nine pairs of a docking one is mated; of the others those of the sides cannot move.
  EXPECT_EQ(triangle.num_link_pairs, 3 * 5);
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
  EXPECT_GT(bounded.work, 0.5e6);
  // At most the pair of hulls that was being compared lies beyond the bound.
  EXPECT_LT(bounded.work, 1.01e6);
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
