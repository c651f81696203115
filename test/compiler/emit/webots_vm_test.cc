// The virtual machines of a whole robot on the generated controllers, over a Webots that is faked:
// each senses, drives and hears through the wrapper alone. What they then know and do is what they
// know and do in the project's own ideal world.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "compiler/emit/kinematics.h"
#include "compiler/emit/webots.h"
#include "test/compiler/emit/compiled_c.h"
#include "test/compiler/emit/exported_robots.h"
#include "test/compiler/emit/fake_webots.h"
#include "test/support/compiled.h"
#include "test/support/source_dir.h"
#include "test/support/vm_robot.h"
#include "vm/vm.h"

namespace morphbus::emit {
namespace {

using test::FakeWebots;
using test::VmRobot;

constexpr int kPeriodMs = 20;
constexpr int kMaxMessage = 4096;  // MODULE_MAX_MESSAGE
static_assert(sizeof(vm::NeighbourMessage) <= kMaxMessage);

/// As in morphbus_module.h.
struct Reading {
  int docked, mate_module, mate_connector, connection_type, number, is_member_b;
};

/// The controller of one module: the wrapper, compiled, with a VM on top.
class Controller {
 public:
  Controller(FakeWebots* world, const model::Model& model, int type,
             const vm::VerifiedKinematics& kinematics, const vm::VerifiedProgram* program,
             int module)
      : world_(world),
        module_(module),
        kinematics_(kinematics),
        c_(Source(model, type), "morphbus_module",
           "-isystem " + test::SourcePath("test/export/webots_stub")) {
    Enter();
    Function<void(int)>("module_start")(kPeriodMs);
    int root_link = 0;
    double pose[7] = {0, 0, 0, 1, 0, 0, 0};
    vm::VmConfig config;
    config.module_id = static_cast<uint16_t>(Function<int()>("module_id")());
    config.is_root = Function<int(int*, double*)>("module_is_root")(&root_link, pose) != 0;
    config.root_link = static_cast<uint8_t>(root_link);
    const auto f = [&](int k) { return static_cast<float>(pose[k]); };
    config.X_RL_root = {{f(0), f(1), f(2)}, {f(3), f(4), f(5), f(6)}};
    if (program != nullptr) {
      vm_ = std::make_unique<vm::Vm>(config, kinematics_, *program, &state_);
    }
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

  /// A tick of the VM: fills TickInput from the wrapper, and hands TickOutput over.
  void Tick(int64_t tick) {
    Enter();
    vm::TickInput input;
    input.tick = tick;
    input.sim_time_us = Function<int64_t()>("module_time_us")();
    for (int j = 0; j < kinematics_.num_joints(); ++j) {
      input.joint_position[j] = Function<double(int)>("module_joint")(j);
      input.joint_velocity[j] = Function<double(int)>("module_joint_velocity")(j);
    }
    std::vector<vm::NeighbourMessage> messages(vm::kMaxConnectors);
    for (int c = 0; c < kinematics_.num_connectors(); ++c) {
      const Reading r = Read(c);
      input.connectors[c] = {r.docked != 0,
                             static_cast<uint16_t>(r.mate_module),
                             static_cast<uint8_t>(r.mate_connector),
                             static_cast<uint8_t>(r.connection_type),
                             static_cast<uint16_t>(r.number),
                             r.is_member_b != 0};
      vm::NeighbourMessage& message = messages[static_cast<size_t>(c)];
      const int size = Function<int(int, void*, int)>("module_receive")(
          c, &message, static_cast<int>(sizeof message));
      if (size == static_cast<int>(sizeof message)) input.messages[c] = &message;
    }
    vm_->Tick(input, &output_);
    for (int j = 0; j < kinematics_.num_joints(); ++j) {
      const vm::JointCommand& command = output_.joints[j];
      Function<void(int, int, double, double)>("module_command_joint")(
          j, static_cast<int>(command.mode), command.target, command.speed);
    }
    for (int i = 0; i < output_.num_connector_commands; ++i) {
      const vm::ConnectorCommand& command = output_.connector_commands[i];
      Function<void(int, int, int)>("module_command_connector")(command.connector, command.state,
                                                                command.value);
    }
    for (int c = 0; c < kinematics_.num_connectors(); ++c) {
      EXPECT_EQ(Function<int(int, const void*, int)>("module_send")(
                    c, &output_.message, static_cast<int>(sizeof output_.message)),
                1);
    }
  }

  [[nodiscard]] const vm::VmState& state() const { return state_; }
  [[nodiscard]] const vm::TickOutput& output() const { return output_; }

 private:
  static Exported Source(const model::Model& model, int type) {
    const std::vector<CompanionFile> files =
        WebotsController(model, DockFacesOf(model), type).files;
    Exported exported;
    exported.text = files.at(1).bytes;
    exported.companions = {files.at(0)};
    return exported;
  }

  FakeWebots* world_;
  int module_;
  const vm::VerifiedKinematics& kinematics_;
  test::CompiledC c_;
  vm::VmState state_;
  vm::TickOutput output_;
  std::unique_ptr<vm::Vm> vm_;
};

/// All controllers of a robot.
class Controllers {
 public:
  Controllers(const model::Model& model, const model::Robot& robot,
              const vm::VerifiedProgram* program = nullptr)
      : world_(model, robot) {
    for (size_t t = 0; t < model.module_types.size(); ++t) {
      images_.push_back(*KinematicsImage(model, static_cast<int>(t), 0));
      kinematics_.emplace_back();
    }
    for (size_t t = 0; t < images_.size(); ++t) {
      EXPECT_EQ(vm::VerifyKinematics(reinterpret_cast<const uint8_t*>(images_[t].data()),
                                     static_cast<uint32_t>(images_[t].size()), &kinematics_[t])
                    .message,
                nullptr);
    }
    for (size_t m = 0; m < robot.modules.size(); ++m) {
      const int type = robot.modules[m].type;
      all_.push_back(std::make_unique<Controller>(&world_, model, type,
                                                  kinematics_[static_cast<size_t>(type)], program,
                                                  static_cast<int>(m)));
    }
  }

  /// All modules go on for a period. Their sending and hearing fall into one call, so what is sent
  /// in a period is heard in the next but one, where Webots takes one.
  void Step() {
    for (auto& controller : all_) controller->Step();
    world_.Step(kPeriodMs);
  }
  void Tick(int count) {
    for (int i = 0; i < count; ++i) {
      Step();
      for (auto& controller : all_) controller->Tick(tick_);
      ++tick_;
    }
  }

  Controller& at(int m) { return *all_[static_cast<size_t>(m)]; }
  FakeWebots& world() { return world_; }

 private:
  FakeWebots world_;
  std::vector<std::string> images_;
  std::vector<vm::VerifiedKinematics> kinematics_;
  std::vector<std::unique_ptr<Controller>> all_;
  int64_t tick_ = 0;
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

TEST(WebotsController, LetsVirtualMachinesWalkTheQuadruped) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const model::Robot& robot = *model.FindRobot("quadruped");
  const std::vector<uint8_t> image =
      test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), model);
  test::VmRobotOptions options;
  options.instant_servo = true;
  VmRobot ideal(model, robot, image, options);
  Controllers controllers(model, robot, &ideal.program());
  // Targets in turn, without the times: messages take a period more here.
  std::vector<std::vector<double>> expected(18, {0.0});
  std::vector<std::vector<double>> actual(18, {0.0});
  const auto note = [](std::vector<double>* targets, double target) {
    if (target != targets->back()) targets->push_back(target);
  };
  for (int i = 0; i < 1000; ++i) {
    ideal.Tick();
    controllers.Tick(1);
    for (int m = 0; m < 9; ++m) {
      for (int j = 0; j < 2; ++j) {
        const auto at = static_cast<size_t>(2 * m + j);
        note(&expected[at], ideal.output(m).joints[j].target);
        const auto& motors = controllers.world().modules()[static_cast<size_t>(m)].motors;
        note(&actual[at], motors.at("joint_" + std::to_string(j + 1)).position);
      }
    }
  }
  size_t steps = 0;
  for (int m = 0; m < 9; ++m) {
    EXPECT_EQ(controllers.at(m).output().status.role, ideal.output(m).status.role) << "m" << m + 1;
    EXPECT_GE(controllers.at(m).output().status.role, 0);
  }
  for (size_t at = 0; at < 18; ++at) {
    // The run may end within a step.
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
  const Exported world = ToWebots(small, *small.FindRobot("snake"), "controllers");
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
