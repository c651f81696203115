// Limits and values: what loops lock, limits that agree within their tolerance, offsets.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compiler/congruence/congruence.h"
#include "test/compiler/congruence/assemblies.h"
#include "test/compiler/congruence/texts.h"

namespace morphbus::congruence {
namespace {

using Eigen::Vector3d;
using test::Named;

/// A triangle of hinges with sides 3, 4, 5, bent to the left or to the right, and a leg on two of
/// its bars. It is rigid.
model::Model Triangles() {
  std::string text;
  for (const auto& [name, side] : {std::pair("A", 3.0), {"B", 4.0}, {"C", 5.0}}) {
    text += fmt::format("module {}: unit=0.1\n", name);
    text += test::Socket("p", {0, 0, 0}) + test::Socket("q", {side, 0, 0});
    text += test::Socket("top", {1, 0.3, 1});
    text += fmt::format(
        "link l0: grouping=(p, top), mass=1\nlink l1: grouping=(q), mass=1\n"
        "axis a: origin=({0}, 0, 0), direction=(0, 0, 1)\n"
        "axis b: origin=({0}, 0, 0), direction=(0, 0, -1)\n"
        "joint j: type=revolute, value=[-3, 3], pair=((l1, a), (l0, b))\n",
        side);
  }
  text += "module LEG: unit=0.1\n" + test::Socket("h", {0, 0, 0}) +
          "link l0: grouping=(h), mass=1\nlink l1: (point e: coords=(0, 0, 1)) mass=1\n"
          "axis a: origin=(0, .5, 0), direction=(1, 0, 0)\n"
          "axis b: origin=(0, .5, 0), direction=(-1, 0, 0)\n"
          "joint j: type=revolute, value=[-1, .5], pair=((l1, a), (l0, b))\n";
  text += test::Joining("A", "B") + test::Joining("B", "C") + test::Joining("C", "A") +
          test::Joining("A", "LEG") + test::Joining("B", "LEG");
  for (const double side : {1.0, -1.0}) {
    text += fmt::format(
        "robot {}: modules=(A a, B b, C c, LEG x, LEG y), connections=((a.q, b.p), (b.q, c.p), "
        "(c.q, a.p), (a.top, x.h), (b.top, y.h)), joints=(a.j={}, b.j={}, c.j={})\n",
        side > 0.0 ? "left" : "right", side * M_PI / 2, side * (M_PI - std::atan2(3, 4)),
        side * (M_PI - std::atan2(4, 3)));
  }
  return test::Compiled(text);
}

TEST(Locked, LoopsThatStandOtherwiseAreNotCongruent) {
  const model::Model model = Triangles();
  const model::Robot& left = Named(model, "left");
  const model::Robot& right = Named(model, "right");
  EXPECT_EQ(Compare(model, left, model, left).count, 1);
  EXPECT_EQ(Compare(model, right, model, right).count, 1);
  const Congruence c = Compare(model, left, model, right);
  EXPECT_TRUE(c.decided);
  EXPECT_FALSE(c.congruent());
  EXPECT_NE(c.reason.find("loops lock both, and it stands at -"), std::string::npos) << c.reason;
  // Their joints alone: the leg's axes would be elsewhere, so it is the value that tells.
  EXPECT_NE(c.reason.find("joint b.j of left"), std::string::npos) << c.reason;
}

/// A hinge between two sockets; at value 0 socket q is turned by `turned` from where it is in
/// others.
std::string Hinge(const std::string& name, const std::string& range, double turned) {
  const auto at = [&](double x, double y) {
    const double c = std::cos(turned);
    const double s = std::sin(turned);
    return fmt::format("({}, {}, 0)", c * x - s * y, s * x + c * y);
  };
  return fmt::format(
      "module {0}: unit=1\n{1}"
      "point q: (point _1: coords={2}) (point _2: coords={3}) coords={4}, connector\n"
      "link l0: grouping=(p), mass=1\nlink l1: grouping=(q), mass=1\n"
      "axis a: origin=(0, 0, 0), direction=(0, 0, 1)\n"
      "axis b: origin=(0, 0, 0), direction=(0, 0, -1)\n"
      "joint j: type=revolute, value={5}, pair=((l1, a), (l0, b))\n",
      name, test::Socket("p", {1, 0, 0}), at(2, 0), at(1, 2), at(1, 0), range);
}

/// Robots r0, r1, ...: a hinge of each kind with a body on either side of its axis.
model::Model Hinges(const std::vector<std::string>& hinges) {
  std::string text =
      "module R: unit=1\n" + test::Socket("r", {0, 0, 0}) + "link l: grouping=(r), mass=1\n";
  for (size_t i = 0; i < hinges.size(); ++i) {
    const std::string name = fmt::format("H{}", i);
    text +=
        hinges[i] + test::Joining(name, "R") +
        fmt::format("robot r{}: modules=({} h, R x, R y), connections=((h.p, x.r), (h.q, y.r))\n",
                    i, name);
  }
  return test::Compiled(text);
}

TEST(Limits, AgreeWithinTheirToleranceWhateverTheOffset) {
  // From 0 to 1.5708 and from -pi/4 to pi/4, the zero an eighth of a turn further: 4e-6 rad apart.
  const model::Model model =
      Hinges({Hinge("H0", "[0, 1.5708]", 0.0), Hinge("H1", "[-pi/4, pi/4]", M_PI / 4),
              Hinge("H2", "[-pi/4, pi/4]", M_PI / 4 + 1e-3)});
  const model::Robot& a = Named(model, "r0");
  const Congruence c = Compare(model, a, model, Named(model, "r1"));
  ASSERT_EQ(c.count, 2) << c.reason;
  for (const Mapping& mapping : c.mappings) {
    // What the places say, to the last digit, not what the limits say.
    EXPECT_NEAR(std::abs(mapping.joints[0].offset), M_PI / 4, 1e-9);
    test::ExpectSameMotion(model, a, model, Named(model, "r1"), c, mapping, 1);
  }
  const Congruence further = Compare(model, a, model, Named(model, "r2"));
  EXPECT_FALSE(further.congruent());
  EXPECT_NE(further.reason.find("its limits map onto those of h.j with an offset of"),
            std::string::npos)
      << further.reason;
}

/// A slide of `unit` metres a unit along x with this range.
model::Model Slide(double unit, const std::string& range) {
  return test::Compiled(fmt::format("module S: unit={}\n", unit) + test::Socket("p", {1, 0, 0}) +
                        fmt::format("link l0: grouping=(p), mass=1\nlink l1: mass=1\n"
                                    "axis a: origin=(0, 0, 0), direction=(1, 0, 0)\n"
                                    "axis b: origin=(0, 0, 0), direction=(-1, 0, 0)\n"
                                    "joint j: type=prismatic, value={}, pair=((l1, a), (l0, b))\n"
                                    "robot s: modules=(S m)\n",
                                    range));
}

TEST(Limits, OfSlidesAgreeWithinAPartOfTheModulesSizeWhateverTheUnit) {
  for (const double unit : {1e-3, 1.0, 100.0}) {
    SCOPED_TRACE(unit);
    const model::Model a = Slide(unit, "[0, 0.5]");
    const model::Model same = Slide(unit, "[0, 0.50005]");
    const model::Model other = Slide(unit, "[0, 0.5005]");
    const auto compare = [&](const model::Model& b) {
      return Compare(a, Named(a, "s"), b, Named(b, "s"));
    };
    EXPECT_EQ(compare(a).count, compare(same).count);
    EXPECT_GT(compare(same).count, 0);
    const Congruence c = compare(other);
    EXPECT_FALSE(c.congruent());
    EXPECT_NE(c.reason.find("slides from 0 to"), std::string::npos) << c.reason;
  }
}

/// Links l0 and l2 have joints that fix how they are turned; l1 between them has none, and hangs
/// between two joints on one axis, whose limits lie `first` and `second` from -1 to 1 (and 1.2).
model::Model TiedThroughALooseLink(double first, double second) {
  return test::HungModel({{0, {0, 0, 0}, {0, 0, 1}, 1.0 + first, -1.0 + first},
                          {1, {0, 0, 0}, {0, 0, 1}, 1.2 + second, -1.0 + second},
                          {2, {1, 0, 0}, {1, 0, 3}, 1.5},
                          {0, {0, 2, 0}, {1, 1, 3}, 1.7}});
}

TEST(Limits, TieLinksToEachOtherThroughOneThatNothingElseTurns) {
  const model::Model a = TiedThroughALooseLink(0.0, 0.0);
  const model::Robot robot = test::Alone(a, "a");
  EXPECT_EQ(Compare(a, robot, a, robot).count, 1);
  // The link between turned by 0.3: what one joint begins with, the other makes up for.
  const model::Model turned = TiedThroughALooseLink(0.3, -0.3);
  const Congruence c = Compare(a, robot, turned, test::Alone(turned, "b"));
  ASSERT_EQ(c.count, 1) << c.reason;
  EXPECT_NEAR(c.mappings[0].joints[0].offset, 0.3, 1e-9);
  EXPECT_NEAR(c.mappings[0].joints[1].offset, -0.3, 1e-9);
  test::ExpectSameMotion(a, robot, turned, test::Alone(turned, "b"), c, c.mappings[0], 1);
  // With one of the two alone the ends are turned to each other.
  for (const model::Model& other :
       {TiedThroughALooseLink(0.3, 0.0), TiedThroughALooseLink(0.0, 0.3)}) {
    const Congruence no = Compare(a, robot, other, test::Alone(other, "b"));
    EXPECT_TRUE(no.decided);
    EXPECT_FALSE(no.congruent());
    EXPECT_FALSE(no.reason.empty());
  }
}

}  // namespace
}  // namespace morphbus::congruence
