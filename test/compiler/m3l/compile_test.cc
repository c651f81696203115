// Known answers of the M3L compiler as a whole: the paper's listings and small models.

#include "compiler/m3l/compile.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "compiler/model/forward_kinematics.h"
#include "test/support/diagnostics_test.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

std::string ReadFile(const std::string& path) {
  std::ifstream file(test::SourcePath(path));
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string Listing8() { return ReadFile("test/compiler/m3l/listings/fig8.m3l"); }

/// Fig. 9 without the paper's own elision of the second frame.
std::string Listing9() {
  std::string text = ReadFile("test/compiler/m3l/listings/fig9.m3l");
  const size_t at = text.rfind("...");
  return text.erase(at, 3);
}

class CompileTest : public test::DiagnosticsTest {
 protected:
  /// Compiles a text in the folder of the models, so that it can import them.
  const model::Model& Compile(const std::string& text) {
    output_ = CompileText(test::SourcePath("models/test.m3l"), text);
    Collect(output_.diagnostics, output_.sources);
    static const model::Model kNone;
    EXPECT_TRUE(output_.model.has_value());
    return output_.model ? *output_.model : kNone;
  }
  void CompileBad(const std::string& text) {
    output_ = CompileText(test::SourcePath("models/test.m3l"), text);
    Collect(output_.diagnostics, output_.sources);
    EXPECT_FALSE(output_.model.has_value());
  }
  /// The options of the first connection for connectors named so.
  static std::vector<model::ConnectionOption> Options(const model::Model& model,
                                                      const std::string& a, const std::string& b) {
    std::vector<model::ConnectionOption> options;
    const model::ConnectionType& connection = model.connection_types.at(0);
    for (const model::ConnectionOption& option : connection.options) {
      const auto& type_a = model.module_types[connection.type_a];
      const auto& type_b = model.module_types[connection.type_b];
      if (type_a.FindConnector(a) == option.connector_a &&
          type_b.FindConnector(b) == option.connector_b) {
        options.push_back(option);
      }
    }
    return options;
  }
  CompileOutput output_;
};

// --- The paper's listings ---

TEST_F(CompileTest, ListingOfFigure8HasTheConnectionsOfThePaper) {
  const model::Model& model = Compile(Listing8());
  ASSERT_EQ(model.connection_types.size(), 1U);
  EXPECT_EQ(model.connection_types[0].candidates, 144);
  EXPECT_EQ(model.connection_types[0].options.size(), 72U);
  const std::tuple<const char*, const char*, int> first_numbers[] = {
      {"c6", "c3", 1}, {"c5", "c2", 17}, {"c4", "c1", 33}, {"c2", "c5", 53}};
  for (const auto& [a, b, number] : first_numbers) {
    const auto options = Options(model, a, b);
    ASSERT_EQ(options.size(), 4U) << a << b;
    for (int i = 0; i < 4; ++i) EXPECT_EQ(options[i].number, number + i);
  }
}

TEST_F(CompileTest, DefaultsPutFirstOnThirdAndTheThirdOptionFirstOnFirst) {
  const model::Model& model = Compile(Listing8());
  const model::ModuleType& type = model.module_types[0];
  for (const model::ConnectionOption& option : model.connection_types[0].options) {
    const auto& a = type.connectors[option.connector_a];
    const auto& b = type.connectors[option.connector_b];
    const int nth = option.number - Options(model, a.name, b.name).front().number;
    const size_t partner = nth == 0 ? 2 : 0;
    if (nth != 0 && nth != 2) continue;
    EXPECT_LT((a.subpoints[0] - option.X_AB * b.subpoints[partner]).norm(), 1e-9) << option.number;
  }
}

TEST_F(CompileTest, AConnectionSaysWhichHooksMustBeExtended) {
  const model::Model& model = Compile(Listing8());
  const auto options = Options(model, "c6", "c3");
  ASSERT_EQ(options[0].states.size(), 1U);
  EXPECT_FALSE(options[0].states[0].of_a);
  EXPECT_EQ(options[0].states[0].variable, "extended");
  EXPECT_EQ(options[0].states[0].value, model::AttributeValue(true));
  EXPECT_TRUE(Options(model, "c3", "c6")[0].states.at(0).of_a);
}

/// Module origins (x, z) in the robot frame, in model units, and which modules are not turned.
struct KnownRobot {
  const char* name;
  double x[9];
  double z[9];
  bool identity[9];
};
constexpr KnownRobot kKnownRobots[] = {
    {"quadruped",
     {5, 1, -3, -7, -1, 5, 1, -3, -7},
     {-2, -2, -2, -2, 0, 2, 2, 2, 2},
     {true, false, true, false, true, true, false, true, false}},
    {"equivalent_quadruped",
     {5, 1, -3, -7, -1, 5, 1, -3, -7},
     {2, 2, 2, 2, 0, -2, -2, -2, -2},
     {true, false, true, true, true, false, false, true, false}}};

void ExpectKnownPoses(const model::Model& model) {
  for (const KnownRobot& known : kKnownRobots) {
    const model::Robot* robot = model.FindRobot(known.name);
    ASSERT_NE(robot, nullptr);
    const auto state = model::ForwardKinematics(model, *robot, model::StartValues(*robot));
    EXPECT_LT(state.closure_m, 1e-9);
    EXPECT_LT(state.closure_rad, 1e-9);
    for (size_t m = 0; m < 9; ++m) {
      const double unit = model.TypeOf(*robot, static_cast<int>(m)).unit_m;
      const model::Pose& X_RM = state.X_RL[m][0];
      EXPECT_LT((X_RM.translation() / unit - Vector3d(known.x[m], 0, known.z[m])).norm(), 1e-9)
          << known.name << " m" << m + 1;
      const Eigen::Matrix3d half_turn = Vector3d(1, -1, -1).asDiagonal();
      const Eigen::Matrix3d wanted =
          known.identity[m] ? Eigen::Matrix3d::Identity() : Eigen::Matrix3d(half_turn);
      EXPECT_LT((X_RM.linear() - wanted).norm(), 1e-9) << known.name << " m" << m + 1;
    }
  }
}

TEST_F(CompileTest, RobotsOfFigure9CloseTheirLoopsAndHaveTheKnownPoses) {
  // Without its frame, the second robot's is that of m1; the frame of the first is put in.
  std::string text = Listing9();
  const size_t begin = text.find("frame="), end = text.find("\n\n", begin);
  const std::string frame = text.substr(begin, end - begin);
  ExpectKnownPoses(Compile(Listing8() + text + frame));
}

TEST_F(CompileTest, RobotsOfFigure9CompileWithoutTheSecondFrame) {
  const model::Model& model = Compile(Listing8() + Listing9());
  ASSERT_EQ(model.robots.size(), 2U);
  EXPECT_EQ(model.robots[1].root_module, 0);
  EXPECT_TRUE(model.robots[1].X_LR.isApprox(model::Pose::Identity()));
}

TEST_F(CompileTest, TheModelFileHasTheKnownPosesAndTheHardwareFigures) {
  const std::string path = test::SourcePath("models/mtran.m3l");
  const CompileOutput output = CompileFiles({path});
  ASSERT_TRUE(output.model.has_value())
      << source::Render(output.diagnostics, output.sources, false);
  EXPECT_TRUE(output.diagnostics.all().empty());
  ExpectKnownPoses(*output.model);
  const model::ModuleType& type = output.model->module_types[0];
  EXPECT_EQ(type.unit_m, 0.0325);
  EXPECT_EQ(type.links[0].mass_kg, 0.18);
  EXPECT_EQ(type.links[1].mass_kg, 0.18);
  EXPECT_EQ(type.links[2].mass_kg, 0.06);
  EXPECT_EQ(type.joints[0].effort, 1.9);
  EXPECT_NEAR(type.connectors[1].p_MoCo_M.x(), -0.065, 1e-15);
}

// --- Modules ---

TEST_F(CompileTest, DefaultMassesAreHullVolumeTimesDensity) {
  const model::ModuleType& type = Compile(Listing8()).module_types[0];
  // A block is a 2 x 2 x 1 box and a wedge of half that; the bar is flat, a rhombus of 2 x 0.4,
  // and counts as 0.05 of the module's 4 thick.
  EXPECT_NEAR(type.links[0].mass_kg, 500.0 * 6.0, 1e-6);
  EXPECT_NEAR(type.links[1].mass_kg, 500.0 * 6.0, 1e-6);
  EXPECT_NEAR(type.links[2].mass_kg, 500.0 * 0.4 * 0.2, 1e-6);
  EXPECT_EQ(type.joints[0].effort, 1.9);
  EXPECT_EQ(type.joints[0].speed, kPi);
}

TEST_F(CompileTest, UnitScalesVolumesByItsCube) {
  std::string text = Listing8();
  text.insert(text.find("module MTRAN:") + 13, " unit=0.1");
  EXPECT_NEAR(Compile(text).module_types[0].links[0].mass_kg, 500.0 * 6.0e-3, 1e-9);
}

TEST_F(CompileTest, CoordinatesAreArithmetic) {
  const model::ModuleType& type =
      Compile(
          "module A: unit=1/2\n"
          "point c: coords=(sqrt(16)/2, -(1+2)*2, cos(pi)+sin(0)), connector\n"
          "link l: grouping=(c)\n")
          .module_types[0];
  EXPECT_LT((type.connectors[0].p_MoCo_M - Vector3d(1, -3, -0.5)).norm(), 1e-15);
}

constexpr char kTwoLinks[] =
    "module A: unit=0.5\n"
    "link l: mass=1\nlink k: mass=2\n"
    "axis x: origin=(0,2,0), direction=(0,0,3)\naxis y: origin=(0,2,5), direction=(0,0,-1)\n";

TEST_F(CompileTest, JointsOfAllTypes) {
  const auto joint = [&](const std::string& attributes) {
    return Compile(std::string(kTwoLinks) + "joint j: " + attributes + ", pair=((l,x),(k,y))\n")
        .module_types[0]
        .joints.at(0);
  };
  const model::Joint revolute = joint("type=revolute, value=[-pi/2,pi/4]");
  EXPECT_EQ(revolute.type, model::JointType::kRevolute);
  EXPECT_NEAR(revolute.lower, -kPi / 2, 1e-15);
  EXPECT_NEAR(revolute.upper, kPi / 4, 1e-15);
  EXPECT_LT((revolute.p_MoJo_M - Vector3d(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((revolute.axis - Vector3d(0, 0, 1)).norm(), 1e-15);
  // A slide is a length: its limits are in model units.
  const model::Joint prismatic = joint("type=prismatic, value=[-1,2], torque=7, speed=0.1");
  EXPECT_NEAR(prismatic.lower, -0.5, 1e-15);
  EXPECT_NEAR(prismatic.upper, 1.0, 1e-15);
  EXPECT_EQ(prismatic.effort, 7.0);
  EXPECT_EQ(prismatic.speed, 0.1);
  const model::Joint continuous = joint("type=continuous");
  EXPECT_EQ(continuous.upper, std::numeric_limits<double>::infinity());
  EXPECT_EQ(continuous.lower, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(joint("type=fixed").type, model::JointType::kFixed);
}

TEST_F(CompileTest, HullsTakePointsSubPointsAndLinks) {
  const model::ModuleType& type =
      Compile(
          "module A:\n"
          "point p: (point _1: coords=(1,0,0)) (point _2: coords=(2,0,0)) coords=(3,0,0)\n"
          "point q: (point _1: coords=(4,0,0))\n"
          "link l: (point own: (point _1: coords=(5,0,0)) coords=(6,0,0)) grouping=(p),\n"
          "  hull=convex(p, p._2, p.point, q.point, own, own._1, l.point, k.far), mass=1\n"
          "link k: (point far: coords=(7,0,0)) mass=1\n"
          "axis x: origin=(0,0,0), direction=(0,0,1)\naxis y: origin=(0,0,0), direction=(0,0,-1)\n"
          "joint j: type=fixed, pair=((l,x),(k,y))\n")
          .module_types[0];
  std::vector<double> xs;
  for (const Vector3d& p : type.links[0].hull) xs.push_back(p.x());
  EXPECT_EQ(xs, (std::vector<double>{3, 2, 3, 1, 2, 4, 6, 5, 6, 5, 7}));
}

TEST_F(CompileTest, ConnectorsKeepTheOrderOfDeclaration) {
  const model::ModuleType& type =
      Compile(
          "module A:\n"
          "point z: coords=(0,0,1), connector\n"
          "link l: (point m: coords=(1,0,0), connector, size=2, flag) grouping=(z,a)\n"
          "point a: coords=(0,1,0), connector, mode=[\"open\",\"shut\"], normal=(0,2,0)\n")
          .module_types[0];
  ASSERT_EQ(type.connectors.size(), 3U);
  EXPECT_EQ(type.connectors[0].name, "z");
  EXPECT_EQ(type.connectors[1].name, "m");
  EXPECT_EQ(type.connectors[2].name, "a");
  EXPECT_EQ(type.connectors[1].attributes.at("size"), model::AttributeValue(2.0));
  EXPECT_EQ(type.connectors[1].attributes.at("flag"), model::AttributeValue(true));
  ASSERT_EQ(type.connectors[2].states.size(), 1U);
  EXPECT_EQ(type.connectors[2].states[0].values.size(), 2U);
  EXPECT_LT((type.connectors[2].normals.at("") - Vector3d(0, 1, 0)).norm(), 1e-15);
}

// --- Connections ---

/// A cube-like module: one connector in +x with asymmetric sub-points and a normal.
std::string Plug(const std::string& type, const std::string& attributes) {
  return "module " + type +
         ":\npoint c: (point _1: coords=(1,1,0)) (point _2: coords=(1,0,2)) "
         "(point _3: coords=(1,0,-2)) coords=(1,0,0), connector, normal=(1,0,0), " +
         attributes +
         "\nlink l: grouping=(c), mass=1\naxis up: origin=(0,0,0), direction=(0,1,0)\n";
}

TEST_F(CompileTest, ConnectionsBetweenUnlikeTypesTakeTheirEndsInEitherOrder) {
  const model::Model& model =
      Compile(Plug("A", "size=1") + Plug("B", "size=2") +
              "connection C: members=(A a, B b), conditions=(a.point p coincident b.point q and\n"
              "  p._1 coincident q._1 and p._2 coincident q._3 and p.size < q.size)\n"
              "robot r: modules=(A m1, B m2), connections=((m1.c,m2.c))\n"
              "robot s: modules=(A m1, B m2), connections=((m2.c,m1.c))\n");
  TakeWarning("no link with a hull");
  ASSERT_EQ(model.robots.size(), 2U);
  for (const model::Robot& robot : model.robots) {
    EXPECT_EQ(robot.dockings.at(0).module_a, 0);
    EXPECT_EQ(robot.dockings.at(0).module_b, 1);
  }
}

TEST_F(CompileTest, NormalsAndAxesDirectAConnection) {
  // Centres meet and normals oppose: a turn about x is left, which the axes fix.
  const model::Model& model =
      Compile(Plug("A", "kind=\"x\"") +
              "connection C: members=(A a, A b), conditions=(a.point p coincident b.point q and\n"
              "  p antiparallel q and a.up parallel b.up and p.kind==q.kind)\n");
  TakeWarning("no link with a hull");
  ASSERT_EQ(model.connection_types[0].options.size(), 1U);
  const model::Pose& X_AB = model.connection_types[0].options[0].X_AB;
  EXPECT_LT((X_AB.translation() - Vector3d(2, 0, 0)).norm(), 1e-9);
  EXPECT_LT((X_AB.linear() * Vector3d::UnitX() + Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((X_AB.linear() * Vector3d::UnitY() - Vector3d::UnitY()).norm(), 1e-9);
}

TEST_F(CompileTest, EnumeratedStatesBecomeRequirements) {
  const model::Model& model =
      Compile(Plug("A", "latch=[\"in\",\"out\"]") +
              "connection C: members=(A a, A b), conditions=(a.point p coincident b.point q and\n"
              "  p._1 coincident q._1 and p._2 coincident q._3 and p.latch==\"out\")\n");
  TakeWarning("no link with a hull");
  const auto& states = model.connection_types[0].options.at(0).states;
  ASSERT_EQ(states.size(), 1U);
  EXPECT_TRUE(states[0].of_a);
  EXPECT_EQ(states[0].value, model::AttributeValue(std::string("out")));
}

TEST_F(CompileTest, AConnectionOfUnknownTypesIsNotAmongTheSolved) {
  // What explains connections follows their indices of types, so there must be such types.
  CompileBad("connection A:\n");
  TakeError("has no 'members'");
  TakeError("has no 'conditions'");
  EXPECT_TRUE(output_.solved.connection_types.empty());
  EXPECT_TRUE(output_.problems.empty());

  CompileBad(Plug("A", "kind=\"x\"") +
             "connection C: members=(A a, B b), conditions=(a.point p coincident b.point q)\n"
             "connection D: members=(A a, A b), conditions=(a.point p coincident b.point q)\n");
  TakeError("there is no module type 'B'");
  TakeError("connection 'D' does not fix c and c to each other");
  ASSERT_EQ(output_.solved.connection_types.size(), 1U);
  EXPECT_EQ(output_.solved.connection_types[0].name, "D");
  EXPECT_EQ(output_.problems.at(0).name, "D");
  EXPECT_EQ(output_.explainable, std::vector<bool>{true});
}

// --- Robots ---

class RobotTest : public CompileTest {
 protected:
  /// Numbers of the options that a robot of M-TRAN modules m1 to m4 gets for `connections`.
  std::vector<int> Numbers(const std::string& connections) {
    const model::Model& model =
        Compile("import \"mtran.m3l\"\nrobot r: modules=(MTRAN m1, MTRAN m2), connections=(" +
                connections + ")\n");
    std::vector<int> numbers;
    const model::Robot* robot = model.FindRobot("r");
    if (!robot) return numbers;
    for (const model::Docking& docking : robot->dockings) {
      numbers.push_back(
          model.connection_types[docking.connection_type].options[docking.option].number);
      module_a_ = docking.module_a;
    }
    return numbers;
  }
  int module_a_ = -1;
};

TEST_F(RobotTest, DefaultIsTheFirstOfThePairAsWritten) {
  EXPECT_EQ(Numbers("(m1.c2,m2.c5)"), std::vector<int>{53});
  EXPECT_EQ(Numbers("(m2.c5,m1.c2)"), std::vector<int>{17});
  EXPECT_EQ(module_a_, 1);
}

TEST_F(RobotTest, NumbersOfEitherDirectionAreValid) {
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,55)"), std::vector<int>{55});
  EXPECT_EQ(module_a_, 0);
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,19)"), std::vector<int>{19});
  EXPECT_EQ(module_a_, 1);
}

TEST_F(RobotTest, TurnsSelectTheirOption) {
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=0)"), std::vector<int>{53});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=-90)"), std::vector<int>{54});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=180)"), std::vector<int>{55});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=-180)"), std::vector<int>{55});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=90)"), std::vector<int>{56});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=270)"), std::vector<int>{54});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=90deg)"), std::vector<int>{56});
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,rot=pi/2*1rad)"), std::vector<int>{56});
}

TEST_F(RobotTest, NamesSelectAmongSeveralConnections) {
  EXPECT_EQ(Numbers("(m1.c2,m2.c5,MTRAN_to_MTRAN:56)"), std::vector<int>{56});
}

TEST_F(RobotTest, TheFirstDeclaredConnectionIsTheDefault) {
  const std::string conditions =
      ": members=(A a, A b), conditions=(a.point p coincident b.point q and ";
  const model::Model& model =
      Compile(Plug("A", "kind=1") + "connection C" + conditions +
              "p._1 coincident q._1 and p._2 coincident q._3)\n" + "connection D" + conditions +
              "p._2 coincident q._2 and p._3 coincident q._3 and p antiparallel q)\n"
              "robot r: modules=(A m1, A m2), connections=((m1.c,m2.c))\n"
              "robot s: modules=(A m1, A m2), connections=((m1.c,m2.c,D:1))\n");
  TakeWarning("no link with a hull");
  TakeWarning("no link with a hull");
  ASSERT_EQ(model.robots.size(), 2U);
  EXPECT_EQ(model.robots[0].dockings[0].connection_type, 0);
  EXPECT_EQ(model.robots[1].dockings[0].connection_type, 1);
}

TEST_F(RobotTest, WrongNumberListsTheValidOnesWithTheirTurns) {
  CompileBad(
      "import \"mtran.m3l\"\n"
      "robot r: modules=(MTRAN m1, MTRAN m2), connections=((m1.c6,m2.c3,5))\n");
  const source::Diagnostic d = TakeError("connection number 5 does not join m1.c6 and m2.c3");
  EXPECT_NE(d.hint.find("valid are 1 (the default), 2 (rot=-90), 3 (rot=180), 4 (rot=90)"),
            std::string::npos)
      << d.hint;
}

TEST_F(RobotTest, ConnectorUsedTwiceNamesTheOtherPlace) {
  CompileBad(
      "import \"mtran.m3l\"\nrobot r: modules=(MTRAN m1, MTRAN m2, MTRAN m3),\n"
      "connections=((m1.c2,m2.c5),\n(m1.c2,m3.c5))\n");
  const source::Diagnostic d = TakeError("connector 'm1.c2' is used twice");
  EXPECT_EQ(LineOf(d.span), 4);
  ASSERT_EQ(d.notes.size(), 1U);
  EXPECT_EQ(LineOf(d.notes[0].span), 3);
}

TEST_F(RobotTest, StartValuesAreKeptAndMoveTheModules) {
  const model::Model& model = Compile(
      "import \"mtran.m3l\"\nrobot r: modules=(MTRAN m1, MTRAN m2), connections=((m1.c2,m2.c5)),\n"
      "joints=(m1.joint_1=pi/2, m2.joint_2=-0.5)\n");
  const model::Robot* robot = model.FindRobot("r");
  ASSERT_NE(robot, nullptr);
  EXPECT_NEAR(robot->modules[0].start[0], kPi / 2, 1e-15);
  EXPECT_EQ(robot->modules[1].start[1], -0.5);
}

TEST_F(RobotTest, LimitsHoldToATenthOfAMilliradian) {
  Compile("import \"mtran.m3l\"\nrobot r: modules=(MTRAN m1), joints=(m1.joint_1=1.5708)\n");
  CompileBad("import \"mtran.m3l\"\nrobot r: modules=(MTRAN m1), joints=(m1.joint_1=1.571)\n");
  TakeError("'m1.joint_1' starts at 1.571, outside its limits");
}

TEST_F(RobotTest, ALoopThatStartValuesOpenIsFound) {
  CompileBad(
      "import \"mtran.m3l\"\nrobot r: modules=(MTRAN m2, MTRAN m3, MTRAN m5),\n"
      "connections=((m2.c2,m3.c5),(m2.c3,m5.c4),(m3.c6,m5.c3,3)), joints=(m5.joint_1=0.1)\n");
  TakeError("the loop m3 - m2 - m5 - m3 does not close");
}

TEST_F(RobotTest, ModulesInsideEachOtherAreNamedWithTheirRobotAndTheDepth) {
  // Four blocks make a square, so the third module of a curled chain lies in the first.
  const auto robot = [](const std::string& name) {
    return "robot " + name + ": modules=(MTRAN m1, MTRAN m2, MTRAN m3),\n" +
           "connections=((m1.c2,m2.c5),(m2.c2,m3.c5)),\n"
           "joints=(m1.joint_1=pi/2, m1.joint_2=-pi/2, m2.joint_1=-pi/2, m2.joint_2=pi/2,"
           "m3.joint_1=pi/2, m3.joint_2=-pi/2)\n";
  };
  Compile("import \"mtran.m3l\"\n" + robot("ring") + robot("knot"));
  for (const char* name : {"ring", "knot"}) {
    const source::Diagnostic warning = TakeWarning("inside each other");
    EXPECT_EQ(TextAt(warning.span), "m3");
    // The edge of a block: they coincide.
    EXPECT_EQ(warning.message, "in robot '" + std::string(name) +
                                   "', m1.passive_block and m3.passive_block lie 0.065 m inside "
                                   "each other");
  }
}

TEST_F(RobotTest, AFrameMayUseNamedAxes) {
  const model::Model& model = Compile(
      "module A: unit=0.5\nlink l: mass=1\n"
      "axis x: origin=(1,2,3), direction=(0,2,0)\naxis y: origin=(1,2,3), direction=(0,0,5)\n"
      "robot r: modules=(A m1), frame=(m1.l.x, m1.l.y, m1.l.(axis: origin=(1,2,3), "
      "direction=(1,0,0)))\n");
  const model::Pose& X_LR = model.robots.at(0).X_LR;
  EXPECT_LT((X_LR.translation() - Vector3d(0.5, 1, 1.5)).norm(), 1e-15);
  EXPECT_LT((X_LR.linear() * Vector3d(1, 2, 3) - Vector3d(3, 1, 2)).norm(), 1e-15);
}

}  // namespace
}  // namespace morphbus::m3l
