// Every model of models/: what the literature says of its connections and of its robots.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/lexer.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/solver/hull_overlap.h"
#include "test/support/source_dir.h"

namespace morphbus::model {
namespace {

using Eigen::Vector3d;

std::filesystem::path Folder() { return test::SourcePath("models"); }

/// The model of models/NAME.m3l; the test fails on any error or warning.
Model Load(const std::string& name) {
  m3l::CompileOutput output = m3l::CompileFiles({(Folder() / (name + ".m3l")).string()});
  EXPECT_TRUE(output.diagnostics.all().empty())
      << source::Render(output.diagnostics, output.sources, false);
  return output.model.value_or(Model{});
}

struct Counts {
  int candidates = 0;
  size_t connections = 0;
};

Counts CountsOf(const Model& model, const std::string& name) {
  for (const ConnectionType& type : model.connection_types) {
    if (type.name == name) return {type.candidates, type.options.size()};
  }
  ADD_FAILURE() << "no connection " << name;
  return {};
}

/// How the two joint axes nearest to the mated connectors lie, over all ways to mate.
std::map<AxisRelation, int> MatedAxes(const Model& model, const ConnectionType& connection) {
  const ModuleType& type = model.module_types[connection.type_a];
  const auto joint_of = [&](int connector) {
    const int link = type.connectors[connector].link;
    for (const Joint& joint : type.joints) {
      if (joint.link_a == link || joint.link_b == link) return joint;
    }
    return type.joints[0];
  };
  std::map<AxisRelation, int> count;
  for (const ConnectionOption& option : connection.options) {
    const Joint a = joint_of(option.connector_a);
    const Joint b = joint_of(option.connector_b);
    ++count[ClassifyAxes(a.p_MoJo_M, a.axis, option.X_AB * b.p_MoJo_M,
                         option.X_AB.linear() * b.axis, ExtentOf(type))];
  }
  return count;
}

TEST(Models, MateInAsManyWaysAsTheLiteratureCounts) {
  const Counts mtran = CountsOf(Load("mtran"), "MTRAN_to_MTRAN");
  EXPECT_EQ(mtran.candidates, 144);
  EXPECT_EQ(mtran.connections, 72U);
  const Counts atron = CountsOf(Load("atron"), "ATRON_to_ATRON");
  EXPECT_EQ(atron.candidates, 64) << "each of 32 ways, and again with the modules in each other";
  EXPECT_EQ(atron.connections, 32U);
  const Counts molecube = CountsOf(Load("molecube"), "MOLECUBE_to_MOLECUBE");
  EXPECT_EQ(molecube.candidates, 288);
  EXPECT_EQ(molecube.connections, 144U);
  const Counts ckbot = CountsOf(Load("ckbot"), "CKBOT_to_CKBOT");
  EXPECT_EQ(ckbot.candidates, 4 * 4 * 4 * 2);
  EXPECT_EQ(ckbot.connections, 4U * 4U * 4U);
  // Two bars of ATRON's northern half, and four turns; four faces of each, and four turns.
  EXPECT_EQ(CountsOf(Load("pairs"), "MTRAN_to_ATRON").connections, 2U * 4U);
  EXPECT_EQ(CountsOf(Load("pairs"), "CKBOT_to_SMORES").connections, 4U * 4U * 4U);
  // A sole goes onto either end, one way round.
  EXPECT_EQ(CountsOf(Load("mtran_soles"), "MTRAN_to_SOLE").connections, 2U);
  const Counts mixed = CountsOf(Load("mixed"), "MTRAN_to_TELESCOPE");
  EXPECT_EQ(mixed.candidates, 3 * 2 * 4 * 2);
  EXPECT_EQ(mixed.connections, 3U * 2U * 4U);
}

TEST(Models, HaveMatedAxesAsThePaperSaysInSectionII) {
  const Model atron = Load("atron");
  EXPECT_EQ(MatedAxes(atron, atron.connection_types[0]),
            (std::map<AxisRelation, int>{{AxisRelation::kOrthogonal, 32}}));
  const Model mtran = Load("mtran");
  EXPECT_EQ(MatedAxes(mtran, mtran.connection_types[0]),
            (std::map<AxisRelation, int>{{AxisRelation::kParallel, 36},
                                         {AxisRelation::kOrthogonal, 36}}));
  const Model molecube = Load("molecube");
  EXPECT_EQ(MatedAxes(molecube, molecube.connection_types[0]),
            (std::map<AxisRelation, int>{{AxisRelation::kParallel, 36},
                                         {AxisRelation::kSkew, 72},
                                         {AxisRelation::kCoplanar, 36}}));
}

TEST(Models, WeighAndMeasureWhatIsPublished) {
  const auto mass = [](const ModuleType& type) {
    double sum = 0.0;
    for (const Link& link : type.links) sum += link.mass_kg;
    return sum;
  };
  const Model atron = Load("atron");
  EXPECT_NEAR(mass(atron.module_types[0]), 0.850, 1e-9);
  for (const Connector& connector : atron.module_types[0].connectors) {
    EXPECT_NEAR(connector.p_MoCo_M.norm(), 0.055, 1e-12);
    EXPECT_NEAR(std::abs(connector.p_MoCo_M.z()), 0.055 * std::sqrt(0.5), 1e-12);
  }
  const Model molecube = Load("molecube");
  EXPECT_NEAR(mass(molecube.module_types[0]), 0.650, 1e-9);
  EXPECT_NEAR(ExtentOf(molecube.module_types[0]), 0.100, 1e-12);
  const Model ckbot = Load("ckbot");
  EXPECT_NEAR(ExtentOf(ckbot.module_types[0]), 0.060, 1e-12);
  const Model superbot = Load("superbot");
  EXPECT_NEAR(mass(superbot.module_types[0]), 0.718, 1e-9);
  EXPECT_NEAR(ExtentOf(superbot.module_types[0]), 2 * 0.084, 1e-9);
  const Model rofi = Load("rofi");
  EXPECT_NEAR(mass(rofi.module_types[0]), 2 * (0.201 + 0.089 + 3 * 0.02), 1e-9);
  EXPECT_NEAR(ExtentOf(rofi.module_types[0]), 2 * 0.1, 1e-9);
  const Model roombots = Load("roombots");
  EXPECT_NEAR(mass(roombots.module_types[0]), 1.4, 1e-9);
  EXPECT_NEAR(ExtentOf(roombots.module_types[0]), 2 * 0.11, 1e-9);
  const Model dtto = Load("dtto");
  EXPECT_NEAR(mass(dtto.module_types[0]), 0.21, 1e-9);
  EXPECT_NEAR(ExtentOf(dtto.module_types[0]), 0.13, 1e-9);
  const Model revolve2 = Load("revolve2");
  EXPECT_NEAR(mass(revolve2.module_types[1]), 0.05864, 1e-9);
  EXPECT_NEAR(mass(revolve2.module_types[2]), 0.01144 + 0.058 + 0.025, 1e-9);
  EXPECT_NEAR(ExtentOf(revolve2.module_types[1]), 0.075, 1e-9);
  EXPECT_NEAR(ExtentOf(revolve2.module_types[2]), 0.084, 1e-9);
}

/// A robot, and the figures by which it is known.
struct Known {
  std::string file;
  std::string robot;
  size_t modules = 0;
  size_t bodies = 0;
  size_t joints = 0;
  int mobility = 0;
  bool has_loop = false;
};

/// Bodies: links less dockings for a tree, and one less for each loop. Mobility of a tree is the
/// number of its joints, of a loop of N parallel axes N - 3.
const Known kRobots[] = {
    {"atron", "car", 3, 4, 3, 3, false},
    {"atron", "car7", 7, 8, 7, 7, false},
    {"molecube", "snake", 4, 5, 4, 4, false},
    {"molecube", "arm", 4, 5, 4, 4, false},
    {"ckbot", "snake", 5, 6, 5, 5, false},
    {"ckbot", "loop", 10, 10, 10, 7, true},
    {"mtran", "quadruped", 9, 18, 18, 16, true},
    {"mtran", "equivalent_quadruped", 9, 18, 18, 16, true},
    {"mtran_robots", "snake", 5, 11, 10, 10, false},
    {"mtran_robots", "caterpillar", 8, 16, 16, 13, true},
    {"mtran_robots", "crawler", 7, 15, 14, 14, false},
    {"mtran_robots", "carrier", 4, 9, 8, 8, false},
    {"mtran_robots", "equivalent_carrier", 4, 9, 8, 8, false},
    {"mixed", "inchworm", 5, 10, 9, 9, false},
    {"smores", "train", 4, 17, 16, 16, false},
    {"superbot", "superbot_snake", 6, 19, 18, 18, false},
    {"rofi", "rofi_snake", 4, 13, 12, 12, false},
    {"roombots", "roombots_snake", 3, 10, 9, 9, false},
    {"dtto", "dtto_ring", 3, 6, 6, 3, true},
    {"revolve2", "spider", 17, 9, 8, 8, false},
    // Soles are bolted to feet, and are no bodies of their own.
    {"mtran_soles", "sensing_quadruped", 13, 18, 18, 16, true},
    {"pairs", "crane", 5, 8, 7, 7, false},
    {"pairs", "tractor", 4, 8, 7, 7, false},
    {"snakes", "mtran_snake4", 4, 9, 8, 8, false},
    {"snakes", "mtran_snake8", 8, 17, 16, 16, false},
    {"snakes", "mtran_snake16", 16, 33, 32, 32, false},
    {"snakes", "ckbot_snake4", 4, 5, 4, 4, false},
    {"snakes", "ckbot_snake8", 8, 9, 8, 8, false},
    {"snakes", "ckbot_snake16", 16, 17, 16, 16, false},
    {"snakes", "molecube_snake4", 4, 5, 4, 4, false},
    {"snakes", "molecube_snake8", 8, 9, 8, 8, false},
    {"snakes", "molecube_snake16", 16, 17, 16, 16, false},
};

TEST(Models, HaveRobotsThatAssembleAndClose) {
  for (const Known& known : kRobots) {
    SCOPED_TRACE(known.file + " " + known.robot);
    const Model model = Load(known.file);
    const Robot* robot = model.FindRobot(known.robot);
    ASSERT_NE(robot, nullptr);
    EXPECT_EQ(robot->modules.size(), known.modules);
    const KinematicState state = ForwardKinematics(model, *robot, StartValues(*robot));
    EXPECT_LT(state.closure_m, 1e-9);
    EXPECT_LT(state.closure_rad, 1e-9);
    EXPECT_EQ(state.num_loops > 0, known.has_loop);
    const KinematicGraph graph = BuildKinematicGraph(model, *robot);
    EXPECT_EQ(graph.bodies.size(), known.bodies);
    EXPECT_EQ(graph.joints.size(), known.joints);
    EXPECT_EQ(graph.mobility, known.mobility);
  }
}

TEST(Models, AreAllInTheTable) {
  std::set<std::string> known;
  for (const Known& robot : kRobots) known.insert(robot.file + "/" + robot.robot);
  for (const auto& entry : std::filesystem::directory_iterator(Folder())) {
    if (entry.path().extension() != ".m3l") continue;
    const std::string file = entry.path().stem().string();
    const Model model = Load(file);
    // A file may hold a module type only, which others import.
    bool any = model.robots.empty();
    for (const Robot& robot : model.robots) {
      any = any || known.count(file + "/" + robot.name) > 0;
      const bool imported = known.count("mtran/" + robot.name) > 0 ||
                            (file == "snakes" && known.count("molecube/" + robot.name) > 0) ||
                            (file == "pairs" && (known.count("atron/" + robot.name) > 0 ||
                                                 known.count("smores/" + robot.name) > 0));
      EXPECT_TRUE(imported || known.count(file + "/" + robot.name) > 0) << file << robot.name;
    }
    EXPECT_TRUE(any) << file;
  }
}

/// Origins of the modules (their first links) in the robot frame, in units of `unit_m`.
std::map<std::string, Vector3d> Origins(const Model& model, const Robot& robot, double unit_m) {
  const KinematicState state = ForwardKinematics(model, robot, StartValues(robot));
  std::map<std::string, Vector3d> origins;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    origins[robot.modules[m].name] = state.X_RL[m][0].translation() / unit_m;
  }
  return origins;
}

Vector3d AxisOf(const KinematicGraph& graph, const Robot& robot, const std::string& module) {
  for (const GraphJoint& joint : graph.joints) {
    if (robot.modules[joint.module].name == module) return joint.axis_R;
  }
  return Vector3d::Zero();
}

TEST(Models, PutAtronOnAFaceCentredCubicLatticeWithOrthogonalNeighbours) {
  const Model model = Load("atron");
  for (const Robot& robot : model.robots) {
    for (const auto& [name, p] : Origins(model, robot, 0.055 * std::sqrt(2.0))) {
      // In units of half the cube's side, the lattice is all points whose coordinates are integers
      // with an even sum.
      const Vector3d rounded(std::round(p.x()), std::round(p.y()), std::round(p.z()));
      EXPECT_LT((p - rounded).norm(), 1e-9) << robot.name << " " << name;
      EXPECT_EQ(std::fmod(std::abs(rounded.sum()), 2.0), 0.0) << robot.name << " " << name;
    }
    const KinematicGraph graph = BuildKinematicGraph(model, robot);
    for (const Docking& docking : robot.dockings) {
      const GraphJoint& a = graph.joints[docking.module_a];
      const GraphJoint& b = graph.joints[docking.module_b];
      EXPECT_NEAR(a.axis_R.dot(b.axis_R), 0.0, 1e-12) << robot.name;
    }
  }
}

TEST(Models, BuildTheCarsOfTheLiterature) {
  const Model model = Load("atron");
  // Fig. 3: "Head" has its axis north-south; the wheels are one to the west, one to the east.
  const Robot& car = *model.FindRobot("car");
  const KinematicGraph graph = BuildKinematicGraph(model, car);
  EXPECT_NEAR(std::abs(AxisOf(graph, car, "head").x()), 1.0, 1e-12);
  const std::map<std::string, Vector3d> at = Origins(model, car, 1.0);
  for (const char* wheel : {"left", "right"}) {
    EXPECT_NEAR(std::abs(AxisOf(graph, car, wheel).z()), 1.0, 1e-12);
    EXPECT_NEAR(at.at(wheel).y(), at.at("head").y(), 1e-12) << "all stand on the ground";
  }
  EXPECT_LT(at.at("left").z(), at.at("head").z());
  EXPECT_GT(at.at("right").z(), at.at("head").z());

  const Robot& car7 = *model.FindRobot("car7");
  const KinematicGraph graph7 = BuildKinematicGraph(model, car7);
  const std::map<std::string, Vector3d> at7 = Origins(model, car7, 1.0);
  for (const char* axle : {"front", "rear"}) {
    EXPECT_NEAR(std::abs(AxisOf(graph7, car7, axle).y()), 1.0, 1e-12) << "steers";
  }
  for (const char* wheel : {"wheel_1", "wheel_2", "wheel_3", "wheel_4"}) {
    EXPECT_NEAR(std::abs(AxisOf(graph7, car7, wheel).z()), 1.0, 1e-12);
    EXPECT_NEAR(at7.at(wheel).y(), at7.at("wheel_1").y(), 1e-12);
    for (const char* other : {"body", "front", "rear"}) {
      EXPECT_LT(at7.at(wheel).y(), at7.at(other).y() - 0.05) << "only wheels touch the ground";
    }
  }
}

TEST(Models, HaveNeighboursWhoseAxesLieAsThePaperSays) {
  const std::map<std::string, std::set<AxisRelation>> expected = {
      {"atron", {AxisRelation::kOrthogonal, AxisRelation::kParallel}},
      {"mtran", {AxisRelation::kParallel}},  // the quadrupeds; orthogonal in those below
      {"mtran_robots", {AxisRelation::kParallel, AxisRelation::kOrthogonal}},
      {"molecube", {AxisRelation::kParallel, AxisRelation::kSkew, AxisRelation::kCoplanar}}};
  for (const auto& [file, relations] : expected) {
    const Model model = Load(file);
    std::set<AxisRelation> found;
    for (const Robot& robot : model.robots) {
      for (const GraphJoint& joint : BuildKinematicGraph(model, robot).joints) {
        found.insert(joint.adjacent_axes.begin(), joint.adjacent_axes.end());
      }
    }
    EXPECT_EQ(found, relations) << file;
  }
}

/// As the dynamic loop and a snake need: none of it lies in its neighbour on the way.
TEST(Models, ACkbotBendsAsFarAsItsLimits) {
  const Model model = Load("ckbot");
  const ModuleType& type = model.module_types[0];
  Robot pair;
  pair.modules = {{"m1", 0, {0.0}}, {"m2", 0, {0.0}}};
  const int back = type.FindConnector("back").value();
  const int front = type.FindConnector("front").value();
  const auto& options = model.connection_types[0].options;
  for (size_t option = 0; option < options.size(); ++option) {
    if (options[option].connector_a != back || options[option].connector_b != front) continue;
    pair.dockings = {{0, back, 1, front, 0, static_cast<int>(option)}};
    for (int degrees = -90; degrees <= 90; degrees += 5) {
      const KinematicState state =
          ForwardKinematics(model, pair, {{0.0}, {degrees * std::numbers::pi / 180.0}});
      for (size_t i = 0; i < type.links.size(); ++i) {
        for (size_t j = 0; j < type.links.size(); ++j) {
          EXPECT_LT(solver::PenetrationDepth(type.links[i].hull, state.X_RL[0][i],
                                             type.links[j].hull, state.X_RL[1][j]),
                    1e-6 * ExtentOf(type))
              << degrees << " degrees, " << type.links[i].name << " in " << type.links[j].name;
        }
      }
    }
  }
}

/// "Each model about as long as Fig. 8": as many words and signs, comments, robots and looks, which
/// the paper has not, aside.
TEST(Models, AreAboutAsLongAsFigure8) {
  for (const char* file : {"mtran", "atron", "molecube", "ckbot_module"}) {
    source::SourceSet sources;
    const Result<int> index = sources.AddFile((Folder() / (std::string(file) + ".m3l")).string());
    ASSERT_TRUE(index.has_value());
    source::Diagnostics diagnostics;
    size_t tokens = 0;
    bool looks = false;
    int depth = 0;
    for (const m3l::Token& token : m3l::Tokenize(sources, *index, 100'000, &diagnostics)) {
      if (token.text == "robot") break;
      // What is seen ends where the next member begins.
      static const std::set<std::string> kMembers = {"point", "link", "axis", "joint", "module"};
      depth += token.text == "(" ? 1 : token.text == ")" ? -1 : 0;
      const bool member = depth == 0 && kMembers.count(std::string(token.text)) > 0;
      looks = token.text == "visual" || (looks && !member);
      if (!looks) ++tokens;
    }
    // The paper's M-TRAN has 1065.
    EXPECT_GT(tokens, 500U) << file;
    EXPECT_LT(tokens, 1200U) << file;
  }
}

}  // namespace
}  // namespace morphbus::model
