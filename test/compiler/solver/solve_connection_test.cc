#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "compiler/model/kinematic_graph.h"
#include "compiler/solver/connection_problem.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::solver {
namespace {

using model::AxisRelation;
using model::ConnectionOption;
using model::ConnectionType;
using model::ModuleType;
using test::And;
using test::Coincident;
using test::Compare;
using test::Not;
using test::Or;
using test::SelfConnection;

/// Solves a type with itself and fails the test on any diagnostic.
ConnectionType Solve(const ModuleType& type, Condition condition) {
  source::Diagnostics diagnostics;
  ConnectionType result =
      SolveConnection(SelfConnection(std::move(condition)), {type}, &diagnostics);
  for (const source::Diagnostic& d : diagnostics.all()) ADD_FAILURE() << d.message;
  return result;
}

source::Diagnostic OnlyError(const ModuleType& type, Condition condition) {
  source::Diagnostics diagnostics;
  const ConnectionType result =
      SolveConnection(SelfConnection(std::move(condition)), {type}, &diagnostics);
  EXPECT_TRUE(result.options.empty());
  EXPECT_EQ(diagnostics.error_count(), 1);
  EXPECT_EQ(diagnostics.all().size(), 1u);
  return diagnostics.all().empty() ? source::Diagnostic{} : diagnostics.all().front();
}

std::pair<int, int> RangeOf(const ConnectionType& connection, const ModuleType& type,
                            const std::string& a, const std::string& b) {
  std::pair<int, int> range = {0, -1};
  for (const ConnectionOption& option : connection.options) {
    if (type.connectors[option.connector_a].name != a) continue;
    if (type.connectors[option.connector_b].name != b) continue;
    if (range.first == 0) range.first = option.number;
    range.second = option.number;
  }
  return range;
}

/// 1-based sub-point of b that a's sub-point `i` (1-based) meets.
int PartnerOf(const ModuleType& type, const ConnectionOption& option, int i) {
  const Eigen::Vector3d p = type.connectors[option.connector_a].subpoints[i - 1];
  const auto& others = type.connectors[option.connector_b].subpoints;
  for (size_t j = 0; j < others.size(); ++j) {
    if ((option.X_AB * others[j] - p).norm() < 1e-9) return static_cast<int>(j) + 1;
  }
  return 0;
}

/// How the joint axes nearest to the mated connectors lie, over all connections.
std::map<AxisRelation, int> MatedAxes(const ModuleType& type, const ConnectionType& connection) {
  std::map<AxisRelation, int> count;
  const auto joint_of = [&](int connector) {
    const int link = type.connectors[connector].link;
    for (const model::Joint& joint : type.joints) {
      if (joint.link_a == link || joint.link_b == link) return joint;
    }
    return type.joints[0];
  };
  for (const ConnectionOption& option : connection.options) {
    const model::Joint a = joint_of(option.connector_a);
    const model::Joint b = joint_of(option.connector_b);
    ++count[model::ClassifyAxes(a.p_MoJo_M, a.axis, option.X_AB * b.p_MoJo_M,
                                option.X_AB.linear() * b.axis, model::ExtentOf(type))];
  }
  return count;
}

Condition MtranCondition() {
  return And({test::AllPointsCoincide(4), test::OppositeGenders(true)});
}

TEST(MtranConnections, AreCountedAndNumberedAsInThePaper) {
  for (const double unit : {1.0, 0.0325}) {
    const ModuleType type = test::Mtran(unit);
    const ConnectionType connection = Solve(type, MtranCondition());
    EXPECT_EQ(connection.candidates, 144);
    ASSERT_EQ(connection.options.size(), 72u);
    for (size_t i = 0; i < 72; ++i) {
      EXPECT_EQ(connection.options[i].number, static_cast<int>(i) + 1);
    }
    EXPECT_EQ(RangeOf(connection, type, "c6", "c3"), std::pair(1, 4));
    EXPECT_EQ(RangeOf(connection, type, "c5", "c2"), std::pair(17, 20));
    EXPECT_EQ(RangeOf(connection, type, "c4", "c1"), std::pair(33, 36));
    EXPECT_EQ(RangeOf(connection, type, "c2", "c5"), std::pair(53, 56));
  }
}

TEST(MtranConnections, DefaultPutsFirstOnThirdAndTheThirdOptionFirstOnFirst) {
  const ModuleType type = test::Mtran();
  const ConnectionType connection = Solve(type, MtranCondition());
  for (int first = 0; first < 72; first += 4) {
    EXPECT_EQ(PartnerOf(type, connection.options[first], 1), 3);
    EXPECT_EQ(PartnerOf(type, connection.options[first + 2], 1), 1);
  }
}

TEST(MtranConnections, TurnFromTheDefaultByNoughtMinusNinetyHalfAndNinetyDegrees) {
  const ModuleType type = test::Mtran();
  const ConnectionType connection = Solve(type, MtranCondition());
  const double expected[] = {0.0, -M_PI / 2, M_PI, M_PI / 2};
  for (size_t i = 0; i < connection.options.size(); ++i) {
    const ConnectionOption& option = connection.options[i];
    const Eigen::Matrix3d R =
        option.X_AB.linear() * connection.options[i - i % 4].X_AB.linear().transpose();
    // Every block's outward normal points from the middle of its hull's axis to the connector.
    const auto& c = type.connectors[option.connector_a];
    const Eigen::Vector3d middle(c.link == 0 ? -1.0 : 1.0, 0.0, 0.0);
    const Eigen::Vector3d outward = (c.p_MoCo_M - middle).normalized();
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(expected[i % 4], outward).toRotationMatrix();
    EXPECT_LT((R - turn).norm(), 1e-12) << "number " << option.number;
  }
}

TEST(MtranConnections, AskForTheMaleHooksToBeExtended) {
  const ModuleType type = test::Mtran();
  const ConnectionType connection = Solve(type, MtranCondition());
  for (const ConnectionOption& option : connection.options) {
    ASSERT_EQ(option.states.size(), 1u);
    const bool a_is_male = option.connector_a < 3;
    EXPECT_EQ(option.states[0].of_a, a_is_male);
    EXPECT_EQ(option.states[0].variable, "extended");
    EXPECT_EQ(option.states[0].value, model::AttributeValue(true));
  }
}

TEST(MtranConnections, DefaultIsTheSameFromBothEnds) {
  const model::Model model = test::MtranModel();
  const ConnectionType& connection = model.connection_types[0];
  for (const ConnectionOption& option : connection.options) {
    model::Docking docking;
    docking.connector_a = option.connector_a;
    docking.connector_b = option.connector_b;
    docking.option = option.number - 1;
    const std::optional<int> mirror = model::MirrorOption(model, docking);
    ASSERT_TRUE(mirror.has_value());
    const ConnectionOption& back = connection.options[*mirror];
    EXPECT_TRUE((back.X_AB * option.X_AB).matrix().isIdentity(1e-12));
    EXPECT_EQ(*mirror % 4 == 0, (option.number - 1) % 4 == 0);
  }
}

TEST(MtranConnections, ExplainPairsThatCannotMate) {
  const ConnectionType connection = Solve(test::Mtran(), MtranCondition());
  ASSERT_EQ(connection.rejections.size(), 18u);
  EXPECT_EQ(connection.rejections[0].reason, "c1 and c1 are both male");
}

TEST(MtranConnections, MatedAxesAreHalfParallelHalfOrthogonal) {
  const ModuleType type = test::Mtran();
  std::map<AxisRelation, int> count = MatedAxes(type, Solve(type, MtranCondition()));
  EXPECT_EQ(count[AxisRelation::kParallel], 36);
  EXPECT_EQ(count[AxisRelation::kOrthogonal], 36);
}

TEST(MolecubeConnections, Are144Of288) {
  const ModuleType type = test::Molecube();
  const ConnectionType connection = Solve(type, test::AllPointsCoincide(4));
  EXPECT_EQ(connection.candidates, 288);
  EXPECT_EQ(connection.options.size(), 144u);
  std::map<AxisRelation, int> count = MatedAxes(type, connection);
  EXPECT_EQ(count[AxisRelation::kParallel], 36);
  EXPECT_EQ(count[AxisRelation::kCoplanar], 36);
  EXPECT_EQ(count[AxisRelation::kSkew], 72);
}

TEST(AtronConnections, Are32WithPerpendicularAxes) {
  const ModuleType type = test::Atron(false);
  const ConnectionType connection =
      Solve(type, And({test::AllPointsCoincide(3), test::OppositeGenders(false)}));
  EXPECT_EQ(connection.options.size(), 32u);
  EXPECT_EQ(MatedAxes(type, connection)[AxisRelation::kOrthogonal], 32);
}

TEST(AtronConnections, AreFourTimesAsManyWithASquareOfSubpoints) {
  const ConnectionType connection =
      Solve(test::Atron(true), And({test::AllPointsCoincide(4), test::OppositeGenders(false)}));
  EXPECT_EQ(connection.candidates, 256);
  EXPECT_EQ(connection.options.size(), 128u);
}

/// One connector on top of a box, `n` sub-points on a circle (or on a line).
ModuleType Pillar(int n, bool line = false) {
  ModuleType type;
  type.name = "PILLAR";
  model::Connector c;
  c.name = "top";
  c.p_MoCo_M = {0, 0, 1};
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * M_PI * i / n;
    c.subpoint_names.push_back("_" + std::to_string(i + 1));
    c.subpoints.push_back(line ? Eigen::Vector3d(0.1 * (i + 1), 0, 1)
                               : Eigen::Vector3d(std::cos(turn), std::sin(turn), 1));
  }
  c.normals[""] = Eigen::Vector3d::UnitZ();
  c.attributes["length"] = 0.2;
  c.states.push_back({"mode", {std::string("off"), std::string("slow"), std::string("fast")}});
  type.connectors = {c};
  model::Link link;
  link.name = "body";
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) link.hull.emplace_back(x, y, z);
    }
  }
  type.links = {link};
  return type;
}

TEST(SolveConnection, TwelveSubpointsAreInferredNotPermuted) {
  const ConnectionType connection = Solve(Pillar(12), test::AllPointsCoincide(12));
  EXPECT_EQ(connection.candidates, 24);
  EXPECT_EQ(connection.options.size(), 12u);
}

Condition AnyMeetsAny() {
  Condition c = Coincident("_1");
  c.p.kind = PointRef::Kind::kAnySubpoint;
  return c;
}

TEST(SolveConnection, SubpointsOnBothSidesMayBeLeftOpen) {
  // Twelve times "some sub-point meets some sub-point" does not blow up either.
  std::vector<Condition> parts = {Coincident(""), Coincident("_1"), Coincident("_2")};
  for (int i = 0; i < 12; ++i) parts.push_back(AnyMeetsAny());
  EXPECT_EQ(Solve(Pillar(12), And(parts)).options.size(), 12u);
}

TEST(SolveConnection, NormalsMayStandForPoints) {
  Condition opposed;
  opposed.kind = Condition::Kind::kAntiparallel;
  opposed.q.side = Side::kB;
  EXPECT_EQ(Solve(Pillar(4), And({Coincident(""), Coincident("_1"), opposed})).options.size(), 4u);
  Condition along = opposed;
  along.kind = Condition::Kind::kParallel;
  const source::Diagnostic error =
      OnlyError(Pillar(4), And({Coincident(""), Coincident("_1"), along}));
  ASSERT_EQ(error.notes.size(), 1u);
  EXPECT_NE(error.notes[0].message.find("hull"), std::string::npos);
}

TEST(SolveConnection, NegatedConditionsAreChecked) {
  Condition first_on_first = Coincident("_1");
  first_on_first.q.kind = PointRef::Kind::kSubpoint;
  first_on_first.q.subpoint = "_1";
  const ConnectionType connection =
      Solve(Pillar(4), And({test::AllPointsCoincide(4), Not(first_on_first)}));
  EXPECT_EQ(connection.options.size(), 3u);
  for (const ConnectionOption& option : connection.options) {
    EXPECT_NE(PartnerOf(Pillar(4), option, 1), 1);
  }
}

TEST(SolveConnection, AlternativesGiveEachMotionOnce) {
  const ConnectionType connection = Solve(
      Pillar(4), And({Coincident(""), Coincident("_1"), Or({Coincident("_2"), Coincident("_4")})}));
  EXPECT_EQ(connection.candidates, 8);
}

TEST(SolveConnection, FreeTurnIsAnErrorThatNamesTheAxis) {
  const source::Diagnostic error = OnlyError(Pillar(3, true), test::AllPointsCoincide(3));
  EXPECT_NE(error.message.find("top and top"), std::string::npos) << error.message;
  EXPECT_NE(error.message.find("(0, 0, 1) m along (1, 0, 0)"), std::string::npos) << error.message;
}

TEST(SolveConnection, CentreAloneLeavesEveryTurnFree) {
  EXPECT_NE(OnlyError(Pillar(4), Coincident("")).message.find("every axis"), std::string::npos);
}

TEST(SolveConnection, NoConditionOnPointsLeavesEveryMoveFree) {
  EXPECT_NE(OnlyError(Pillar(4), Compare(Side::kA, "length", 0.2)).message.find("any direction"),
            std::string::npos);
}

TEST(SolveConnection, SaysWhichConditionRemovedTheLast) {
  Condition impossible = Compare(Side::kB, "length", 0.3, CompareOp::kGt);
  impossible.span = {0, 7, 9};
  const source::Diagnostic error =
      OnlyError(Pillar(4), And({test::AllPointsCoincide(4), impossible}));
  ASSERT_EQ(error.notes.size(), 1u);
  EXPECT_EQ(error.notes[0].span.begin, 7u);
  EXPECT_NE(error.notes[0].message.find("top.length is 0.2"), std::string::npos);
}

TEST(SolveConnection, SaysWhichCoincidenceRemovedTheLast) {
  ModuleType type = Pillar(4);
  type.connectors[0].subpoints[3] *= 1.5;
  ModuleType other = Pillar(4);
  std::vector<Condition> parts = {Coincident("")};
  for (int i = 1; i <= 4; ++i) {
    parts.push_back(Coincident("_" + std::to_string(i)));
    parts.back().span = {0, static_cast<size_t>(i), static_cast<size_t>(i) + 1};
  }
  ConnectionProblem problem = SelfConnection(And(parts));
  problem.type_b = 1;
  source::Diagnostics diagnostics;
  SolveConnection(problem, {type, other}, &diagnostics);
  ASSERT_EQ(diagnostics.error_count(), 1);
  ASSERT_EQ(diagnostics.all()[0].notes.size(), 1u);
  EXPECT_EQ(diagnostics.all()[0].notes[0].span.begin, 4u);
}

TEST(SolveConnection, MoreThan64AlternativesAreRefused) {
  std::vector<Condition> two_to_the_seventh = {Coincident("")};
  for (int i = 0; i < 7; ++i) {
    two_to_the_seventh.push_back(Or({Coincident("_1"), Coincident("_2")}));
  }
  EXPECT_NE(OnlyError(Pillar(4), And(two_to_the_seventh)).message.find("64"), std::string::npos);
  // Alternatives over attributes alone are not terms of geometry.
  std::vector<Condition> harmless = {test::AllPointsCoincide(4)};
  for (int i = 0; i < 7; ++i) {
    harmless.push_back(Or({Compare(Side::kA, "length", 0.2), Compare(Side::kA, "length", 0.3)}));
  }
  EXPECT_EQ(Solve(Pillar(4), And(harmless)).options.size(), 4u);
}

TEST(SolveConnection, RefusesWorkWithoutBound) {
  ModuleType type = Pillar(8);
  while (type.connectors.size() < 200) type.connectors.push_back(type.connectors[0]);
  EXPECT_NE(OnlyError(type, test::AllPointsCoincide(8)).message.find("candidates"),
            std::string::npos);
  std::vector<Condition> open_ends = {Coincident("")};
  for (int i = 0; i < 60; ++i) open_ends.push_back(AnyMeetsAny());
  EXPECT_NE(OnlyError(type, And(open_ends)).message.find("too many ways"), std::string::npos);
  std::vector<Condition> endless(1000, Coincident(""));
  EXPECT_NE(OnlyError(type, And(endless)).message.find("too long"), std::string::npos);
}

TEST(SolveConnection, MissingAttributesBreakTheConditionTheyStandIn) {
  OnlyError(Pillar(4), And({test::AllPointsCoincide(4), Compare(Side::kA, "colour", true)}));
  EXPECT_EQ(
      Solve(Pillar(4), And({test::AllPointsCoincide(4), Not(Compare(Side::kA, "colour", true))}))
          .options.size(),
      4u);
}

TEST(SolveConnection, StatesOfSeveralValuesAreChosenOrRefused) {
  const auto mode = [](CompareOp op, const std::string& value) {
    return Compare(Side::kB, "mode", value, op);
  };
  const ConnectionType connection = Solve(
      Pillar(4),
      And({test::AllPointsCoincide(4), mode(CompareOp::kNe, "off"), mode(CompareOp::kNe, "slow")}));
  ASSERT_EQ(connection.options.size(), 4u);
  ASSERT_EQ(connection.options[0].states.size(), 1u);
  EXPECT_FALSE(connection.options[0].states[0].of_a);
  EXPECT_EQ(connection.options[0].states[0].value, model::AttributeValue(std::string("fast")));
  EXPECT_TRUE(connection.options[0].other_states.empty());
  OnlyError(Pillar(4), And({test::AllPointsCoincide(4), mode(CompareOp::kEq, "off"),
                            mode(CompareOp::kEq, "slow")}));
}

/// The values of a setting's variables, a's in capitals: "A=slow b=fast".
std::string Text(const model::StateSetting& setting) {
  std::string text;
  for (const model::StateRequirement& state : setting) {
    if (!text.empty()) text += " ";
    text += (state.of_a ? "A=" : "b=") + std::get<std::string>(state.value);
  }
  return text;
}

/// All settings of the first of four options, separated by bars.
std::string SettingsUnder(const Condition& condition) {
  const ConnectionType connection = Solve(Pillar(4), And({test::AllPointsCoincide(4), condition}));
  EXPECT_EQ(connection.options.size(), 4u);
  if (connection.options.empty()) return "";
  std::string text = Text(connection.options[0].states);
  for (const model::StateSetting& setting : connection.options[0].other_states) {
    text += " | " + Text(setting);
  }
  return text;
}

TEST(SolveConnection, AllSettingsAreKeptThatDoNotAskForMoreThanAnother) {
  const auto of_a = [](CompareOp op, const std::string& value) {
    return Compare(Side::kA, "mode", value, op);
  };
  const auto of_b = [](CompareOp op, const std::string& value) {
    return Compare(Side::kB, "mode", value, op);
  };
  EXPECT_EQ(SettingsUnder(of_b(CompareOp::kNe, "off")), "b=slow | b=fast");
  // The one that asks for both adds nothing to the one that asks for one of them.
  EXPECT_EQ(SettingsUnder(Or({And({of_a(CompareOp::kEq, "slow"), of_b(CompareOp::kEq, "slow")}),
                              of_b(CompareOp::kEq, "fast"),
                              And({of_a(CompareOp::kEq, "off"), of_b(CompareOp::kEq, "fast")})})),
            "b=fast | A=slow b=slow");
  EXPECT_EQ(SettingsUnder(Or({of_a(CompareOp::kEq, "slow"), of_a(CompareOp::kEq, "slow")})),
            "A=slow");
  // Where one alternative asks for nothing, nothing is asked for.
  EXPECT_EQ(SettingsUnder(Or({of_a(CompareOp::kEq, "slow"), Condition{}})), "");
  // Two geometric alternatives that lead to the same motion: it holds in the settings of either.
  EXPECT_EQ(SettingsUnder(Or({And({Coincident(""), of_a(CompareOp::kEq, "slow")}),
                              And({Coincident("_1"), of_b(CompareOp::kEq, "fast")})})),
            "A=slow | b=fast");
}

TEST(SolveConnection, WithoutHullsNothingIsPrunedAndAWarningSaysSo) {
  ModuleType type = Pillar(4);
  type.links[0].hull.clear();
  source::Diagnostics diagnostics;
  const ConnectionType connection =
      SolveConnection(SelfConnection(test::AllPointsCoincide(4)), {type}, &diagnostics);
  EXPECT_EQ(connection.options.size(), 8u);
  ASSERT_EQ(diagnostics.all().size(), 1u);
  EXPECT_EQ(diagnostics.all()[0].severity, source::Severity::kWarning);
}

}  // namespace
}  // namespace morphbus::solver
