// The generated controllers of a whole robot, over a Webots that is faked: what they sense is what
// modules sense in the project's own ideal world, and with a program they do what they do there.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "compiler/emit/webots.h"
#include "test/compiler/emit/compiled_c.h"
#include "test/compiler/emit/compiled_controllers.h"
#include "test/compiler/emit/exported_robots.h"
#include "test/compiler/emit/fake_webots.h"
#include "test/support/compiled.h"
#include "test/support/source_dir.h"
#include "test/support/vm_robot.h"

namespace morphbus::emit {
namespace {

using test::FakeWebots;
using test::VmRobot;

constexpr int kPeriodMs = 20;

/// As in morphbus_module.h.
struct Reading {
  int docked, mate_module, mate_connector, connection_type, number, is_member_b;
};

/// The controller of one module: the wrapper, compiled.
class Controller {
 public:
  Controller(FakeWebots* world, const model::Model& model, int type, int module)
      : world_(world),
        module_(module),
        c_(Source(model, type), "morphbus_module",
           "-isystem " + test::SourcePath("test/export/webots_stub")) {
    Enter();
    Function<void(int)>("module_start")(kPeriodMs);
  }

  void Enter() { world_->Enter(module_); }

  template <typename Signature>
  Signature* Function(const std::string& name) const {
    return reinterpret_cast<Signature*>(c_.Find(name));
  }

  Reading Read(int connector) {
    Enter();
    Reading reading{};
    Function<void(int, Reading*)>("module_read_connector")(connector, &reading);
    return reading;
  }

  /// Sends, and reads what came in: what module_step does on either side of Webots' own step.
  void Step() {
    Enter();
    EXPECT_EQ(Function<int()>("module_step")(), 1);
  }

 private:
  static Exported Source(const model::Model& model, int type) {
    Exported exported;
    exported.companions = WebotsController(model, DockFacesOf(model), type).value().files;
    const auto source =
        std::ranges::find(exported.companions, "morphbus_module.c", &CompanionFile::path);
    exported.text = source->bytes;
    return exported;
  }

  FakeWebots* world_;
  int module_;
  test::CompiledC c_;
};

/// All controllers of a robot.
class Controllers {
 public:
  Controllers(const model::Model& model, const model::Robot& robot) : world_(model, robot) {
    for (size_t m = 0; m < robot.modules.size(); ++m) {
      all_.push_back(
          std::make_unique<Controller>(&world_, model, robot.modules[m].type, static_cast<int>(m)));
    }
  }

  /// All modules go on for a period. Their sending and hearing fall into one call, so what is sent
  /// in a period is heard in the next but one, where Webots takes one.
  void Step() {
    for (auto& controller : all_) controller->Step();
    world_.Step(kPeriodMs);
  }

  Controller& at(int m) { return *all_[static_cast<size_t>(m)]; }

 private:
  FakeWebots world_;
  std::vector<std::unique_ptr<Controller>> all_;
};

struct Case {
  const char* file;
  const char* robot;
  const char* unit = "";  ///< Another size, in place of molecube.m3l's.
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.file << ' ' << c.robot << c.unit; }

model::Model ModelOf(const Case& c) {
  if (*c.unit == 0) return test::ModelFrom(c.file);
  std::string text = test::TextOf(c.file);
  const std::string unit = "unit=0.05";
  text.replace(text.find(unit), unit.size(), c.unit);
  return test::CompiledCase(text, c.robot).model;
}

class WebotsSensors : public testing::TestWithParam<Case> {};

// Both sides of each docking, also the passive, also of unlike types, at once and by number.
TEST_P(WebotsSensors, KnowEveryMateByItsNumber) {
  const model::Model model = ModelOf(GetParam());
  const model::Robot& robot = *model.FindRobot(GetParam().robot);
  const std::vector<uint8_t> nothing = test::EmptyProgram();
  VmRobot ideal(model, robot, nothing);
  ideal.Tick();
  Controllers controllers(model, robot);
  for (int i = 0; i < 4; ++i) controllers.Step();
  int docked = 0;
  for (int m = 0; m < ideal.size(); ++m) {
    const auto connectors = model.TypeOf(robot, m).connectors.size();
    for (size_t c = 0; c < connectors; ++c) {
      SCOPED_TRACE(robot.modules[static_cast<size_t>(m)].name + " " + std::to_string(c));
      const vm::ConnectorReading& expected = ideal.state(m).neighbours[c].sensor;
      const Reading reading = controllers.at(m).Read(static_cast<int>(c));
      ASSERT_EQ(reading.docked != 0, expected.docked);
      if (!expected.docked) continue;
      ++docked;
      EXPECT_EQ(reading.mate_module, expected.mate_module - 1);  // There, ids begin at 1.
      EXPECT_EQ(reading.mate_connector, expected.mate_connector);
      EXPECT_EQ(reading.connection_type, expected.connection_type);
      EXPECT_EQ(reading.number, expected.number);
      EXPECT_EQ(reading.is_member_b != 0, expected.is_member_b);
    }
  }
  EXPECT_EQ(docked, 2 * static_cast<int>(robot.dockings.size()));
}

INSTANTIATE_TEST_SUITE_P(Robots, WebotsSensors,
                         testing::Values(Case{"models/mtran.m3l", "quadruped"},
                                         Case{"models/mtran.m3l", "equivalent_quadruped"},
                                         Case{"models/atron.m3l", "car7"},
                                         Case{"models/molecube.m3l", "snake"},
                                         // Cubes of 10 mm, and of 1 mm.
                                         Case{"models/molecube.m3l", "snake", "unit=0.005"},
                                         Case{"models/molecube.m3l", "snake", "unit=0.0005"},
                                         Case{"models/ckbot.m3l", "snake"},
                                         Case{"models/mixed.m3l", "inchworm"}));

/// The targets of a joint in turn, without the times.
using Targets = std::vector<double>;
void Note(double target, Targets* targets) {
  if (targets->empty() || target != targets->back()) targets->push_back(target);
}

/// The last role that each module said it had taken: {"m1", "Leg"}.
std::map<std::string, std::string> RolesSaid(const std::string& console) {
  std::map<std::string, std::string> roles;
  std::istringstream lines(console);
  for (std::string line; std::getline(lines, line);) {
    const size_t at = line.find(": role ");
    if (at != std::string::npos) roles[line.substr(0, at)] = line.substr(at + 7);
  }
  return roles;
}

TEST(WebotsController, WalksTheQuadrupedByItsProgram) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const model::Robot& robot = *model.FindRobot("quadruped");
  const std::vector<uint8_t> image =
      test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), model);
  constexpr int kTicks = 1000;
  // What the modules do in an ideal world.
  test::VmRobotOptions options;
  options.instant_servo = true;
  VmRobot ideal(model, robot, image, options);
  std::vector<Targets> expected(18, {0.0});
  for (int i = 0; i < kTicks; ++i) {
    ideal.Tick();
    for (int j = 0; j < 18; ++j) Note(ideal.output(j / 2).joints[j % 2].target, &expected[j]);
  }
  // What they do by the controllers that belong to the world.
  const Exported world =
      ToWebots(model, robot,
               {.controllers = "controllers", .program = std::string(image.begin(), image.end())})
          .value();
  FakeWebots webots(model, robot);
  test::CompiledControllers controllers(world, robot.modules.size());
  std::vector<Targets> actual(18, {0.0});
  testing::internal::CaptureStdout();
  webots.Run(controllers.mains(), kTicks, [&] {
    for (int j = 0; j < 18; ++j) {
      const FakeWebots::Module& module = webots.modules()[static_cast<size_t>(j / 2)];
      const auto motor = module.motors.find("joint_" + std::to_string(j % 2 + 1));
      if (motor != module.motors.end()) Note(motor->second.position, &actual[j]);
    }
  });
  const std::map<std::string, std::string> roles =
      RolesSaid(testing::internal::GetCapturedStdout());
  for (int m = 0; m < 9; ++m) {
    const int role = ideal.output(m).status.role;
    ASSERT_GE(role, 0);
    const vm::Text name = ideal.program().role(role).name;
    EXPECT_EQ(roles.at(robot.modules[static_cast<size_t>(m)].name),
              std::string(name.data, name.size));
  }
  size_t steps = 0;
  for (size_t at = 0; at < 18; ++at) {
    // Messages take a period more here, so the run may end within a step.
    const size_t both = std::min(expected[at].size(), actual[at].size());
    EXPECT_LE(std::max(expected[at].size(), actual[at].size()), both + 2);
    for (size_t k = 0; k < both; ++k) EXPECT_EQ(actual[at][k], expected[at][k]);
    steps += both - 1;
  }
  EXPECT_GT(steps, 50u);
}

TEST(WebotsController, ReachesNoFartherThanMates) {
  const model::Model model = test::ModelFrom("models/molecube.m3l");
  EXPECT_DOUBLE_EQ(DockScaleOf(model).reach, 0.01);
  EXPECT_DOUBLE_EQ(DockScaleOf(model).emitter_offset, 0.002);
  const model::Model small = ModelOf({"models/molecube.m3l", "snake", "unit=0.005"});
  // Centres of neighbouring faces are 5 mm times the root of 2 apart.
  EXPECT_NEAR(DockScaleOf(small).reach, 0.005 * std::sqrt(2.0) / 3.0, 1e-12);
  const Exported world =
      ToWebots(small, *small.FindRobot("snake"), {.controllers = "controllers"}).value();
  EXPECT_EQ(world.warnings, std::vector<std::string>());
  EXPECT_NE(world.text.find("c1.emitter\" range 0.0023570"), std::string::npos);
  EXPECT_NE(world.text.find("distanceTolerance 0.0023570"), std::string::npos);
  EXPECT_EQ(world.text.find("range 0.01"), std::string::npos);
}

// c1 to c3 of an M-TRAN module have hooks; m2.c2 holds m1.c5.
TEST(WebotsController, PartsAndJoinsModulesByStates) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const model::Robot& robot = *model.FindRobot("quadruped");
  Controllers controllers(model, robot);
  const model::Docking& docking = robot.dockings.front();
  const bool a_is_active =
      !model.module_types[0].connectors[static_cast<size_t>(docking.connector_a)].states.empty();
  const int active = a_is_active ? docking.module_a : docking.module_b;
  const int hooks = a_is_active ? docking.connector_a : docking.connector_b;
  const int passive = a_is_active ? docking.module_b : docking.module_a;
  const int bars = a_is_active ? docking.connector_b : docking.connector_a;
  const auto steps = [&] {
    for (int i = 0; i < 4; ++i) controllers.Step();
  };
  const auto command = [&](int value) {
    controllers.at(active).Enter();
    controllers.at(active).Function<void(int, int, int)>("module_command_connector")(hooks, 0,
                                                                                     value);
    steps();
  };
  const auto docked = [&](int module, int connector) {
    return controllers.at(module).Read(connector).docked;
  };
  const auto sees = [&](int module, int connector) {
    return controllers.at(module).Function<int(int)>("module_sees_mate")(connector);
  };
  steps();
  EXPECT_EQ(docked(active, hooks), 1);
  EXPECT_EQ(docked(passive, bars), 1);
  command(0);
  EXPECT_EQ(docked(active, hooks), 0);
  EXPECT_EQ(docked(passive, bars), 0);
  EXPECT_EQ(controllers.at(passive).Read(bars).number, 0);
  EXPECT_EQ(sees(active, hooks), 1);
  EXPECT_EQ(sees(passive, bars), 1);
  command(1);
  EXPECT_EQ(docked(active, hooks), 1);
  EXPECT_EQ(docked(passive, bars), 1);
}

}  // namespace
}  // namespace morphbus::emit
