// `rot=`: the turn from the default about the outward normal, however that normal is found.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <numbers>

#include "compiler/m3l/compile.h"
#include "compiler/model/model_proto.h"
#include "test/support/diagnostics_test.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

using Eigen::Vector3d;

/// The hinge of docs/m3l.md with plug at -x and socket at +x. `plug` goes into the plug's
/// attributes, `hulls` adds the links' shapes.
std::string Hinge(const std::string& plug, bool hulls) {
  const auto hull = [&](const char* link) {
    return hulls ? fmt::format(", hull=convex({}.point)", link) : std::string();
  };
  return "module HINGE: unit=0.05\n"
         "point plug: (point _1: coords=(-1,.5,0)) (point _2: coords=(-1,0,.5))\n"
         "  (point _3: coords=(-1,-.5,0)) (point _4: coords=(-1,0,-.5))\n"
         "  coords=(-1,0,0), connector, kind=\"plug\"" +
         plug +
         "\npoint socket: (point _1: coords=(1,.5,0)) (point _2: coords=(1,0,.5))\n"
         "  (point _3: coords=(1,-.5,0)) (point _4: coords=(1,0,-.5))\n"
         "  coords=(1,0,0), connector, kind=\"socket\"\n"
         "link left: (point a: coords=(-1,.5,.5)) (point b: coords=(-1,-.5,.5))\n"
         "  (point c: coords=(-1,-.5,-.5)) (point d: coords=(-1,.5,-.5)) (point e: "
         "coords=(0,0,-.5))"
         " grouping=(plug), mass=.1" +
         hull("left") +
         "\nlink right: (point a: coords=(1,.5,.5)) (point b: coords=(1,-.5,.5))\n"
         "  (point c: coords=(1,-.5,-.5)) (point d: coords=(1,.5,-.5)) (point e: coords=(0,0,-.5))"
         " grouping=(socket), mass=.1" +
         hull("right") +
         "\naxis out: origin=(0,0,0), direction=(0,0,1)\n"
         "axis in: origin=(0,0,0), direction=(0,0,-1)\n"
         "joint hinge: type=revolute, value=[-pi/2,pi/2], pair=((left,out),(right,in))\n"
         "connection SNAP: members=(HINGE a, HINGE b), conditions=(\n"
         "  a.point p coincident b.point q\n"
         "  and p._1 coincident q.point and p._2 coincident q.point\n"
         "  and p._3 coincident q.point and p._4 coincident q.point\n"
         "  and p.kind==\"plug\" and q.kind==\"socket\")\n";
}

/// A module of one flat link, a square in the plane x = 0 whose middle is the connector, and a
/// second link whose only point is `far`, which alone can say where the inside is.
std::string Plate(const std::string& connector, const std::string& far) {
  return "module PLATE: \n"
         "point face: (point _1: coords=(0,1,0)) (point _2: coords=(0,0,1))\n"
         "  (point _3: coords=(0,-1,0)) (point _4: coords=(0,0,-1))\n"
         "  coords=(0,0,0), connector" +
         connector +
         "\nlink plate: grouping=(face), hull=convex(face.point), mass=1\n"
         "link rest: (point p: coords=" +
         far +
         ") mass=1\n"
         "axis u: origin=(0,0,0), direction=(1,0,0)\naxis v: origin=(0,0,0), direction=(-1,0,0)\n"
         "joint j: type=continuous, pair=((plate,u),(rest,v))\n"
         "connection C: members=(PLATE a, PLATE b), conditions=(a.point p coincident b.point q\n"
         "  and p._1 coincident q.point and p._2 coincident q.point and p._3 coincident q.point\n"
         "  and p._4 coincident q.point)\n";
}

class DockingTurnTest : public test::DiagnosticsTest {
 protected:
  /// The pose of b in a of the docking `(m1.CONNECTOR,m2.CONNECTOR` + `selector` + `)`.
  model::Pose Docked(const std::string& module, const std::string& type, const std::string& ends,
                     const std::string& selector) {
    const std::string text =
        module + fmt::format("robot r: modules=({} m1, {} m2), connections=(({}{}))\n", type, type,
                             ends, selector);
    output_ = CompileText("test.m3l", text);
    for (const source::Diagnostic& d : output_.diagnostics.all()) {
      if (d.severity == source::Severity::kError) errors_.push_back(d);
    }
    if (!output_.model) return model::Pose::Identity();
    const model::Docking& docking = output_.model->robots.at(0).dockings.at(0);
    return output_.model->connection_types[0].options[docking.option].X_AB;
  }

  /// Expects the docking with `rot=degrees` to be the default one, turned so about `axis` through
  /// `centre`.
  void ExpectTurn(const std::string& module, const std::string& type, const std::string& ends,
                  double degrees, const Vector3d& centre, const Vector3d& axis) {
    const model::Pose from = Docked(module, type, ends, "");
    const model::Pose to = Docked(module, type, ends, fmt::format(",rot={}", degrees));
    ASSERT_TRUE(errors_.empty()) << errors_[0].message << " " << errors_[0].hint;
    const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180.0, axis);
    const model::Pose expected =
        Eigen::Translation3d(centre) * turn * Eigen::Translation3d(-centre) * from;
    EXPECT_LT((to.matrix() - expected.matrix()).norm(), 1e-9) << degrees;
  }

  CompileOutput output_;
  std::vector<source::Diagnostic> errors_;
};

TEST_F(DockingTurnTest, EveryPairOfMtranTurnsInQuarters) {
  const std::string import = fmt::format("import \"{}\"\n", test::SourcePath("models/mtran.m3l"));
  const CompileOutput mtran = CompileText("test.m3l", import);
  ASSERT_TRUE(mtran.model);
  const model::ConnectionType& connection = mtran.model->connection_types[0];
  const auto& connectors = mtran.model->module_types[0].connectors;
  std::string robots;
  for (size_t i = 0; i < connection.options.size(); ++i) {
    const model::ConnectionOption& option = connection.options[i];
    const int turns[] = {0, -90, 180, 90};
    robots += fmt::format(
        "robot r{}: modules=(MTRAN m1, MTRAN m2), connections=((m1.{},m2.{},rot={}))\n", i,
        connectors[option.connector_a].name, connectors[option.connector_b].name, turns[i % 4]);
  }
  const CompileOutput output = CompileText("test.m3l", import + robots);
  ASSERT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  for (size_t i = 0; i < connection.options.size(); ++i) {
    const model::Robot* robot = output.model->FindRobot(fmt::format("r{}", i));
    ASSERT_NE(robot, nullptr);
    EXPECT_EQ(robot->dockings[0].option, static_cast<int>(i));
  }
}

TEST_F(DockingTurnTest, GoesTheSameWayWithHullsAndWithout) {
  const Vector3d plug(-0.05, 0.0, 0.0);
  for (const bool hulls : {true, false}) {
    for (const double degrees : {90.0, -90.0, 180.0}) {
      SCOPED_TRACE(fmt::format("{} {}", hulls, degrees));
      ExpectTurn(Hinge("", hulls), "HINGE", "m1.plug,m2.socket", degrees, plug, -Vector3d::UnitX());
    }
  }
}

TEST_F(DockingTurnTest, IsAboutTheDeclaredNormalIfThereIsOne) {
  for (const bool hulls : {true, false}) {
    ExpectTurn(Hinge(", normal=(1,0,0)", hulls), "HINGE", "m1.plug,m2.socket", 90.0,
               Vector3d(-0.05, 0.0, 0.0), Vector3d::UnitX());
  }
}

TEST_F(DockingTurnTest, AFlatHullRoundTheConnectorLeavesItToTheOtherPoints) {
  ExpectTurn(Plate("", "(-1,0,0)"), "PLATE", "m1.face,m2.face", 90.0, Vector3d::Zero(),
             Vector3d::UnitX());
  ExpectTurn(Plate("", "(1,0,0)"), "PLATE", "m1.face,m2.face", 90.0, Vector3d::Zero(),
             -Vector3d::UnitX());
}

TEST_F(DockingTurnTest, WhereNothingSaysWhichWayIsOutANormalIsAskedFor) {
  Docked(Plate("", "(0,2,0)"), "PLATE", "m1.face,m2.face", ",rot=90");
  ASSERT_EQ(errors_.size(), 1U);
  EXPECT_EQ(errors_[0].message,
            "which way 'rot' turns is not known: 'm1.face' has no outward normal");
  EXPECT_NE(errors_[0].hint.find("give 'face' of 'PLATE' a normal=(x, y, z)"), std::string::npos)
      << errors_[0].hint;
  ASSERT_EQ(errors_[0].notes.size(), 1U);
}

/// Four pins in a plane and a key on the axis before it: the points span no plane.
TEST_F(DockingTurnTest, AKeyOnTheAxisIsNoHindrance) {
  const auto face = [](const char* name, double x, double key, const char* kind) {
    return fmt::format(
        "point {0}: (point _1: coords=({1},.5,0)) (point _2: coords=({1},0,.5))\n"
        "  (point _3: coords=({1},-.5,0)) (point _4: coords=({1},0,-.5)) (point key: "
        "coords=({2},0,0))\n"
        "  coords=({1},0,0), connector, kind=\"{3}\"\n",
        name, x, key, kind);
  };
  std::string module = "module KEYED:\n" + face("plug", 1, 1.1, "plug") +
                       face("socket", -1, -0.9, "socket") + "link body:";
  for (int i = 0; i < 8; ++i) {
    module += fmt::format(" (point k{}: coords=({},{},{}))", i, i & 1 ? 1 : -1, i & 2 ? 1 : -1,
                          i & 4 ? 1 : -1);
  }
  module +=
      " grouping=(plug, socket), hull=convex(body.point), mass=1\n"
      "connection C: members=(KEYED a, KEYED b), conditions=(a.point p coincident b.point q\n"
      "  and p._1 coincident q.point and p._2 coincident q.point and p._3 coincident q.point\n"
      "  and p._4 coincident q.point and p.key coincident q.key and p.kind==\"plug\"\n"
      "  and q.kind==\"socket\")\n";
  for (const double degrees : {90.0, -90.0, 180.0}) {
    ExpectTurn(module, "KEYED", "m1.plug,m2.socket", degrees, Vector3d::UnitX(), Vector3d::UnitX());
  }
}

TEST_F(DockingTurnTest, AHalfTurnNeedsNoWayOut) {
  ExpectTurn(Plate("", "(0,2,0)"), "PLATE", "m1.face,m2.face", 180.0, Vector3d::Zero(),
             Vector3d::UnitX());
}

TEST_F(DockingTurnTest, ADeclaredNormalDecidesForAPlate) {
  ExpectTurn(Plate(", normal=(-1,0,0)", "(0,2,0)"), "PLATE", "m1.face,m2.face", 90.0,
             Vector3d::Zero(), -Vector3d::UnitX());
}

/// A cube with a face in front, whose normal is as written.
std::string CubeWith(const std::string& normal) {
  return "module CUBE: unit=0.1\n"
         "point face: (point _1: coords=(1,.5,0)) (point _2: coords=(1,0,.5))\n"
         "  (point _3: coords=(1,-.5,0)) coords=(1,0,0), connector" +
         normal +
         "\nlink body: grouping=(face), hull=box(size=(2,2,2))\nrobot r: modules=(CUBE m)\n";
}

TEST(ImpliedNormalTest, ANormalThatSaysWhatTheGeometrySaysLeavesModelAndHashAsTheyAre) {
  const auto bytes = [](const std::string& normal) {
    const CompileOutput output = CompileText("a.m3l", CubeWith(normal));
    EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
    return output.model ? model::SerializeModel(*output.model) : "";
  };
  const std::string plain = bytes("");
  EXPECT_EQ(bytes(", normal=(1,0,0)"), plain);
  EXPECT_EQ(bytes(", normal=(0.3,0,0)"), plain);
  // These say something else.
  EXPECT_NE(model::ModelHash(bytes(", normal=(-1,0,0)")), model::ModelHash(plain));
  EXPECT_NE(model::ModelHash(bytes(", normal=(1,1e-6,0)")), model::ModelHash(plain));
}

TEST_F(DockingTurnTest, ATurnThatThePairDoesNotHaveListsThoseItHas) {
  Docked(Hinge("", false), "HINGE", "m1.plug,m2.socket", ",rot=45");
  ASSERT_EQ(errors_.size(), 1U);
  // Eight motions fit; the four that lay the modules into each other are turned over as well.
  size_t turns = 0;
  for (size_t at = 0; (at = errors_[0].hint.find("rot=", at)) != std::string::npos; ++at) ++turns;
  EXPECT_EQ(turns, 3U) << errors_[0].hint;
}

}  // namespace
}  // namespace morphbus::m3l
