// What a "no" says must be true, name the joint in question and give its figures.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "compiler/congruence/congruence.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/congruence/texts.h"
#include "test/support/source_dir.h"

namespace morphbus::congruence {
namespace {

using test::HungModel;
using test::Named;

/// Of robots `a` and `b` of a text that uses M-TRANs.
std::string ReasonOf(const std::string& robots) {
  const model::Model model =
      test::Compiled("import \"" + test::SourcePath("models/mtran.m3l") + "\"\n" + robots);
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

/// Robots `a` and `b` with these modules and each with its own connections (and start values).
std::string RobotsOf(const std::string& modules, const std::string& a, const std::string& b) {
  return fmt::format(
      "robot a: modules=({0}), connections=({1})\nrobot b: modules=({0}), "
      "connections=({2})\n",
      modules, a, b);
}

/// A block with a bar on it that fixes how it is turned, and a slide along z that carries a plate
/// (R) at socket q or at socket t. All reference points lie at one height.
std::string ReasonWithPlateAt(const Eigen::Vector3d& q, const Eigen::Vector3d& t) {
  const std::string text =
      "module S: unit=1\n" + test::Socket("p", {4, 0, 0}) + test::Socket("q", q) +
      test::Socket("t", t) +
      "link l0: grouping=(p), mass=1\nlink l1: grouping=(q, t), mass=1\n"
      "axis a: origin=(0, 0, 0), direction=(0, 0, 1)\n"
      "axis b: origin=(0, 0, 0), direction=(0, 0, -1)\n"
      "joint j: type=prismatic, value=[-1, 1.5], pair=((l1, a), (l0, b))\n"
      "module R: unit=1\n" +
      test::Socket("r", {0, 0, 0}) + "link l: grouping=(r), mass=1\n" + Bar("BAR", 1, 0) +
      test::Joining("S", "BAR") + test::Joining("S", "R") +
      RobotsOf("BAR h, S s, R y", "(s.p, h.p), (s.q, y.r)", "(s.p, h.p), (s.t, y.r)");
  const model::Model model = test::Compiled(text);
  const Congruence c = Compare(model, Named(model, "a"), model, Named(model, "b"));
  EXPECT_TRUE(c.decided);
  EXPECT_FALSE(c.congruent());
  return c.reason;
}

TEST(Reasons, GiveBothDistancesApartAcrossASlide) {
  // The block's reference point is (2, 0, 0), that of the slide with the plate (0.5, 0, 0) or 0.
  const std::string reason = ReasonWithPlateAt({1, 0, 0}, {0, 0, 0});
  EXPECT_NE(reason.find("s.j does, but across its axis the reference points of h.l0 + s.l0 and "
                        "s.l1 + y.l lie 2 m apart, and not 1.5 m as those of h.l0 + s.l0 and "
                        "s.l1 + y.l"),
            std::string::npos)
      << reason;
}

TEST(Reasons, SayHowFarTheBodyBeyondASlideMissesItsPlaceAcrossIt) {
  // As far from the block on its one side as on the other.
  const std::string reason = ReasonWithPlateAt({1, 1, 0}, {1, -1, 0});
  EXPECT_NE(reason.find("s.j does, but across its axis the reference point of s.l1 + y.l lies 1 m "
                        "from where that of s.l1 + y.l does"),
            std::string::npos)
      << reason;
}

TEST(Reasons, SayHowFarAnAxisPassesBesideItsPlaceInABodyThatCanStillTurn) {
  // l1 turns without limits about z, on which its reference point lies, so its turn is open when
  // j3 is tried. That points along x, a metre above the point or a metre beside it.
  const auto hung = [](const Eigen::Vector3d& through) {
    return HungModel({{0, {0, 0, 0}, {0, 0, 1}, INFINITY, -INFINITY},
                      {0, {1, 0, 0}, {0, 0, 1}, 1.5},
                      {1, through, {1, 0, 0}, 1.2},
                      {0, {0, 2, 0}, {1, 0, 0}, 1.7}});
  };
  const std::string reason = ReasonBetween(hung({0, 0, 1}), hung({0, 1, 0}));
  EXPECT_NE(reason.find("m.j3 is tried, but its axis passes m.l1 1.41421 m beside where that of "
                        "m.j3 passes m.l1"),
            std::string::npos)
      << reason;
}

/// A hinge about z between sockets p and q, the latter turned by `turned` at value 0.
std::string HingeAboutZ(const std::string& name, double upper, double turned) {
  const double c = std::cos(turned);
  const double s = std::sin(turned);
  return fmt::format("module {}: unit=1\n", name) + test::Socket("p", {1, 0, 0}) +
         fmt::format(
             "point q: (point _1: coords=({}, {}, 0)) (point _2: coords=({}, {}, 0)) "
             "coords=({}, {}, 0), connector\n"
             "link l0: grouping=(p), mass=1\nlink l1: grouping=(q), mass=1\n"
             "axis a: origin=(0, 0, 0), direction=(0, 0, 1)\n"
             "axis b: origin=(0, 0, 0), direction=(0, 0, -1)\n"
             "joint j: type=revolute, value=[-1, {}], pair=((l1, a), (l0, b))\n",
             2 * c, 2 * s, c - 2 * s, s + 2 * c, c, s, upper);
}

TEST(Reasons, SayByHowMuchTwoBodiesAreTurnedToEachOtherOtherwise) {
  // Two hinges on one axis between the same two bodies, whose turn nothing else fixes. In b the
  // zero of the second lies 0.4 rad further, which its limits do not make up for.
  std::string text = HingeAboutZ("H", 1.5, 0.0) + HingeAboutZ("K", 1.2, 0.0) +
                     HingeAboutZ("L", 1.2, 0.4) + "module R: unit=1\n" +
                     test::Socket("r", {1, 0, 0}) + test::Socket("s", {1, 0, 5}) +
                     "link l: grouping=(r, s), mass=1\n";
  for (const char* hinge : {"H", "K", "L"}) text += test::Joining(hinge, "R");
  const std::string joined = "connections=((h.p, x.r), (h.q, y.r), (k.p, x.s), (k.q, y.s))";
  text += "robot a: modules=(H h, K k, R x, R y), " + joined + "\n";
  text += "robot b: modules=(H h, L k, R x, R y), " + joined + ", joints=(k.j=-0.4)\n";
  const model::Model model = test::Compiled(text);
  const model::Robot& a = Named(model, "a");
  EXPECT_TRUE(Compare(model, a, model, a).congruent());
  const Congruence c = Compare(model, a, model, Named(model, "b"));
  EXPECT_FALSE(c.congruent());
  EXPECT_NE(c.reason.find("k.j is tried, but when both stand alike, "), std::string::npos)
      << c.reason;
  EXPECT_NE(c.reason.find(" is turned about the axis 22.9183 degrees further than "),
            std::string::npos)
      << c.reason;
}

TEST(Reasons, SayWhichBodiesAJointWouldHaveToJoin) {
  // A hub with four arms that all reach back to its middle, where k joins the first two of them in
  // a, the first and the third in b; m joins the others.
  std::string text =
      "module X: unit=1\n" + test::Socket("a1", {4, 0, 0}) + test::Socket("a2", {1, 4, 0}) +
      test::Socket("a3", {-4, 0, 0}) + test::Socket("a4", {1, -7, 0}) +
      "link l: grouping=(a1, a2, a3, a4), mass=1\n"
      "module ARM: unit=1\n" +
      test::Socket("p", {1, 0, 0}) + test::Socket("t1", {-2, 0, 0}) +
      test::Socket("t2", {1, -4, 0}) + test::Socket("t3", {6, 0, 0}) +
      test::Socket("t4", {1, 7, 0}) +
      "link l0: grouping=(p), mass=1\n"
      "link l1: grouping=(t1, t2, t3, t4), mass=1\n"
      "axis a: origin=(0, 0, 0), direction=(0, 0, 1)\n"
      "axis b: origin=(0, 0, 0), direction=(0, 0, -1)\n"
      "joint j: type=revolute, value=[-1, 1.7], pair=((l1, a), (l0, b))\n" +
      HingeAboutZ("K", 1.5, 0.0) + HingeAboutZ("M", 1.2, 0.0) + test::Joining("X", "ARM") +
      test::Joining("ARM", "K") + test::Joining("ARM", "M");
  const std::string arms = "(x.a1, u1.p), (x.a2, u2.p), (x.a3, u3.p), (x.a4, u4.p), (u1.t1, k.p), ";
  text += RobotsOf("X x, ARM u1, ARM u2, ARM u3, ARM u4, K k, M m",
                   arms + "(u2.t2, k.q), (u3.t3, m.p), (u4.t4, m.q)",
                   arms + "(u3.t3, k.q), (u2.t2, m.p), (u4.t4, m.q)");
  const model::Model model = test::Compiled(text);
  const Congruence c = Compare(model, Named(model, "a"), model, Named(model, "b"));
  EXPECT_FALSE(c.congruent());
  EXPECT_NE(c.reason.find("k.j does, but that one leads to u3.l1 + k.l1, and u2.l1 + k.l1 is "
                          "matched with u2.l1 + m.l0"),
            std::string::npos)
      << c.reason;
}

}  // namespace
}  // namespace morphbus::congruence
