// What a "no" says must be true, name the joint in question and give its figures.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include "compiler/congruence/congruence.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/congruence/texts.h"

namespace morphbus::congruence {
namespace {

using test::HungModel;
using test::Named;

/// Of robots `a` and `b` of a text that uses M-TRANs.
std::string ReasonOf(const std::string& robots) {
  const model::Model model =
      test::Compiled("import \"" MORPHBUS_SOURCE_DIR "/models/mtran.m3l\"\n" + robots);
  const Congruence c = Compare(model, Named(model, "a"), model, Named(model, "b"));
  EXPECT_TRUE(c.decided);
  EXPECT_FALSE(c.congruent());
  return c.reason;
}

TEST(Reasons, NameTheBodyThatTheAttemptBeganWithAndTheDemandThatFailed) {
  // The arm sits on another face; the body of three blocks has its reference point elsewhere.
  const std::string reason = ReasonOf(
      "robot a: modules=(MTRAN leaf, MTRAN hub, MTRAN arm),"
      " connections=((hub.c2, leaf.c5), (hub.c1, arm.c5))\n"
      "robot b: modules=(MTRAN leaf, MTRAN hub, MTRAN arm),"
      " connections=((hub.c2, leaf.c5), (hub.c1, arm.c6))\n");
  EXPECT_NE(reason.find("begins with leaf.passive_block + hub.active_block + arm.passive_block"),
            std::string::npos)
      << reason;
  EXPECT_NE(reason.find("m from the reference point of"), std::string::npos) << reason;
  EXPECT_NE(reason.find("and not 0.04333"), std::string::npos) << reason;
}

TEST(Reasons, SayByHowMuchTheBodyBeyondIsElsewhereAlongTheAxis) {
  const std::string reason = ReasonOf(
      "robot a: modules=(MTRAN m1, MTRAN m2), connections=((m1.c2, m2.c5, 53))\n"
      "robot b: modules=(MTRAN m1, MTRAN m2), connections=((m1.c3, m2.c6, 37))\n");
  EXPECT_EQ(reason.find(" or "), std::string::npos) << reason;
  EXPECT_NE(reason.find("0.0325"), std::string::npos) << reason;
}

/// A bar of two sockets with hinges at the x given, all about z.
std::string Bar(const std::string& name, double x, double y) {
  return fmt::format("module {}: unit=1\n", name) + test::Socket("p", {0, 0, 0}) +
         fmt::format(
             "link l0: grouping=(p), mass=1\nlink l1: mass=1\n"
             "axis a: origin=({0}, {1}, 0), direction=(0, 0, 1)\n"
             "axis b: origin=({0}, {1}, 0), direction=(0, 0, -1)\n"
             "joint j: type=revolute, value=[-1, 1.5], pair=((l1, a), (l0, b))\n",
             x, y);
}

TEST(Reasons, SayHowFarAnAxisIsFromWhereItWouldHaveToBe) {
  // A hub of one block with hinges that point from it: one of them lies 0.25 further out.
  std::string text = "module HUB: unit=1\n" + test::Socket("a", {0, 1, 0}) +
                     test::Socket("b", {0, -1, 0}) + test::Socket("c", {3, 0, 0}) +
                     "link l: grouping=(a, b, c), mass=1\n";
  text += Bar("NEAR", 1, 0) + Bar("FAR", 1, 0.25) + test::Joining("HUB", "NEAR") +
          test::Joining("HUB", "FAR");
  text +=
      "robot a: modules=(HUB h, NEAR x, NEAR y, NEAR z),"
      " connections=((h.a, x.p), (h.b, y.p), (h.c, z.p))\n";
  text +=
      "robot b: modules=(HUB h, NEAR x, NEAR y, FAR z),"
      " connections=((h.a, x.p), (h.b, y.p), (h.c, z.p))\n";
  const model::Model model = test::Compiled(text);
  const Congruence c = Compare(model, Named(model, "a"), model, Named(model, "b"));
  EXPECT_FALSE(c.congruent());
  EXPECT_NE(c.reason.find("joint z.j"), std::string::npos) << c.reason;
  EXPECT_NE(c.reason.find("0.25 m"), std::string::npos) << c.reason;
}

TEST(Reasons, TellJointsApartThatHaveBothEndsInOneBody) {
  std::string text = "module H: unit=1\n" + test::Socket("p", {1, 0, 0}) +
                     test::Socket("q", {0, 1, 0}) + test::Socket("s", {0, 0, -1}) +
                     "link l0: grouping=(p, s), mass=1\nlink l1: grouping=(q), mass=1\n"
                     "axis a: origin=(0, 0, 0), direction=(0, 0, 1)\n"
                     "axis b: origin=(0, 0, 0), direction=(0, 0, -1)\n"
                     "joint j: type=revolute, value=[-1, 1], pair=((l1, a), (l0, b))\n";
  text += "module R: unit=1\n" + test::Socket("r1", {1, 0, 0}) + test::Socket("r2", {0, 1, 0}) +
          test::Socket("u", {1, 0, 5}) + test::Socket("v", {0, 1, 5}) +
          "link l: grouping=(r1, r2, u, v), mass=1\n";
  text += test::Joining("H", "H") + test::Joining("H", "R");
  text += "robot a: modules=(H h, R r, H k), connections=((h.p, r.r1), (h.q, r.r2), (k.p, h.s))\n";
  text +=
      "robot b: modules=(H h, H k, R r2, R r3),"
      " connections=((h.p, r2.r1), (k.p, r2.u), (h.q, r3.r2), (k.q, r3.v))\n";
  const model::Model model = test::Compiled(text);
  const Congruence c = Compare(model, Named(model, "a"), model, Named(model, "b"));
  EXPECT_FALSE(c.congruent());
  EXPECT_NE(c.reason.find("with both ends in one body"), std::string::npos) << c.reason;
}

TEST(Reasons, TakeNamesakesByNameAndNotByTheirPlaceInTheList) {
  // Copies with one connection turned, their modules declared in other orders: always one joint of
  // the module that was turned, whose body's namesake is named beside it.
  const model::Model& model = test::MtranFile();
  model::Robot robot = *model.FindRobot("quadruped");
  model::Robot changed = robot;
  changed.name = "changed";
  ++changed.dockings[0].option;
  model::Robot turned_round = changed;
  const auto last = static_cast<int>(changed.modules.size()) - 1;
  for (size_t m = 0; m < changed.modules.size(); ++m) {
    turned_round.modules[m] = changed.modules[static_cast<size_t>(last) - m];
  }
  for (model::Docking& docking : turned_round.dockings) {
    docking.module_a = last - docking.module_a;
    docking.module_b = last - docking.module_b;
  }
  turned_round.root_module = last - changed.root_module;
  for (const model::Robot* b : {&changed, &turned_round}) {
    const Congruence c = Compare(model, robot, model, *b);
    EXPECT_NE(c.reason.find("off by 90 degrees"), std::string::npos) << c.reason;
    EXPECT_NE(c.reason.find("joint m1.joint_"), std::string::npos) << c.reason;
    EXPECT_NE(c.reason.find("the nearest, m1.joint_"), std::string::npos) << c.reason;
  }
}

std::string ReasonBetween(const model::Model& a, const model::Model& b) {
  const Congruence c = Compare(a, test::Alone(a, "a"), b, test::Alone(b, "b"));
  EXPECT_TRUE(c.decided);
  EXPECT_FALSE(c.congruent());
  return c.reason;
}

TEST(Reasons, GiveBothDistancesOfAnAxis) {
  EXPECT_EQ(
      ReasonBetween(HungModel({{0, {1, 0, 0}, {0, 0, 1}, 1.0}}),
                    HungModel({{0, {1.5, 0, 0}, {0, 0, 1}, 1.0}})),
      "joint m.j1 of a has no counterpart: in the most promising attempt, which begins with "
      "m.l0 with m.l0 of b, m.j1 is tried, but its axis passes 1.5 m from the reference point "
      "of m.l0, and not 1 m as that of m.j1 from m.l0");
}

TEST(Reasons, GiveTheAngleBetweenAxesAtTheBestTurn) {
  // Both axes pass the reference points, so l0 may be turned about the first; the second is still
  // 10 degrees off. Limits keep the other ways round out.
  const auto tilted = [](double degrees) {
    const double t = degrees / 180.0 * 3.14159265358979;
    return HungModel(
        {{0, {0, 0, 0}, {0, 0, 1}, 1.5}, {0, {0, 0, 0}, {std::sin(t), 0, std::cos(t)}, 1.2}});
  };
  const std::string reason = ReasonBetween(tilted(30), tilted(40));
  EXPECT_NE(
      reason.find("m.j2 is tried, but its axis lies in m.l0 10 degrees off where that of m.j2 "
                  "lies in m.l0"),
      std::string::npos)
      << reason;
}

TEST(Reasons, SayWhatAJointLeadsTo) {
  // The further link hangs on the other of two links, whose joints are alike but lie elsewhere.
  const auto hung = [](int on) {
    return HungModel({{0, {1, 0, 0}, {0, 0, 1}, 1.0},
                      {0, {0, 3, 0}, {0, 0, 1}, 1.0},
                      {0, {0, 0, 5}, {0, 1, 0}, 1.5},
                      {on, {7, 0, 0}, {0, 1, 0}, 1.2}});
  };
  const std::string reason = ReasonBetween(hung(1), hung(2));
  EXPECT_NE(reason.find("m.j2 does, but that one leads to m.l2, which is touched by 2 joints, and "
                        "not by 1 as m.l2"),
            std::string::npos)
      << reason;
}

TEST(Reasons, SayWhereNoBodyHasAJointOfThatKind) {
  // In a row: the joint with the wide range is at the end, or next to it.
  const auto row = [](double first, double second) {
    return HungModel({{0, {1, 0, 0}, {0, 0, 1}, first},
                      {1, {2, 0, 0}, {0, 1, 0}, second},
                      {2, {3, 0, 0}, {0, 0, 1}, 1.0},
                      {3, {4, 0, 0}, {0, 1, 0}, 1.0}});
  };
  EXPECT_EQ(
      ReasonBetween(row(1.5, 1.0), row(1.0, 1.5)),
      "joint m.j1 of a has no counterpart: no body of b that is touched by 1 joint, as m.l0, has "
      "a joint that turns from -57.2958 to 85.9437 degrees");
}

}  // namespace
}  // namespace morphbus::congruence
