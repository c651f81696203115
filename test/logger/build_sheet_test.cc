#include "logger/show/build_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "logger/show/build_pictures.h"
#include "test/support/large_robots.h"
#include "test/support/shipped_models.h"
#include "test/support/source_dir.h"

namespace morphbus::logger {
namespace {

using Eigen::Vector3d;

/// A robot with its plan and check poses, which live as long as this.
struct Planned {
  explicit Planned(const model::Model& of, const std::string& name)
      : model(of),
        robot(*model.FindRobot(name)),
        plan(model::PlanAssembly(model, robot)),
        poses(solver::FindCheckPoses(model, robot, plan)),
        assembly{model, robot, plan} {}
  model::Model model;
  const model::Robot& robot;
  model::AssemblyPlan plan;
  solver::CheckPoses poses;
  Assembly assembly;
};

Planned Shipped(const std::string& file, const std::string& robot) {
  return Planned(test::ShippedModels().at(file), robot);
}

/// All that a block says.
std::string TextOf(const SheetBlock& block) {
  std::string text = block.heading;
  for (const std::string& line : block.lines) text += "\n" + line;
  return text;
}

const SheetPart& PartCalled(const Sheet& sheet, const std::string& heading) {
  return *std::ranges::find(sheet.parts, heading, &SheetPart::heading);
}

void Ignore(double /*part*/) {}

TEST(BuildWordsTest, DirectionsAndTurnsAreThoseOfAPerson) {
  EXPECT_EQ(DirectionWords({1, 0, 0}), "north");
  EXPECT_EQ(DirectionWords({0, -1, 0}), "down");
  EXPECT_EQ(DirectionWords(Vector3d(0, 0.3, -1).normalized()), "west");
  EXPECT_EQ(DirectionWords(Vector3d(1, 1, 0).normalized()), "north and up");
  EXPECT_EQ(DirectionWords(Vector3d(-1, 1, 1).normalized()), "south, up and east");
  EXPECT_EQ(TurnWords({180, true}), "half a turn");
  EXPECT_EQ(TurnWords({90, true}), "a quarter turn anticlockwise");
  EXPECT_EQ(TurnWords({-90, true}), "a quarter turn clockwise");
  EXPECT_EQ(TurnWords({-120, true}), "a third of a turn clockwise");
  EXPECT_EQ(TurnWords({50, true}), "a turn of 50° anticlockwise");
  EXPECT_EQ(TurnWords({90, false}), "a quarter turn to one side");
  model::Joint slide;
  slide.type = model::JointType::kPrismatic;
  EXPECT_EQ(ValueWords(slide, 0.0325), "32.5 mm");
  EXPECT_EQ(ValueWords({}, -EIGEN_PI / 4), "-45°");
  EXPECT_EQ(ListWords({"a", "b", "c"}), "a, b and c");
}

TEST(BuildWordsTest, WhatASheetSaysTellsTheWaysOfMatingApart) {
  // But for the number: a person sees from connectors, axes and points which of the ways it is.
  int compared = 0;
  for (const auto& [file, model] : test::ShippedModels()) {
    for (const model::Robot& robot : model.robots) {
      const auto said = [&shipped = model](const model::Robot& one, size_t added) {
        const model::AssemblyPlan plan = model::PlanAssembly(shipped, one);
        std::vector<std::string> lines = WayLines({shipped, one, plan}, plan.modules[added].module,
                                                  plan.modules[added].matings.front());
        lines.erase(lines.begin());
        return lines;
      };
      const model::AssemblyPlan plan = model::PlanAssembly(model, robot);
      for (size_t i = 1; i < plan.modules.size(); ++i) {
        const model::Mating& mating = plan.modules[i].matings.front();
        std::set<std::vector<std::string>> texts;
        for (const int number : mating.ways) {
          model::Robot other = robot;
          other.dockings[mating.docking].option = number - 1;
          texts.insert(said(other, i));
        }
        EXPECT_EQ(texts.size(), mating.ways.size())
            << file << " " << robot.name << " " << robot.modules[plan.modules[i].module].name;
        compared += static_cast<int>(mating.ways.size()) - 1;
      }
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(BuildWordsTest, AnAxisPointsElsewhereWhenAModuleIsHalfATurnRound) {
  // The module has nothing else across the line on which it mates, and no points with names.
  const model::Model model = test::DirectedModel("", R"(
module LIMB: unit=0.1
point front: coords=(1,0,0), connector, normal=(1,0,0)
point back: coords=(-1,0,0), connector, normal=(-1,0,0)
link upper: grouping=(front), hull=box(size=(1,1,1),at=(.5,0,0)), mass=0.2
link lower: grouping=(back), hull=box(size=(1,1,1),at=(-.5,0,0)), mass=0.2
axis ax: origin=(0,0,0), direction=(0,0,1)
axis ay: origin=(0,0,0), direction=(0,0,-1)
axis up: origin=(0,0,0), direction=(0,1,0)
joint knee: type=revolute, value=[-90deg,90deg], pair=((upper,ax),(lower,ay))
connection PLUG: members=(LIMB a, LIMB b), conditions=(
  a.front coincident b.back and a.front antiparallel b.back
  and (a.up parallel b.up or a.up antiparallel b.up))
robot one: modules=(LIMB m1, LIMB m2), connections=((m1.front,m2.back,1))
robot two: modules=(LIMB m1, LIMB m2), connections=((m1.front,m2.back,2))
)");
  std::set<std::string> said;
  for (const model::Robot& robot : model.robots) {
    const model::AssemblyPlan plan = model::PlanAssembly(model, robot);
    said.insert(WayLines({model, robot, plan}, 1, plan.modules[1].matings.front()).back());
  }
  EXPECT_EQ(said, (std::set<std::string>{"Then the axis of m2.knee points east, about which upper "
                                         "turns anticlockwise at positive values.",
                                         "Then the axis of m2.knee points west, about which upper "
                                         "turns anticlockwise at positive values."}));
}

TEST(BuildSheetTest, TheQuadrupedIsBuiltInNineSteps) {
  const Planned quadruped = Shipped("mtran.m3l", "quadruped");
  const Sheet sheet = BuildSheet(quadruped.assembly, quadruped.poses);
  const SheetPart& steps = PartCalled(sheet, "Steps");
  ASSERT_EQ(steps.blocks.size(), 9u);
  EXPECT_EQ(steps.blocks[0].heading, "Step 1 of 9: m5 (MTRAN)");
  EXPECT_EQ(
      steps.blocks[0].lines.back(),
      "Lay m5 down so that m5.c1 faces east, m5.c2 faces south, m5.c3 faces west, m5.c4 faces "
      "west, m5.c5 faces north and m5.c6 faces east.");
  // m8 is mated in number 35 and closes a loop.
  const auto m8 = std::ranges::find_if(
      steps.blocks, [](const SheetBlock& b) { return b.heading.ends_with(": m8 (MTRAN)"); });
  ASSERT_NE(m8, steps.blocks.end());
  EXPECT_EQ(
      TextOf(*m8),
      m8->heading +
          "\nSet all joints of m8 to 0."
          "\nPut m8.c4 (no. 2) on m5.c1 (no. 1) and m8.c5 (no. 4) on m7.c2 (no. 3), all at once."
          "\nWhich way round m8.c4 lies: number 35 of MTRAN_to_MTRAN, half a turn from number 33, "
          "the "
          "first of the 4 ways of these two (33, 34, 35, 36)."
          "\nThen m8.c2 faces south, as m5.c2 does; m8.c5 faces north, as m5.c5 does."
          "\nPoints of m8.c4 that meet those of m5.c1: _1 on _1, _2 on _4, _3 on _3, _4 on _2."
          "\nTo join them, set m5.c1 extended = true."
          "\nWhich way round m8.c5 lies: number 53 of MTRAN_to_MTRAN, the first of the 4 ways of "
          "these two (53, 54, 55, 56)."
          "\nTo join them, set m7.c2 extended = true."
          "\nm8.c5 on m7.c2 closes a loop: m8 – m5 – m7.");
  EXPECT_EQ(PartCalled(sheet, "Loops").blocks[0].table->rows.size(), 2u);
  // Poses, and the table of joints.
  const SheetPart& check = PartCalled(sheet, "Check it");
  EXPECT_EQ(check.blocks.size(), 3u);
  EXPECT_EQ(check.blocks.back().table->rows.size(), 18u);
}

TEST(BuildSheetTest, AStepsPictureMarksTheTwoConnectorsThatMate) {
  const Planned snake = Shipped("mtran_robots.m3l", "snake");
  for (size_t i = 1; i < snake.plan.modules.size(); ++i) {
    const model::AddedModule& added = snake.plan.modules[i];
    const SheetPicture picture = StepPicture(snake.assembly, {&added, 1}, 1);
    const Scene& scene = picture.drawing.panels[0].scene;
    const auto mark = [&](const std::string& text) {
      return *std::ranges::find(scene.marks, text, &SceneMark::text);
    };
    // The first is where the standing connector is, the second is drawn off along its way.
    const model::Mating& mating = added.matings[0];
    const model::Connector& standing =
        snake.assembly.TypeOf(mating.standing).connectors[mating.standing_connector];
    const Vector3d p_R = snake.plan.X_RL[mating.standing][standing.link] * standing.p_MoCo_M;
    EXPECT_LT((mark("1").p_W - p_R).norm(), 1e-9);
    const Vector3d off = mark("2").p_W - p_R;
    EXPECT_GT(off.norm(), 0.02);
    EXPECT_LT(off.cross(added.from_R).norm(), 1e-9);
    EXPECT_GT(off.dot(added.from_R), 0.0);
    ASSERT_EQ(scene.lines.size(), 1u);
    // Of two faces that look at each other at most one looks at the viewer.
    EXPECT_FALSE(mark("1").kind == SceneMark::Kind::kDot &&
                 mark("2").kind == SceneMark::Kind::kDot);
    // Only the new module has its colours; what stands is pale.
    double least_new = 1.0, most_standing = 0.0;
    for (const SceneHull& hull : scene.hulls) {
      const auto [low, high] = std::ranges::minmax(hull.color);
      if (hull.owner == static_cast<int>(i)) {
        least_new = std::min(least_new, 1.0 - (high - low));
      } else {
        most_standing = std::max(most_standing, high - low);
      }
    }
    EXPECT_LT(most_standing, 0.2);
    EXPECT_LT(least_new, 0.7);
  }
}

TEST(BuildSheetTest, APictureOfATypeNamesThePointsThatStepsSpeakOf) {
  const auto small = [](const Planned& planned) {
    std::vector<std::string> texts;
    for (const Panel& panel : TypePicture(planned.model, 0).drawing.panels) {
      for (const SceneMark& mark : panel.scene.marks) {
        if (mark.kind == SceneMark::Kind::kSmallText) texts.push_back(mark.text);
      }
    }
    return texts;
  };
  // Each of M-TRAN's six connectors is seen from one of the two corners, with its four points.
  const std::vector<std::string> mtran = small(Shipped("mtran.m3l", "quadruped"));
  EXPECT_EQ(mtran.size(), 24u);
  EXPECT_EQ(std::ranges::count(mtran, "_3"), 6);
  // Of ATRON's eight, four are seen so much from the side that names would lie on each other.
  EXPECT_EQ(small(Shipped("atron.m3l", "car")).size(), 12u);
}

TEST(BuildSheetTest, NothingIsBehindTheCompassAndTheScaleBar) {
  const Planned crane = Shipped("pairs.m3l", "crane");
  const Sheet sheet = BuildSheet(crane.assembly, crane.poses);
  for (const SheetPart& part : sheet.parts) {
    for (const SheetBlock& block : part.blocks) {
      if (!block.picture) continue;
      for (const Panel& panel : block.picture->drawing.panels) {
        Panel bodies = panel;
        bodies.extent.reset();
        const double above = panel.extent->max().y() - ExtentOf(bodies).max().y();
        EXPECT_GT(above, 0.1 * panel.extent->sizes().x()) << block.heading;
      }
    }
  }
}

TEST(BuildSheetTest, OneOfAThingIsToldAsOne) {
  const Planned alone(test::DirectedModel("", R"(
module HOOK: unit=0.1
point hitch: coords=(1,0,0), connector, normal=(1,0,0)
link body: grouping=(hitch), hull=box(size=(1,1,1),at=(.5,0,0)), mass=0.2
robot one: modules=(HOOK m1)
)"),
                      "one");
  const Sheet sheet = BuildSheet(alone.assembly, alone.poses);
  const SheetPart& needed = PartCalled(sheet, "What is needed");
  EXPECT_EQ(needed.paragraphs[0], "1 module and 0 connections; 0 of 1 connector used, 1 free.");
  EXPECT_EQ(needed.blocks[0].lines[1], "Its connector is hitch: mark it as the picture has it.");
}

TEST(BuildSheetTest, ManyModulesHaveFewStepsAndEachModuleOnce) {
  const Planned large(test::DirectedModel(test::SourcePath("models/large.m3l"),
                                          test::LargeRobotText(test::LargeShape::kTree, 500)),
                      "large");
  const auto steps = StepsOf(large.plan);
  EXPECT_LE(std::ssize(steps), kMostBuildSteps);
  std::set<int> modules;
  for (const auto& step : steps) {
    for (const model::AddedModule& added : step) modules.insert(added.module);
  }
  EXPECT_EQ(modules.size(), 500u);
  // A picture has a bounded number of bodies, however many stand.
  const SheetPicture last = StepPicture(large.assembly, steps.back(), 1);
  std::set<int> drawn;
  for (const SceneHull& hull : last.drawing.panels[0].scene.hulls) drawn.insert(hull.owner);
  EXPECT_LE(drawn.size(), 60u);
}

TEST(SheetTest, PageAndPaperSayTheSame) {
  const Planned car = Shipped("atron.m3l", "car");
  const Sheet sheet = BuildSheet(car.assembly, car.poses);
  const std::string html = SheetHtml(sheet, Ignore);
  size_t pictures = 0;
  for (const SheetPart& part : sheet.parts) {
    for (const SheetBlock& block : part.blocks) {
      EXPECT_NE(html.find(">" + block.heading + "<"), std::string::npos);
      pictures += block.picture ? 1 : 0;
    }
  }
  size_t found = 0;
  for (size_t at = html.find("<picture>"); at != std::string::npos;
       at = html.find("<picture>", at + 1)) {
    ++found;
  }
  EXPECT_EQ(found, pictures);
  const Result<std::string> pdf = SheetPdf(sheet, Ignore);
  ASSERT_TRUE(pdf);
  EXPECT_TRUE(pdf->starts_with("%PDF-1."));
  EXPECT_EQ(*pdf, *SheetPdf(sheet, Ignore)) << "the same sheet, the same bytes";
}

TEST(SheetTest, WhatDoesNotFitOnAPageGoesOnOnTheNext) {
  Sheet sheet;
  sheet.title = "long";
  SheetTable table = {{"name", "#value"}, {}};
  for (int i = 0; i < 200; ++i) table.rows.push_back({"row " + std::to_string(i), "1"});
  SheetBlock block;
  block.heading = "a table";
  std::string angles;
  for (int i = 0; i < 200; ++i) angles += "120°";
  block.lines = {std::string(3000, 'w'), angles, "and a line"};
  block.table = table;
  sheet.parts.push_back({"part", {}, {block}});
  const Result<std::string> pdf = SheetPdf(sheet, Ignore);
  ASSERT_TRUE(pdf);
  size_t pages = 0;
  for (size_t at = pdf->find("/Type /Page % "); at != std::string::npos;
       at = pdf->find("/Type /Page % ", at + 1)) {
    ++pages;
  }
  EXPECT_GE(pages, 4u);
  EXPECT_LE(pages, 8u);
}

}  // namespace
}  // namespace morphbus::logger
