#include "test/sim/mtran.h"

#include <cmath>
#include <numbers>

#include "compiler/model/forward_kinematics.h"
#include "compiler/source/check.h"

namespace morphbus::sim::test {
namespace {

using Eigen::Vector3d;
using model::Pose;

constexpr double kUnit = 0.0325;
constexpr double kDegree = std::numbers::pi / 180.0;

model::Connector MakeConnector(const std::string& name, int link, const Vector3d& centre,
                               const std::vector<Vector3d>& subpoints, bool male) {
  model::Connector connector;
  connector.name = name;
  connector.link = link;
  connector.p_MoCo_M = kUnit * centre;
  for (size_t k = 0; k < subpoints.size(); ++k) {
    connector.subpoint_names.push_back("_" + std::to_string(k + 1));
    connector.subpoints.push_back(kUnit * subpoints[k]);
  }
  connector.attributes["gender"] = std::string(male ? "male" : "female");
  if (male) {
    connector.states.push_back({"extended", {false, true}});
  } else {
    connector.attributes["extended"] = false;
  }
  return connector;
}

model::ModuleType MakeMtran() {
  model::ModuleType type;
  type.name = "MTRAN";
  type.unit_m = kUnit;
  const auto add = [&type](const char* name, int link, const Vector3d& c,
                           const std::vector<Vector3d>& p, bool male) {
    type.connectors.push_back(MakeConnector(name, link, c, p, male));
  };
  add("c1", 0, {-1, 0, 1}, {{-1, 1, 1}, {-2, 0, 1}, {-1, -1, 1}, {0, 0, 1}}, true);
  add("c2", 0, {-2, 0, 0}, {{-2, 1, 0}, {-2, 0, -1}, {-2, -1, 0}, {-2, 0, 1}}, true);
  add("c3", 0, {-1, 0, -1}, {{-1, 1, -1}, {0, 0, -1}, {-1, -1, -1}, {-2, 0, -1}}, true);
  add("c4", 1, {1, 0, -1}, {{1, 1, -1}, {2, 0, -1}, {1, -1, -1}, {0, 0, -1}}, false);
  add("c5", 1, {2, 0, 0}, {{2, 1, 0}, {2, 0, 1}, {2, -1, 0}, {2, 0, -1}}, false);
  add("c6", 1, {1, 0, 1}, {{1, 1, 1}, {0, 0, 1}, {1, -1, 1}, {2, 0, 1}}, false);
  for (int block = 0; block < 2; ++block) {
    model::Link link;
    link.name = block == 0 ? "active_block" : "passive_block";
    link.mass_kg = 0.18;
    for (const model::Connector& connector : type.connectors) {
      if (connector.link != block) continue;
      link.hull.push_back(connector.p_MoCo_M);
      link.hull.insert(link.hull.end(), connector.subpoints.begin(), connector.subpoints.end());
    }
    const double side = block == 0 ? -2.0 : 2.0;
    for (const double y : {1.0, -1.0}) {
      for (const double z : {1.0, -1.0}) link.hull.emplace_back(kUnit * Vector3d(side, y, z));
    }
    type.links.push_back(link);
  }
  model::Link bar;
  bar.name = "connecting_bar";
  bar.mass_kg = 0.06;
  for (const Vector3d& p :
       {Vector3d(-1, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 0.2, 0), Vector3d(0, -0.2, 0)}) {
    bar.hull.emplace_back(kUnit * p);
  }
  type.links.push_back(bar);
  for (int j = 0; j < 2; ++j) {
    model::Joint joint;
    joint.name = j == 0 ? "joint_1" : "joint_2";
    joint.link_a = j;
    joint.link_b = 2;
    joint.p_MoJo_M = kUnit * Vector3d(j == 0 ? -1 : 1, 0, 0);
    joint.axis = Vector3d::UnitZ();
    joint.lower = -std::numbers::pi / 2;
    joint.upper = std::numbers::pi / 2;
    type.joints.push_back(joint);
  }
  return type;
}

// The frame of four points round a centre: x towards `first`, z normal to the first two.
Eigen::Matrix3d Frame(const Vector3d& centre, const Vector3d& first, const Vector3d& second) {
  Eigen::Matrix3d frame;
  frame.col(0) = (first - centre).normalized();
  frame.col(2) = (first - centre).cross(second - centre).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

// Options in the order of the numbering rule: connectors of a, of b and partners of a's last
// sub-point, each in reverse order of declaration. The mated faces run in opposite directions.
model::ConnectionType MakeConnection(const model::ModuleType& type) {
  model::ConnectionType connection;
  connection.name = "MTRAN_to_MTRAN";
  connection.candidates = 144;
  for (int a = 5; a >= 0; --a) {
    for (int b = 5; b >= 0; --b) {
      const model::Connector& ca = type.connectors[static_cast<size_t>(a)];
      const model::Connector& cb = type.connectors[static_cast<size_t>(b)];
      if (ca.attributes.at("gender") == cb.attributes.at("gender")) continue;
      for (int partner = 3; partner >= 0; --partner) {
        model::ConnectionOption option;
        option.number = static_cast<int>(connection.options.size()) + 1;
        option.connector_a = a;
        option.connector_b = b;
        // a's _4 meets b's `partner`, a's _3 the one after it.
        const Eigen::Matrix3d R_AC = Frame(ca.p_MoCo_M, ca.subpoints[3], ca.subpoints[2]);
        const Eigen::Matrix3d R_BC = Frame(cb.p_MoCo_M, cb.subpoints[static_cast<size_t>(partner)],
                                           cb.subpoints[static_cast<size_t>((partner + 1) % 4)]);
        option.X_AB.linear() = R_AC * R_BC.transpose();
        option.X_AB.translation() = ca.p_MoCo_M - option.X_AB.linear() * cb.p_MoCo_M;
        option.states.push_back({a < 3, "extended", true});
        connection.options.push_back(option);
      }
    }
  }
  return connection;
}

// "m1.c2,m2.c5" and its number (0: the pair's default).
struct Step {
  int a, ca, b, cb, number;
};

model::Robot MakeRobot(const std::string& name, const model::ConnectionType& connection,
                       const std::vector<Step>& steps) {
  model::Robot robot;
  robot.name = name;
  for (int m = 1; m <= 9; ++m) {
    robot.modules.push_back({"m" + std::to_string(m), 0, {0.0, 0.0}});
  }
  for (const Step& step : steps) {
    model::Docking docking{step.a - 1, step.ca - 1, step.b - 1, step.cb - 1, 0, -1};
    for (size_t o = 0; o < connection.options.size(); ++o) {
      const model::ConnectionOption& option = connection.options[o];
      if (step.number == 0 && docking.option < 0 && option.connector_a == docking.connector_a &&
          option.connector_b == docking.connector_b) {
        docking.option = static_cast<int>(o);
      }
      if (step.number != option.number) continue;
      docking.option = static_cast<int>(o);
      if (option.connector_a != docking.connector_a) {
        std::swap(docking.module_a, docking.module_b);
        std::swap(docking.connector_a, docking.connector_b);
      }
    }
    MORPHBUS_CHECK(docking.option >= 0);
    robot.dockings.push_back(docking);
  }
  robot.root_module = 4;
  robot.root_link = 1;
  robot.X_LR.translation() = kUnit * Vector3d(1, 0, 0);
  return robot;
}

}  // namespace

std::shared_ptr<const model::Model> MakeMtranModel() {
  auto model = std::make_shared<model::Model>();
  model->module_types.push_back(MakeMtran());
  model->connection_types.push_back(MakeConnection(model->module_types[0]));
  const model::ConnectionType& connection = model->connection_types[0];
  model->robots.push_back(MakeRobot("quadruped", connection,
                                    {{1, 2, 2, 5, 0},
                                     {2, 2, 3, 5, 0},
                                     {3, 2, 4, 5, 0},
                                     {2, 3, 5, 4, 0},
                                     {3, 6, 5, 3, 3},
                                     {6, 2, 7, 5, 0},
                                     {7, 2, 8, 5, 0},
                                     {8, 2, 9, 5, 0},
                                     {7, 1, 5, 6, 0},
                                     {8, 4, 5, 1, 35}}));
  model->robots.push_back(MakeRobot("equivalent_quadruped", connection,
                                    {{1, 2, 2, 5, 0},
                                     {2, 2, 3, 5, 0},
                                     {3, 2, 4, 5, 19},
                                     {2, 1, 5, 6, 0},
                                     {3, 4, 5, 1, 35},
                                     {6, 2, 7, 5, 19},
                                     {7, 2, 8, 5, 0},
                                     {8, 2, 9, 5, 0},
                                     {7, 3, 5, 4, 0},
                                     {8, 6, 5, 3, 3}}));
  return model;
}

Quadruped AssignParts(const model::Model& model, const model::Robot& robot) {
  // Upper and lower half of each leg; the legs on the other side of the hub in the second robot.
  const int m[2][kNumLegs][2] = {{{2, 1}, {7, 6}, {3, 4}, {8, 9}},
                                 {{7, 6}, {2, 1}, {8, 9}, {3, 4}}};
  const int which = robot.name == "quadruped" ? 0 : 1;
  const std::vector<std::vector<Pose>> X_RL =
      model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  Quadruped quadruped;
  for (size_t leg = 0; leg < kNumLegs; ++leg) {
    const bool front = leg == kFrontLeft || leg == kFrontRight;
    for (size_t part = 0; part < kNumParts; ++part) {
      FunctionalJoint& joint = quadruped[leg][part];
      joint.module = m[which][leg][part == kUpperJoint || part == kHip ? 0 : 1] - 1;
      // Active blocks lie to the south of their module in both robots, so in front legs joint_1 is
      // the one nearer to the hub.
      const bool inner = part == kUpperJoint || part == kKnee;
      joint.joint = inner == front ? 0 : 1;
      const Vector3d axis_R =
          X_RL[static_cast<size_t>(joint.module)][static_cast<size_t>(joint.joint)].linear() *
          Vector3d::UnitZ();
      // Raw values turn the block against the bar; only the ankle's convention is about the block.
      joint.sign = (axis_R.z() > 0.0 ? 1.0 : -1.0) * (part == kAnkle ? 1.0 : -1.0);
    }
  }
  return quadruped;
}

Posture GaitTargets(double t) {
  Posture q{};
  if (t < 0.5) return q;
  const auto turn = [&q](Leg leg, Part part, double degrees) {
    q[static_cast<size_t>(leg)][static_cast<size_t>(part)] += degrees * kDegree;
  };
  for (const Leg leg : {kFrontLeft, kFrontRight, kBackLeft, kBackRight}) {
    const double side = leg == kFrontLeft || leg == kFrontRight ? 1.0 : -1.0;
    turn(leg, kUpperJoint, -45 * side);
    turn(leg, kHip, 45 * side);
  }
  if (t < kGaitStart) return q;
  const double phase = std::fmod(t - kGaitStart, kGaitCycle);
  const auto move_leg = [&](Leg leg, double begin) {
    const double side = leg == kFrontLeft || leg == kFrontRight ? 1.0 : -1.0;
    if (phase < begin) return;
    turn(leg, kKnee, 90);
    turn(leg, kAnkle, -90);
    // 45 degrees at 180 degrees/s take 0.25 s; the second half starts on the tick after arrival.
    if (phase < begin + 0.28) {
      turn(leg, kUpperJoint, 45 * side);
      turn(leg, kHip, 45 * side);
    }
  };
  if (phase >= 2.0) {
    for (const Leg leg : {kFrontLeft, kFrontRight, kBackLeft, kBackRight}) {
      turn(leg, kKnee, -45);
      turn(leg, kAnkle, 45);
    }
  }
  move_leg(kFrontRight, 2.25);
  move_leg(kBackLeft, 3.25);
  move_leg(kBackRight, 4.75);
  move_leg(kFrontLeft, 5.0);
  return q;
}

}  // namespace morphbus::sim::test
