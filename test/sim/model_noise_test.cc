// How real modules differ from ideal ones: play in joints, servos that act late, links that do not
// all weigh the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "compiler/model/mass_spread.h"
#include "sim/bullet_robot.h"
#include "sim/delayed_commands.h"
#include "test/sim/toy_robots.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;
using model::JointType;

/// A base of 20 kg that stands on the ground, and on its side an arm of 1 kg, 0.2 m long, that
/// turns about an axis to the east or slides up.
std::shared_ptr<model::Model> MakeArm(JointType type, bool arm_is_first = true) {
  auto model = std::make_shared<model::Model>(*test::MakePair(type, 0.0));
  model::ModuleType& module = model->module_types[0];
  const Vector3d hinge(0.12, 0, 0);
  model::Link base{"base", test::BoxCorners(Vector3d::Constant(-0.1), Vector3d::Constant(0.1)), {}};
  base.mass_kg = 20.0;
  const Vector3d centre = hinge + Vector3d(0.2, 0, 0), half(0.05, 0.02, 0.02);
  model::Link arm{"arm", test::BoxCorners(centre - half, centre + half), {}};
  arm.mass_kg = 1.0;
  module.links = arm_is_first ? std::vector{arm, base} : std::vector{base, arm};
  module.joints[0].p_MoJo_M = hinge;
  module.joints[0].axis = type == JointType::kPrismatic ? Vector3d::UnitY() : Vector3d::UnitZ();
  return model;
}

std::unique_ptr<BulletRobot> MakeRobot(const std::shared_ptr<const model::Model>& model,
                                       const BulletRobotOptions& options = {}) {
  auto made = BulletRobot::Create(model, model->robots[0].name, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

/// Where nothing pulls and nothing is touched.
BulletRobotOptions Weightless() { return {.world = {.ground = false, .gravity = false}}; }

/// With this seed of what differs by chance.
BulletRobotOptions Seeded(uint64_t seed) {
  BulletRobotOptions options;
  options.noise_seed = seed;
  return options;
}

/// One tick with the robot's joint on its way to a target; where the joint then is, as its servo
/// measures it.
double Drive(BulletRobot* robot, double target, double speed = 1.0) {
  robot->Actuate(test::PositionCommand(target, speed));
  robot->Advance();
  std::vector<morphbus::module_sensors_t> sensed;
  robot->Sense(&sensed);
  return sensed[0].joint_position_si[0];
}

double LinkValue(const BulletRobot& robot) { return robot.Positions()[0][0]; }

TEST(Backlash, ALoadedJointHangsByHalfItsPlay) {
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic}) {
    for (const bool arm_is_first : {true, false}) {
      const double play = type == JointType::kRevolute ? 0.04 : 0.004;
      const auto ideal = MakeArm(type, arm_is_first);
      const auto loose = MakeArm(type, arm_is_first);
      loose->module_types[0].joints[0].backlash = play;
      const auto without = MakeRobot(ideal);
      const auto with = MakeRobot(loose);
      double sensed_without = 0.0, sensed_with = 0.0;
      for (int tick = 0; tick < 150; ++tick) {
        sensed_without = Drive(without.get(), 0.0);
        sensed_with = Drive(with.get(), 0.0);
      }
      // The load pulls the arm down, and the sensor, on the motor's side, does not see how far.
      const double down = arm_is_first ? -0.5 * play : 0.5 * play;
      EXPECT_NEAR(LinkValue(*with) - LinkValue(*without), down, 0.01 * play);
      EXPECT_NEAR(sensed_with, sensed_without, 0.01 * play);
      EXPECT_NEAR(LinkValue(*without), sensed_without, 1e-9);
    }
  }
}

TEST(Backlash, TheMotorMovesAloneUntilThePlayIsUp) {
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic}) {
    const auto model = MakeArm(type);
    model->module_types[0].joints[0].backlash = 0.02;
    const auto robot = MakeRobot(model, Weightless());
    double sensed = 0.0;
    for (int tick = 0; tick < 50; ++tick) sensed = Drive(robot.get(), 0.009);
    EXPECT_NEAR(sensed, 0.009, 1e-4);
    EXPECT_NEAR(LinkValue(*robot), 0.0, 1e-9);
    // From the edge on the link comes along.
    for (int tick = 0; tick < 20; ++tick) sensed = Drive(robot.get(), 0.03, 0.05);
    EXPECT_GT(LinkValue(*robot), 0.009);
  }
}

TEST(Backlash, TheLinkStaysInThePlayHoweverItIsDriven) {
  const auto model = MakeArm(JointType::kRevolute);
  model->module_types[0].joints[0].backlash = 0.1;
  const auto robot = MakeRobot(model);
  double most = 0.0;
  for (int tick = 0; tick < 300; ++tick) {
    const double sensed = Drive(robot.get(), tick / 40 % 2 == 0 ? 0.7 : -0.7, 2.0);
    most = std::max(most, std::abs(LinkValue(*robot) - sensed));
  }
  EXPECT_LE(most, 0.05 + 1e-9);
  EXPECT_GT(most, 0.049);
}

TEST(Backlash, ATinyPlayIsNearlyNone) {
  const auto model = MakeArm(JointType::kRevolute);
  const auto ideal = MakeRobot(model);
  const auto loose_model = std::make_shared<model::Model>(*model);
  loose_model->module_types[0].joints[0].backlash = 1e-6;
  const auto loose = MakeRobot(loose_model);
  for (int tick = 0; tick < 150; ++tick) {
    const double target = tick < 75 ? 0.6 : -0.3;
    EXPECT_NEAR(Drive(loose.get(), target), Drive(ideal.get(), target), 2e-3) << tick;
  }
}

TEST(Delay, AServoBeginsSoMuchLater) {
  const auto model = MakeArm(JointType::kRevolute);
  const auto late_model = std::make_shared<model::Model>(*model);
  late_model->module_types[0].joints[0].delay_s = 0.1;  // 5 ticks
  const auto prompt = MakeRobot(model, Weightless());
  const auto late = MakeRobot(late_model, Weightless());
  std::vector<double> prompt_at, late_at;
  for (int tick = 0; tick < 60; ++tick) {
    const double target = tick < 25 ? 0.3 : -0.2;
    prompt_at.push_back(Drive(prompt.get(), target));
    late_at.push_back(Drive(late.get(), target));
  }
  // At rest in empty space nothing changes until then, and from then on all is the same.
  for (int tick = 0; tick < 5; ++tick) EXPECT_NEAR(late_at[tick], 0.0, 1e-12);
  EXPECT_GT(late_at[5], 1e-4);
  for (int tick = 5; tick < 60; ++tick)
    EXPECT_NEAR(late_at[tick], prompt_at[tick - 5], 1e-9) << tick;
}

TEST(Delay, NeedNotBeWholeTicks) {
  const auto model = MakeArm(JointType::kRevolute);
  model->module_types[0].joints[0].delay_s = 0.03;
  const auto robot = MakeRobot(model, Weightless());
  EXPECT_NEAR(Drive(robot.get(), 0.3), 0.0, 1e-12);
  EXPECT_GT(Drive(robot.get(), 0.3), 1e-4);
}

TEST(Delay, OfAModuleThatIsLostNothingArrives) {
  const auto model = MakeArm(JointType::kRevolute);
  model->module_types[0].joints[0].delay_s = 0.1;
  const auto robot = MakeRobot(model, Weightless());
  for (int tick = 0; tick < 3; ++tick) Drive(robot.get(), 0.3);
  robot->Lose(0);
  for (int tick = 0; tick < 20; ++tick) robot->Advance();
  EXPECT_NEAR(LinkValue(*robot), 0.0, 1e-9);
}

TEST(Delay, CommandsArriveInTheirOrderAndTheLastIsKept) {
  std::vector<JointSpec> joints(2);
  joints[0].module = 3;
  joints[0].delay_s = 0.004;
  joints[1].module = 4;
  DelayedCommands delayed(joints, 0.001);
  morphbus::joint_command_t command = {};
  EXPECT_FALSE(delayed.Put(4, 0, command, 0));
  for (int i = 0; i < 3; ++i) {
    command.target_si = i;
    EXPECT_TRUE(delayed.Put(3, 0, command, 2 * i));
  }
  std::vector<double> taken;
  const auto take = [&](int module, int joint, const morphbus::joint_command_t& arrived) {
    EXPECT_EQ(module, 3);
    EXPECT_EQ(joint, 0);
    taken.push_back(arrived.target_si);
  };
  delayed.Repeat(take);
  delayed.Deliver(3, take);
  EXPECT_TRUE(taken.empty());
  delayed.Deliver(6, take);
  EXPECT_EQ(taken, (std::vector<double>{0, 1}));
  delayed.Repeat(take);
  EXPECT_EQ(taken, (std::vector<double>{0, 1, 1}));
  delayed.Forget(3);
  delayed.Deliver(100, take);
  EXPECT_EQ(taken.size(), 3u);
}

/// A thousand boxes of 1 kg with this spread; robots are drawn from it and never simulated.
model::Model Boxes(double spread) {
  model::Model model = *test::MakeBox();
  model.module_types[0].links[0].mass_spread = spread;
  model.robots[0].modules.assign(1000, model.robots[0].modules[0]);
  return model;
}

TEST(MassSpread, DrawsHaveTheDeviationThatIsAskedFor) {
  const model::Model model = Boxes(0.1);
  const model::MassFactors factors = model::DrawMassFactors(model, model.robots[0], 1);
  double sum = 0.0, squares = 0.0;
  for (const std::vector<double>& module : factors) {
    EXPECT_LE(std::abs(module[0] - 1.0), 0.3 + 1e-12);
    sum += module[0];
    squares += (module[0] - 1.0) * (module[0] - 1.0);
  }
  // Four standard errors of the mean, and of the deviation.
  EXPECT_NEAR(sum / 1000, 1.0, 4 * 0.1 / std::sqrt(1000.0));
  EXPECT_NEAR(std::sqrt(squares / 1000), 0.1, 4 * 0.1 / std::sqrt(2000.0));
}

TEST(MassSpread, ALinksDrawDependsOnSeedAndPlaceAlone) {
  const model::Model model = Boxes(0.1);
  const auto one = model::DrawMassFactors(model, model.robots[0], 1);
  EXPECT_EQ(one, model::DrawMassFactors(model, model.robots[0], 1));
  EXPECT_NE(one, model::DrawMassFactors(model, model.robots[0], 2));
  EXPECT_NE(one[0], one[1]);
  // Fewer modules, and another spread: the same draws.
  model::Model few = Boxes(0.2);
  few.robots[0].modules.resize(10);
  const auto wide = model::DrawMassFactors(few, few.robots[0], 1);
  for (int m = 0; m < 10; ++m) EXPECT_NEAR(wide[m][0] - 1.0, 2 * (one[m][0] - 1.0), 1e-15);
  EXPECT_TRUE(model::DrawMassFactors(Boxes(0.0), model.robots[0], 1).empty());
}

TEST(MassSpread, BodiesWeighWhatWasDrawnAndTurnAsHeavily) {
  auto model = std::make_shared<model::Model>(*test::MakeBox());
  const auto ideal = MakeRobot(model);
  const BodySpec& usual = ideal->world().rigid_bodies().bodies[0];
  EXPECT_EQ(usual.mass_kg, 1.0);
  auto spread = std::make_shared<model::Model>(*model);
  spread->module_types[0].links[0].mass_spread = 0.1;
  std::vector<std::string> hashes = {ideal->world_hash()};
  for (const uint64_t seed : {uint64_t{1}, uint64_t{2}}) {
    const auto robot = MakeRobot(spread, Seeded(seed));
    const double factor = model::DrawMassFactors(*spread, spread->robots[0], seed)[0][0];
    const BodySpec& body = robot->world().rigid_bodies().bodies[0];
    EXPECT_NEAR(body.mass_kg, factor, 1e-9);
    EXPECT_NEAR(body.inertia_B.x(), factor * usual.inertia_B.x(), 1e-12);
    EXPECT_EQ(robot->world_hash(), MakeRobot(spread, Seeded(seed))->world_hash());
    hashes.push_back(robot->world_hash());
  }
  std::ranges::sort(hashes);
  EXPECT_EQ(std::ranges::adjacent_find(hashes), hashes.end());
  // Without a spread the seed is nothing to the world.
  EXPECT_EQ(MakeRobot(model, Seeded(7))->world_hash(), ideal->world_hash());
}

TEST(ModelNoise, PlayAndDelayStandInTheHashOfTheWorld) {
  const auto ideal = MakeArm(JointType::kRevolute);
  const auto loose = MakeArm(JointType::kRevolute);
  loose->module_types[0].joints[0].backlash = 0.01;
  const auto late = MakeArm(JointType::kRevolute);
  late->module_types[0].joints[0].delay_s = 0.01;
  const std::string hash = MakeRobot(ideal)->world_hash();
  EXPECT_NE(MakeRobot(loose)->world_hash(), hash);
  EXPECT_NE(MakeRobot(late)->world_hash(), hash);
  EXPECT_NE(MakeRobot(late)->world_hash(), MakeRobot(loose)->world_hash());
}

}  // namespace
}  // namespace morphbus::sim
