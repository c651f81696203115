#include "compiler/model/assembly_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "test/support/shipped_models.h"
#include "test/support/source_dir.h"

namespace morphbus::model {
namespace {

using test::DirectedModel;
using test::ShippedModels;

/// A robot of two M-TRAN modules, in a model with all directions.
Model Pair(const std::string& connection) {
  return DirectedModel(test::SourcePath("models/pair.m3l"),
                       "import \"mtran.m3l\"\nrobot pair: modules=(MTRAN m1, MTRAN m2), "
                       "connections=(" +
                           connection + ")\n");
}

TEST(AssemblyPlanTest, EveryShippedRobotStandsModuleByModule) {
  for (const auto& [file, model] : ShippedModels()) {
    for (const Robot& robot : model.robots) {
      SCOPED_TRACE(file + " " + robot.name);
      const AssemblyPlan plan = PlanAssembly(model, robot);
      ASSERT_EQ(plan.modules.size(), robot.modules.size());
      EXPECT_EQ(plan.modules.front().module, robot.root_module);
      EXPECT_TRUE(plan.modules.front().matings.empty());
      std::set<int> standing, made;
      for (const AddedModule& added : plan.modules) {
        EXPECT_EQ(added.matings.empty(), standing.empty());
        for (const Mating& mating : added.matings) {
          EXPECT_TRUE(standing.contains(mating.standing)) << "it mates with what stands already";
          EXPECT_TRUE(made.insert(mating.docking).second) << "each connection once";
        }
        EXPECT_TRUE(standing.insert(added.module).second) << "each module once";
        EXPECT_NEAR(added.from_R.norm(), added.matings.empty() ? 0.0 : 1.0, 1e-9);
      }
      EXPECT_EQ(made.size(), robot.dockings.size());
    }
  }
}

TEST(AssemblyPlanTest, EveryMatingIsTheRobotsConnection) {
  int matings = 0;
  for (const auto& [file, model] : ShippedModels()) {
    for (const Robot& robot : model.robots) {
      SCOPED_TRACE(file + " " + robot.name);
      for (const AddedModule& added : PlanAssembly(model, robot).modules) {
        for (const Mating& mating : added.matings) {
          ++matings;
          const Docking& d = robot.dockings[mating.docking];
          using Ends = std::set<std::pair<int, int>>;
          EXPECT_EQ((Ends{{added.module, mating.own_connector},
                          {mating.standing, mating.standing_connector}}),
                    (Ends{{d.module_a, d.connector_a}, {d.module_b, d.connector_b}}));
          EXPECT_EQ(mating.number, model.OptionOf(d).number);
          // The ways are those of the two connectors, and no other.
          std::vector<int> ways;
          for (const ConnectionOption& o : model.connection_types[d.connection_type].options) {
            if (o.connector_a == d.connector_a && o.connector_b == d.connector_b) {
              ways.push_back(o.number);
            }
          }
          EXPECT_EQ(mating.ways, ways);
          EXPECT_TRUE(std::ranges::count(ways, mating.number));
        }
      }
    }
  }
  EXPECT_GT(matings, 150);
}

TEST(AssemblyPlanTest, LoopsRunOverConnectionsOfTheRobot) {
  int loops = 0;
  for (const auto& [file, model] : ShippedModels()) {
    for (const Robot& robot : model.robots) {
      SCOPED_TRACE(file + " " + robot.name);
      std::set<std::pair<int, int>> joined;
      for (const Docking& d : robot.dockings) joined.insert(std::minmax(d.module_a, d.module_b));
      int closing = 0;
      for (const AddedModule& added : PlanAssembly(model, robot).modules) {
        for (size_t i = 0; i < added.matings.size(); ++i) {
          const std::vector<int>& loop = added.matings[i].loop;
          EXPECT_EQ(loop.empty(), i == 0);
          if (loop.empty()) continue;
          ++closing;
          EXPECT_EQ(loop.front(), added.module);
          EXPECT_EQ(loop.back(), added.matings[i].standing);
          EXPECT_EQ(std::set<int>(loop.begin(), loop.end()).size(), loop.size());
          for (size_t k = 0; k + 1 < loop.size(); ++k) {
            EXPECT_TRUE(joined.contains(std::minmax(loop[k], loop[k + 1])));
          }
        }
      }
      // A tree of n modules has n - 1 connections; each further one closes a loop.
      EXPECT_EQ(closing, std::ssize(robot.dockings) - std::ssize(robot.modules) + 1);
      loops += closing;
    }
  }
  EXPECT_GT(loops, 3);
}

TEST(AssemblyPlanTest, ARobotGrowsFromItsRoot) {
  const auto models = ShippedModels();
  const Model& model = models.at("mtran.m3l");
  const Robot& robot = *model.FindRobot("quadruped");
  std::vector<std::string> order;
  for (const AddedModule& added : PlanAssembly(model, robot).modules) {
    order.push_back(robot.modules[added.module].name);
  }
  // First the junction, then what is on it, then the feet.
  EXPECT_EQ(order,
            (std::vector<std::string>{"m5", "m2", "m3", "m7", "m8", "m1", "m4", "m6", "m9"}));
}

TEST(AssemblyPlanTest, TurnsAreThoseThatRotCounts) {
  // From both ends: the turn is anticlockwise to whoever looks at the standing face, whichever of
  // the two plays member a.
  for (const int rot : {-90, 0, 90, 180}) {
    for (const char* ends : {"m1.c2, m2.c5", "m2.c5, m1.c2", "m1.c5, m2.c2", "m1.c6, m2.c3"}) {
      const Model model = Pair("(" + std::string(ends) + ", rot=" + std::to_string(rot) + ")");
      const AssemblyPlan plan = PlanAssembly(model, *model.FindRobot("pair"));
      const Mating& mating = plan.modules[1].matings.front();
      ASSERT_TRUE(mating.turn) << ends;
      EXPECT_TRUE(mating.turn->signed_);
      EXPECT_NEAR(mating.turn->degrees, rot, 1e-6) << ends;
      EXPECT_EQ(mating.ways.size(), 4u);
    }
  }
}

TEST(AssemblyPlanTest, AQuarterTurnIsAnticlockwiseAsOneLooksAtTheStandingFace) {
  // The added module's c1 before and after the turn, in the frame of the standing one.
  const auto face_of_c1 = [](const std::string& rot) {
    const Model model = Pair("(m1.c2, m2.c5, rot=" + rot + ")");
    return *PlanAssembly(model, *model.FindRobot("pair")).faces_R[1][0];
  };
  const Eigen::Vector3d before = face_of_c1("0"), after = face_of_c1("90");
  // c2 of the standing module faces south (-x); whoever looks at it looks north.
  const Eigen::Vector3d out = -Eigen::Vector3d::UnitX();
  EXPECT_LT((out.cross(before) - after).norm(), 1e-6);
}

TEST(AssemblyPlanTest, WhatFacesTheSameWayDoes) {
  // m8 lies as m5 does, so that each of its connectors faces as that of the same name; those along
  // the line between the two are left out.
  const auto models = ShippedModels();
  const Model& model = models.at("mtran.m3l");
  const Robot& robot = *model.FindRobot("quadruped");
  const int m8 = *robot.FindModule("m8");
  const ModuleType& type = model.TypeOf(robot, m8);
  const AssemblyPlan plan = PlanAssembly(model, robot);
  for (const AddedModule& added : plan.modules) {
    if (added.module != m8) continue;
    ASSERT_EQ(added.matings.size(), 2u);
    std::set<std::pair<std::string, std::string>> names;
    for (const auto& [i, j] : added.matings[0].same_way) {
      names.insert({type.connectors[i].name, type.connectors[j].name});
    }
    EXPECT_EQ(names, (std::set<std::pair<std::string, std::string>>{{"c2", "c2"}, {"c5", "c5"}}));
  }
}

TEST(AssemblyPlanTest, PointsMeetAsTheNumberSays) {
  // 53 is the default of c2 on c5, with _1 on _3; 55 has _1 on _1.
  const auto points = [](const std::string& number) {
    const Model model = Pair("(m1.c2, m2.c5, " + number + ")");
    return PlanAssembly(model, *model.FindRobot("pair")).modules[1].matings.front().points;
  };
  using Points = std::vector<std::pair<int, int>>;
  EXPECT_EQ(points("53"), (Points{{0, 2}, {1, 1}, {2, 0}, {3, 3}}));
  EXPECT_EQ(points("55").front(), (std::pair<int, int>{0, 0}));
  EXPECT_EQ(points("55").size(), 4u);
}

TEST(AssemblyPlanTest, FacesThatLookAtEachOtherAreEnteredFromTheSide) {
  const auto models = ShippedModels();
  const Model& model = models.at("ckbot.m3l");
  const AssemblyPlan plan = PlanAssembly(model, *model.FindRobot("loop"));
  // The last module of a ring has a face on either side.
  EXPECT_EQ(plan.modules.back().matings.size(), 2u);
  for (const Mating& mating : plan.modules.back().matings) {
    const auto& face = plan.faces_R[mating.standing][mating.standing_connector];
    ASSERT_TRUE(face);
    EXPECT_GT(face->dot(plan.modules.back().from_R), -1e-9) << "it does not come through a face";
  }
}

}  // namespace
}  // namespace morphbus::model
