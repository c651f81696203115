#include "test/compiler/solver/known_modules.h"

#include <cmath>
#include <utility>

#include "compiler/base/check.h"

namespace morphbus::test {
namespace {

using model::Connector;
using model::Joint;
using model::Link;
using model::ModuleType;
using solver::Condition;
using solver::PointRef;
using solver::Side;

Connector MakeConnector(const std::string& name, int link, const Vector3d& centre,
                        std::vector<Vector3d> subpoints) {
  Connector connector;
  connector.name = name;
  connector.link = link;
  connector.p_MoCo_M = centre;
  for (size_t i = 0; i < subpoints.size(); ++i) {
    connector.subpoint_names.push_back("_" + std::to_string(i + 1));
  }
  connector.subpoints = std::move(subpoints);
  return connector;
}

Joint MakeJoint(const std::string& name, int link_a, int link_b, const Vector3d& origin,
                const Vector3d& axis) {
  Joint joint;
  joint.name = name;
  joint.link_a = link_a;
  joint.link_b = link_b;
  joint.p_MoJo_M = origin;
  joint.axis = axis.normalized();
  joint.lower = -M_PI / 2;
  joint.upper = M_PI / 2;
  return joint;
}

/// A link whose hull is the sub-points and centres of its connectors, and `more`.
Link MakeLink(const ModuleType& type, const std::string& name, int index,
              const std::vector<Vector3d>& more) {
  Link link;
  link.name = name;
  for (const Connector& connector : type.connectors) {
    if (connector.link != index) continue;
    link.hull.push_back(connector.p_MoCo_M);
    link.hull.insert(link.hull.end(), connector.subpoints.begin(), connector.subpoints.end());
  }
  link.hull.insert(link.hull.end(), more.begin(), more.end());
  link.mass_kg = 0.1;
  return link;
}

void Scale(ModuleType& type, double unit) {
  type.unit_m = unit;
  for (Connector& connector : type.connectors) {
    connector.p_MoCo_M *= unit;
    for (Vector3d& p : connector.subpoints) p *= unit;
  }
  for (Link& link : type.links) {
    for (Vector3d& p : link.hull) p *= unit;
  }
  for (Joint& joint : type.joints) joint.p_MoJo_M *= unit;
}

PointRef Point(Side side, PointRef::Kind kind, const std::string& name = "") {
  PointRef ref;
  ref.side = side;
  ref.kind = kind;
  ref.subpoint = name;
  return ref;
}

}  // namespace

ModuleType Mtran(double unit) {
  ModuleType type;
  type.name = "MTRAN";
  type.connectors = {
      MakeConnector("c1", 0, {-1, 0, 1}, {{-1, 1, 1}, {-2, 0, 1}, {-1, -1, 1}, {0, 0, 1}}),
      MakeConnector("c2", 0, {-2, 0, 0}, {{-2, 1, 0}, {-2, 0, -1}, {-2, -1, 0}, {-2, 0, 1}}),
      MakeConnector("c3", 0, {-1, 0, -1}, {{-1, 1, -1}, {0, 0, -1}, {-1, -1, -1}, {-2, 0, -1}}),
      MakeConnector("c4", 1, {1, 0, -1}, {{1, 1, -1}, {2, 0, -1}, {1, -1, -1}, {0, 0, -1}}),
      MakeConnector("c5", 1, {2, 0, 0}, {{2, 1, 0}, {2, 0, 1}, {2, -1, 0}, {2, 0, -1}}),
      MakeConnector("c6", 1, {1, 0, 1}, {{1, 1, 1}, {0, 0, 1}, {1, -1, 1}, {2, 0, 1}})};
  for (size_t i = 0; i < 6; ++i) {
    Connector& c = type.connectors[i];
    c.attributes["gender"] = std::string(i < 3 ? "male" : "female");
    if (i < 3) {
      c.states.push_back({"extended", {false, true}});
    } else {
      c.attributes["extended"] = false;
    }
  }
  type.links = {
      MakeLink(type, "active_block", 0, {{-2, 1, -1}, {-2, -1, -1}, {-2, -1, 1}, {-2, 1, 1}}),
      MakeLink(type, "passive_block", 1, {{2, 1, 1}, {2, -1, 1}, {2, -1, -1}, {2, 1, -1}}),
      MakeLink(type, "connecting_bar", 2, {{-1, 0, 0}, {1, 0, 0}, {0, 0.2, 0}, {0, -0.2, 0}})};
  type.joints = {MakeJoint("joint_1", 0, 2, {-1, 0, 0}, {0, 0, 1}),
                 MakeJoint("joint_2", 1, 2, {1, 0, 0}, {0, 0, 1})};
  Scale(type, unit);
  return type;
}

ModuleType Molecube() {
  ModuleType type;
  type.name = "MOLECUBE";
  for (int k = 0; k < 6; ++k) {
    const Vector3d n = (k < 3 ? 1.0 : -1.0) * Vector3d::Unit(k % 3);
    const Vector3d u = Vector3d::Unit((k + 1) % 3);
    const Vector3d v = n.cross(u);
    type.connectors.push_back(MakeConnector("c" + std::to_string(k + 1), k < 3 ? 0 : 1, n,
                                            {n + 0.5 * u, n + 0.5 * v, n - 0.5 * u, n - 0.5 * v}));
  }
  const std::vector<Vector3d> cut = {{1, -1, 0}, {1, 0, -1}, {0, 1, -1},
                                     {-1, 1, 0}, {-1, 0, 1}, {0, -1, 1}};
  std::vector<Vector3d> upper = {{1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
  std::vector<Vector3d> lower = {{-1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}};
  upper.insert(upper.end(), cut.begin(), cut.end());
  lower.insert(lower.end(), cut.begin(), cut.end());
  type.links = {MakeLink(type, "upper", 0, upper), MakeLink(type, "lower", 1, lower)};
  type.joints = {MakeJoint("swivel", 0, 1, {0, 0, 0}, {1, 1, 1})};
  return type;
}

ModuleType Atron(bool square) {
  ModuleType type;
  type.name = "ATRON";
  for (int k = 0; k < 8; ++k) {
    const double side = k < 4 ? 1.0 : -1.0;
    const double turn = k % 4 * M_PI / 2;
    const Vector3d radial(std::round(std::cos(turn)), std::round(std::sin(turn)), 0.0);
    const Vector3d n = (radial + side * Vector3d::UnitZ()).normalized();
    const Vector3d to_pole = (side * Vector3d::UnitZ() - radial).normalized();
    const bool male = k % 2 == 0;
    const Vector3d across = (male ? 1.0 : -1.0) * n.cross(to_pole);  // a mate looks back at us
    const auto at = [&](double t, double b) { return Vector3d(n + t * to_pole + b * across); };
    std::vector<Vector3d> subpoints = {at(0.3, 0.0), at(-0.15, 0.2), at(-0.05, -0.25)};
    if (square) subpoints = {at(0.3, 0.0), at(0.0, 0.3), at(-0.3, 0.0), at(0.0, -0.3)};
    type.connectors.push_back(
        MakeConnector("c" + std::to_string(k), k < 4 ? 0 : 1, n, std::move(subpoints)));
    type.connectors.back().attributes["gender"] = std::string(male ? "male" : "female");
  }
  const std::vector<Vector3d> rim = {
      {0.7, 0.7, 0}, {-0.7, 0.7, 0}, {-0.7, -0.7, 0}, {0.7, -0.7, 0}};
  type.links = {MakeLink(type, "north", 0, rim), MakeLink(type, "south", 1, rim)};
  type.joints = {MakeJoint("centre", 0, 1, {0, 0, 0}, {0, 0, 1})};
  return type;
}

Condition And(std::vector<Condition> parts) {
  Condition c;
  c.kind = Condition::Kind::kAnd;
  c.children = std::move(parts);
  return c;
}

Condition Or(std::vector<Condition> parts) {
  Condition c;
  c.kind = Condition::Kind::kOr;
  c.children = std::move(parts);
  return c;
}

Condition Not(Condition part) {
  Condition c;
  c.kind = Condition::Kind::kNot;
  c.children.push_back(std::move(part));
  return c;
}

Condition Coincident(const std::string& subpoint_of_a) {
  Condition c;
  c.kind = Condition::Kind::kCoincident;
  const bool centre = subpoint_of_a.empty();
  c.p =
      Point(Side::kA, centre ? PointRef::Kind::kCentre : PointRef::Kind::kSubpoint, subpoint_of_a);
  c.q = Point(Side::kB, centre ? PointRef::Kind::kCentre : PointRef::Kind::kAnySubpoint);
  return c;
}

Condition Compare(Side side, const std::string& attribute, model::AttributeValue value,
                  solver::CompareOp op) {
  Condition c;
  c.kind = Condition::Kind::kCompare;
  c.op = op;
  c.lhs = solver::AttributeRef{side, attribute};
  c.rhs = std::move(value);
  return c;
}

Condition AllPointsCoincide(int num_subpoints) {
  std::vector<Condition> parts = {Coincident("")};
  for (int i = 1; i <= num_subpoints; ++i) parts.push_back(Coincident("_" + std::to_string(i)));
  return And(std::move(parts));
}

Condition OppositeGenders(bool hooks) {
  const auto one_way = [&](Side male, Side female) {
    std::vector<Condition> parts = {Compare(male, "gender", std::string("male"))};
    if (hooks) parts.push_back(Compare(male, "extended", true));
    parts.push_back(Compare(female, "gender", std::string("female")));
    return And(std::move(parts));
  };
  return Or({one_way(Side::kA, Side::kB), one_way(Side::kB, Side::kA)});
}

solver::ConnectionProblem SelfConnection(Condition condition) {
  solver::ConnectionProblem problem;
  problem.name = "mating";
  problem.type_a = problem.type_b = 0;
  problem.condition = std::move(condition);
  return problem;
}

model::Model MtranModel(double unit) {
  model::Model model;
  model.module_types = {Mtran(unit)};
  source::Diagnostics diagnostics;
  model.connection_types = {
      SolveConnection(SelfConnection(And({AllPointsCoincide(4), OppositeGenders(true)})),
                      model.module_types, &diagnostics)};
  MORPHBUS_CHECK(!diagnostics.had_errors());
  return model;
}

model::Robot Assemble(const model::Model& model, const std::string& name, int count,
                      const std::vector<Mating>& matings, int root_module, int root_link,
                      const model::Pose& X_LR) {
  model::Robot robot;
  robot.name = name;
  const ModuleType& type = model.module_types[0];
  for (int i = 1; i <= count; ++i) {
    robot.modules.push_back(
        {"m" + std::to_string(i), 0, std::vector<double>(type.joints.size(), 0.0)});
  }
  for (const Mating& mating : matings) {
    model::Docking docking;
    docking.module_a = robot.FindModule(mating.a).value();
    docking.module_b = robot.FindModule(mating.b).value();
    docking.connector_a = type.FindConnector(mating.connector_a).value();
    docking.connector_b = type.FindConnector(mating.connector_b).value();
    const auto fits = [&](const model::ConnectionOption& option) {
      return option.connector_a == docking.connector_a &&
             option.connector_b == docking.connector_b &&
             (!mating.number || *mating.number == option.number);
    };
    bool found = false;
    for (int swapped = 0; swapped < 2 && !found; ++swapped) {
      for (const model::ConnectionOption& option : model.connection_types[0].options) {
        if (!fits(option)) continue;
        docking.option = option.number - 1;
        found = true;
        break;
      }
      if (found) break;
      std::swap(docking.module_a, docking.module_b);
      std::swap(docking.connector_a, docking.connector_b);
    }
    MORPHBUS_CHECK(found);
    robot.dockings.push_back(docking);
  }
  robot.root_module = root_module;
  robot.root_link = root_link;
  robot.X_LR = X_LR;
  return robot;
}

model::Robot Quadruped(const model::Model& model, double unit) {
  const model::Pose X_LR(Eigen::Translation3d(unit, 0, 0));
  return Assemble(model, "quadruped", 9,
                  {{"m1", "c2", "m2", "c5", {}},
                   {"m2", "c2", "m3", "c5", {}},
                   {"m3", "c2", "m4", "c5", {}},
                   {"m2", "c3", "m5", "c4", {}},
                   {"m3", "c6", "m5", "c3", 3},
                   {"m6", "c2", "m7", "c5", {}},
                   {"m7", "c2", "m8", "c5", {}},
                   {"m8", "c2", "m9", "c5", {}},
                   {"m7", "c1", "m5", "c6", {}},
                   {"m8", "c4", "m5", "c1", 35}},
                  4, 1, X_LR);
}

model::Robot EquivalentQuadruped(const model::Model& model, double unit) {
  const model::Pose X_LR(Eigen::Translation3d(unit, 0, 0));
  return Assemble(model, "equivalent_quadruped", 9,
                  {{"m1", "c2", "m2", "c5", {}},
                   {"m2", "c2", "m3", "c5", {}},
                   {"m3", "c2", "m4", "c5", 19},
                   {"m2", "c1", "m5", "c6", {}},
                   {"m3", "c4", "m5", "c1", 35},
                   {"m6", "c2", "m7", "c5", 19},
                   {"m7", "c2", "m8", "c5", {}},
                   {"m8", "c2", "m9", "c5", {}},
                   {"m7", "c3", "m5", "c4", {}},
                   {"m8", "c6", "m5", "c3", 3}},
                  4, 1, X_LR);
}

}  // namespace morphbus::test
