#include "logger/figures/run_figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "bridge/description/run_model.h"
#include "compiler/base/text.h"
#include "logger/log/run_log.h"
#include "logger/log/tracked_body.h"

namespace morphbus::logger {
namespace {

using Eigen::Vector3d;

constexpr int32_t kTickUs = 20'000;

/// A cube of 0.1 m around a point (m).
std::vector<Vector3d> CornersOfCube(const Vector3d& centre) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(centre + 0.05 * Vector3d((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1,
                                               (i & 4) != 0 ? 1 : -1));
  }
  return corners;
}

/// Robot "two": two modules "m1" and "m2" of two cubes, "light" (1 kg, west of the hinge, at z =
/// -0.1) and "heavy" (3 kg, east of it), which a hinge holds whose axis points up. In the robot m2
/// lies 0.4 m north of m1 and is docked by light faces.
model::Model TwoPairs() {
  model::ModuleType type;
  type.name = "Pair";
  type.links = {{"light", CornersOfCube({0, 0, -0.1}), {}, 1.0},
                {"heavy", CornersOfCube({0, 0, 0.1}), {}, 3.0}};
  model::Joint joint;
  joint.name = "turn";
  joint.link_a = 1;
  joint.link_b = 0;
  joint.p_MoJo_M = Vector3d::Zero();
  joint.axis = Vector3d::UnitY();
  joint.lower = -1;
  joint.upper = 1;
  type.joints = {joint};
  model::Connector north, south;
  north.name = "north";
  south.name = "south";
  model::Connector heavy_north, heavy_south;
  heavy_north.link = heavy_south.link = 1;
  type.connectors = {north, south, heavy_north, heavy_south};
  model::ConnectionType connection;
  connection.name = "row";
  model::ConnectionOption option;
  option.number = 1;
  option.connector_a = 0;
  option.connector_b = 1;
  option.X_AB = model::Pose::Identity();
  option.X_AB.translation() = Vector3d(0.4, 0, 0);
  connection.options = {option, option};
  connection.options[1].number = 2;
  connection.options[1].connector_a = 2;
  connection.options[1].connector_b = 3;
  model::Robot robot;
  robot.name = "two";
  robot.modules = {{"m1", 0, {0.0}}, {"m2", 0, {0.0}}};
  robot.dockings = {{0, 0, 1, 1, 0, 0}};
  robot.root_link = 1;
  model::Model model;
  model.module_types = {type};
  model.connection_types = {connection};
  model.robots = {robot};
  return model;
}

/// A body as WORLD has it: the frame of `link` of `module` at p (m), turned by `angle` about up.
morphbus::body_pose_t Body(int module, int link, const Vector3d& p, double angle = 0.0) {
  morphbus::body_pose_t body = {};
  body.module_id = static_cast<int16_t>(module);
  body.link = static_cast<int8_t>(link);
  std::copy_n(p.data(), 3, body.position_m);
  body.orientation_wxyz[0] = std::cos(angle / 2);
  body.orientation_wxyz[2] = std::sin(angle / 2);
  return body;
}

morphbus::docked_connector_t Mate(int connector, int mate, int mate_connector) {
  morphbus::docked_connector_t docked = {};
  docked.connector = static_cast<int8_t>(connector);
  docked.mate_module = static_cast<int16_t>(mate);
  docked.mate_connector = static_cast<int8_t>(mate_connector);
  docked.number = 1;
  return docked;
}

/// What the ground exerts on a link (N).
morphbus::contact_force_t Contact(int module, int link, const Vector3d& f_W) {
  morphbus::contact_force_t contact = {};
  contact.module_id = static_cast<int16_t>(module);
  contact.link = static_cast<int8_t>(link);
  for (int k = 0; k < 3; ++k) contact.force_n[k] = static_cast<float>(f_W(k));
  return contact;
}

morphbus::joint_command_t Target(double target) {
  morphbus::joint_command_t command = {};
  command.mode = morphbus::joint_command_t::MODE_POSITION;
  command.target_si = target;
  return command;
}

/// A log, sample by sample in order of time.
class LogMaker {
 public:
  explicit LogMaker(const model::Model& model) {
    const auto described = std::make_shared<bridge::RunModel>();
    described->model = model;
    const model::Robot& robot = described->model.robots[0];
    described->root = bridge::RootLinkOf(robot, robot.root_module);
    described->X_RL_start =
        model::ForwardKinematics(described->model, robot, model::StartValues(robot)).X_RL;
    log_.described = described;
    log_.model = {described, &described->model};
    log_.robot = &robot;
    log_.tick_us = kTickUs;
    for (int module = 0; module < 2; ++module) Series(module);
  }

  void TakeSensed(int64_t time_us, int module, const std::vector<double>& position,
                  const std::vector<morphbus::docked_connector_t>& docked,
                  const std::vector<float>& effort = {}) {
    Series(module).sensors.push_back({time_us, position, {}, docked, {}, effort});
  }
  void TakeCommands(int64_t time_us, int module,
                    const std::vector<morphbus::joint_command_t>& joints) {
    Series(module).actuators.push_back({time_us, joints, {}});
  }
  void TakeBodies(int64_t time_us, const std::vector<morphbus::body_pose_t>& bodies,
                  const std::vector<morphbus::contact_force_t>& contacts = {}) {
    log_.world.push_back({time_us, bodies, contacts});
  }
  [[nodiscard]] const RunLog& log() const { return log_; }

 private:
  ModuleSeries& Series(int module) {
    for (ModuleSeries& series : log_.modules) {
      if (series.id == module) return series;
    }
    ModuleSeries& series = log_.modules.emplace_back();
    series.id = module;
    series.model_index = module >= 0 && module < 2 ? module : -1;
    return series;
  }

  RunLog log_;
};

class RunFiguresTest : public testing::Test {
 protected:
  LogMaker Recorder() { return LogMaker(model_); }

  /// The robot at one tick: the light links' body at p_light, the heavy ones at p_heavy (of m1;
  /// m2's lies 0.4 m north).
  static std::vector<morphbus::body_pose_t> Whole(const Vector3d& p_light,
                                                  const Vector3d& p_heavy) {
    return {Body(0, 0, p_light), Body(0, 1, p_heavy), Body(1, 1, p_heavy + Vector3d(0.4, 0, 0))};
  }

  /// A robot whose hinges swing with `period` (s) while it goes north at 0.1 m/s and turns left
  /// with 0.05 rad/s, its heavy links on the ground for a quarter of the time. `position` is where
  /// the hinge is when it is told `target`. Each motor exerts 2 N m, and the ground 80 N on m1's
  /// heavy link.
  template <class Position>
  RunFigures Swinging(double period, const Position& position, double seconds = 15.0) {
    LogMaker recorder = Recorder();
    for (int k = 0; k * 0.02 < seconds; ++k) {
      const double t = k * 0.02;
      const double target = 0.5 * std::sin(2 * std::numbers::pi * t / period);
      const double phase = std::fmod(t / period, 1.0);
      const double up = phase < 0.25 - 1e-9 || phase > 1 - 1e-9 ? 0.051 : 0.08;
      const double heading = 0.05 * t;
      // All links turn as one about the robot's origin, which goes along.
      const Vector3d origin(0.1 * t, up, 0);
      const Eigen::AngleAxisd turn(heading, Vector3d::UnitY());
      const int64_t time_us = int64_t{k} * kTickUs;
      for (int m = 0; m < 2; ++m) {
        recorder.TakeSensed(time_us, m, {position(target, t)},
                            {m == 0 ? Mate(0, 1, 1) : Mate(1, 0, 0)}, {2});
        recorder.TakeCommands(time_us, m, {Target(target)});
      }
      recorder.TakeBodies(
          time_us,
          {Body(0, 0, origin + Vector3d(0, 0.2, 0), heading), Body(0, 1, origin, heading),
           Body(1, 1, origin + turn * Vector3d(0.4, 0, 0), heading)},
          {Contact(0, 1, {0, 80, 0})});
    }
    return FiguresOf(recorder.log());
  }

  model::Model model_ = TwoPairs();
};

double AsTold(double target, double) { return target; }

TEST_F(RunFiguresTest, DisplacementIsThatOfTheCentreOfMassAndTheRootBodysStandsBesideIt) {
  LogMaker recorder = Recorder();
  // The heavy links (6 of 8 kg) go 1 m north and come back half of the way; the root is one of
  // them.
  recorder.TakeBodies(0, Whole({0, 1, 0}, {0, 1, 0}));
  recorder.TakeBodies(kTickUs, Whole({0, 1, 0}, {1, 1, 0}));
  recorder.TakeBodies(2 * kTickUs, Whole({0, 1, 0.2}, {0.5, 1, 0}));
  const RunFigures figures = FiguresOf(recorder.log());
  ASSERT_TRUE(figures.has_world);
  EXPECT_TRUE(figures.displacement.isApprox(Vector3d(0.375, 0, 0.05), 1e-12));
  EXPECT_TRUE(figures.root_displacement.isApprox(Vector3d(0.5, 0, 0), 1e-12));
  EXPECT_NEAR(figures.path_length_m, 0.75 + std::hypot(0.375, 0.05), 1e-12);
}

TEST_F(RunFiguresTest, TheCentreOfMassIsThatOfAllLinks) {
  LogMaker recorder = Recorder();
  recorder.TakeBodies(0, Whole({0, 1, 0}, {0, 1, 0}));
  const RunFigures figures = FiguresOf(recorder.log());
  // 2 kg at z = -0.1 and 6 kg at 0.1; by x between the modules.
  const RobotSample& sample = figures.motion.track.front();
  EXPECT_TRUE(sample.p_WCm.isApprox(Vector3d(0.2, 1, 0.05), 1e-9)) << sample.p_WCm.transpose();
}

TEST_F(RunFiguresTest, TheTrunkIsTheHeaviestBodyAtItsCentreOfMass) {
  // Each heavy cube weighs 3 kg, the two light ones together 2 kg: of two heaviest bodies the
  // first.
  const TrackedBody trunk = Trunk(model_, model_.robots[0]);
  EXPECT_EQ(trunk.link.module, 0);
  EXPECT_EQ(trunk.link.link, 1);
  // The link's frame lies in the hinge, the cube 0.1 m beside it.
  EXPECT_LT((trunk.X_LP.translation() - Vector3d(0, 0, 0.1)).norm(), 1e-12);
}

TEST_F(RunFiguresTest, WhatPartsAndDocksHasTheSameCentreOfMass) {
  LogMaker recorder = Recorder();
  recorder.TakeSensed(0, 0, {0.0}, {Mate(0, 1, 1)});
  recorder.TakeBodies(0, Whole({0, 1, 0}, {0, 1, 0}));
  // They part: m2's light link is a body of its own, where it was.
  recorder.TakeSensed(kTickUs, 0, {0.0}, {});
  recorder.TakeSensed(kTickUs, 1, {0.0}, {});
  std::vector<morphbus::body_pose_t> parted = Whole({0, 1, 0}, {0, 1, 0});
  parted.push_back(Body(1, 0, {0.4, 1, 0}));
  recorder.TakeBodies(kTickUs, parted);
  // m2's light link goes away, and they dock again.
  parted.back() = Body(1, 0, {0.8, 1, 0});
  recorder.TakeBodies(2 * kTickUs, parted);
  recorder.TakeSensed(3 * kTickUs, 0, {0.0}, {Mate(0, 1, 1)});
  recorder.TakeBodies(3 * kTickUs, Whole({0, 1, 0}, {0, 1, 0}));
  const RobotMotion motion = MotionOf(recorder.log());
  ASSERT_EQ(motion.track.size(), 4u);
  EXPECT_TRUE(motion.track[1].p_WCm.isApprox(motion.track[0].p_WCm, 1e-12));
  EXPECT_NEAR(motion.track[2].p_WCm.x(), motion.track[0].p_WCm.x() + 0.4 / 8, 1e-12);
  EXPECT_TRUE(motion.track[3].p_WCm.isApprox(motion.track[0].p_WCm, 1e-12));
}

TEST_F(RunFiguresTest, WhatWasSensedLastHoldsToTheEndOfTheLog) {
  LogMaker recorder = Recorder();
  recorder.TakeSensed(0, 0, {0.0}, {Mate(0, 1, 1)});
  recorder.TakeBodies(0, Whole({0, 1, 0}, {0, 1, 0}));
  // They part, and no reading comes after that.
  recorder.TakeSensed(kTickUs, 0, {0.0}, {});
  recorder.TakeSensed(kTickUs, 1, {0.0}, {});
  std::vector<morphbus::body_pose_t> parted = Whole({0, 1, 0}, {0, 1, 0});
  parted.push_back(Body(1, 0, {0.8, 1, 0}));
  recorder.TakeBodies(2 * kTickUs, parted);
  const RobotMotion motion = MotionOf(recorder.log());
  ASSERT_EQ(motion.track.size(), 2u);
  EXPECT_NEAR(motion.track[1].p_WCm.x(), motion.track[0].p_WCm.x() + 0.4 / 8, 1e-12);
}

TEST_F(RunFiguresTest, ATickOfWhichAPartIsMissingIsLeftOut) {
  LogMaker recorder = Recorder();
  recorder.TakeBodies(0, Whole({0, 1, 0}, {0, 1, 0}));
  recorder.TakeBodies(kTickUs, {Body(0, 0, {0, 1, 0}), Body(0, 1, {5, 1, 0})});
  recorder.TakeBodies(2 * kTickUs, Whole({0, 1, 0}, {1, 1, 0}));
  const RunFigures figures = FiguresOf(recorder.log());
  EXPECT_EQ(figures.motion.track.size(), 2u);
  EXPECT_NEAR(figures.path_length_m, 0.75, 1e-12);
}

TEST_F(RunFiguresTest, EachCycleHasItsTimeAdvanceTurnAndDuties) {
  const RunFigures figures = Swinging(2.0, AsTold);
  ASSERT_TRUE(figures.gait) << figures.why_no_gait;
  const Gait& gait = *figures.gait;
  EXPECT_NEAR(gait.cycle_s, 2.0, 1e-9);
  ASSERT_EQ(gait.cycles.size(), 7u);
  for (const GaitCycle& cycle : gait.cycles) {
    EXPECT_NEAR(cycle.turn_rad, 0.1, 1e-9);
    EXPECT_NEAR(Seconds(cycle.end_us - cycle.begin_us), 2.0, 1e-6);
  }
  // 0.2 m north, and as the centre of mass (0.2 north and 0.05 east of the origin) turns with it.
  EXPECT_NEAR(gait.cycles[0].advance.x(), 0.2, 0.02);
  EXPECT_NEAR(gait.cycles[0].advance.norm(),
              std::hypot(gait.cycles[0].forward_m, gait.cycles[0].left_m), 1e-9);
  EXPECT_NEAR(gait.turn_rad, 0.1, 1e-9);
  EXPECT_NEAR(gait.height_m, figures.min_height_m, 1e-9);
  // The heavy links stand for a quarter of the time, the light ones never.
  ASSERT_EQ(gait.duties.size(), 2u);
  EXPECT_EQ(gait.duties[0].name, "m1.heavy");
  EXPECT_NEAR(gait.duties[0].duty, 0.25, 1e-9);
  EXPECT_EQ(gait.DutyOf(1, 1), gait.duties[1].duty);
  EXPECT_EQ(gait.DutyOf(1, 0), 0.0);
  EXPECT_NEAR(gait.RangeOf(0, 0), 1.0, 0.01);
}

TEST_F(RunFiguresTest, ACycleHasItsEnergyAndTheWayItsCost) {
  const RunFigures figures = Swinging(2.0, AsTold);
  ASSERT_TRUE(figures.gait) << figures.why_no_gait;
  const Gait& gait = *figures.gait;
  // Two hinges go 0.5 rad out and back on both sides, with or against 2 N m.
  for (const GaitCycle& cycle : gait.cycles) EXPECT_NEAR(cycle.energy_j, 8.0, 1e-9);
  EXPECT_NEAR(gait.energy_j, 8.0, 1e-9);
  // The robot weighs 8 kg; from the first cycle's beginning to the last one's end it went along a
  // circle, and the straight way counts.
  const std::vector<RobotSample>& track = figures.motion.track;
  const Vector3d way =
      SampleAt(track, gait.times_us.back()).p_WCm - SampleAt(track, gait.times_us.front()).p_WCm;
  ASSERT_TRUE(gait.transport.cost);
  EXPECT_NEAR(gait.transport.distance_m, std::hypot(way.x(), way.z()), 1e-12);
  EXPECT_NEAR(*gait.transport.cost, 7 * 8.0 / (8 * 9.81 * gait.transport.distance_m), 1e-9);
  // The run lasts for seven and a half of them, but for its last tick.
  EXPECT_NEAR(figures.energy_j, 7.5 * 8.0 - 4 * 0.5 * std::sin(0.02 * std::numbers::pi), 1e-9);
  const nlohmann::json json = FiguresJson(figures);
  EXPECT_EQ(json["energy"], figures.energy_j);
  EXPECT_EQ(json["cost_of_transport"], *figures.transport.cost);
  EXPECT_EQ(json["gait"]["energy_j"], gait.energy_j);
  EXPECT_EQ(json["loads"]["joints"]["m2.turn"], (nlohmann::json{{"rms", 2.0}, {"peak", 2.0}}));
  EXPECT_EQ(json["loads"]["links"],
            (nlohmann::json{
                {"m1.heavy", {{"mean_n", std::vector<double>{0, 80, 0}}, {"peak_n", 80.0}}}}));
}

TEST_F(RunFiguresTest, BrakingCountsAndStandingStillDoesNot) {
  LogMaker recorder = Recorder();
  // Lifted with 3 N m, held, let down against 1 N m, and all of the time in one place.
  const double positions[] = {0, 0.25, 0.5, 0.5, 0.5, 0.25, 0};
  const float efforts[] = {0, 3, 3, 2, 2, 1, 1};
  for (int k = 0; k < 7; ++k) {
    const int64_t time_us = int64_t{k} * kTickUs;
    recorder.TakeSensed(time_us, 0, {positions[k]}, {Mate(0, 1, 1)}, {efforts[k]});
    recorder.TakeBodies(time_us, Whole({0, 1, 0}, {0, 1, 0}),
                        {Contact(0, 0, {0, k == 3 ? 70.0 : 0.0, 0}), Contact(9, 0, {1, 1, 1})});
  }
  const RunFigures figures = FiguresOf(recorder.log());
  EXPECT_NEAR(figures.energy_j, 3 * 0.5 + 1 * 0.5, 1e-12);
  EXPECT_FALSE(figures.transport.cost);
  const nlohmann::json json = FiguresJson(figures);
  EXPECT_TRUE(json["cost_of_transport"].is_null());
  EXPECT_EQ(json["no_cost"], "the robot came only 0.0 mm far");
  ASSERT_EQ(figures.motion.loads.size(), 1u);
  EXPECT_NEAR(figures.motion.loads[0].mean_W.y(), 10.0, 1e-12);
  EXPECT_EQ(figures.motion.loads[0].peak_n, 70.0);
  EXPECT_EQ(figures.joint_loads[0].peak, 3.0);
}

TEST_F(RunFiguresTest, ThePeriodNeedNotBeOfWholeTicks) {
  for (const double period : {0.37, 0.73, 1.33}) {
    const RunFigures figures = Swinging(period, AsTold);
    ASSERT_TRUE(figures.gait) << figures.why_no_gait;
    EXPECT_NEAR(figures.gait->cycle_s, period, 0.01 * period);
    EXPECT_NEAR(figures.gait->turn_rad, 0.05 * figures.gait->cycle_s, 1e-6);
  }
}

TEST_F(RunFiguresTest, MotionMustBearTheCommandsOut) {
  const RunFigures still = Swinging(2.0, [](double, double) { return 0.1; });
  EXPECT_FALSE(still.gait);
  EXPECT_EQ(still.why_no_gait, "the commands repeat every 2000 ms, but no joint moves");
  const RunFigures other = Swinging(2.0, [](double, double t) { return 0.5 * std::sin(5 * t); });
  EXPECT_EQ(other.why_no_gait, "the commands repeat every 2000 ms, but the joints do not");
  // A joint that lags behind, and does not come as far, is fine.
  const RunFigures late = Swinging(2.0, [](double, double t) {
    return 0.3 * std::sin(std::numbers::pi * (t - 0.2)) + 0.01 * std::sin(31 * t);
  });
  EXPECT_TRUE(late.gait) << late.why_no_gait;
}

TEST_F(RunFiguresTest, WithoutAWorldThereAreTimesAndRangesOnly) {
  LogMaker recorder = Recorder();
  for (int k = 0; k < 500; ++k) {
    const double target = (k / 50) % 2 == 0 ? 0.5 : -0.5;
    recorder.TakeSensed(int64_t{k} * kTickUs, 0, {target}, {});
    recorder.TakeCommands(int64_t{k} * kTickUs, 0, {Target(target)});
  }
  const RunFigures figures = FiguresOf(recorder.log());
  ASSERT_TRUE(figures.gait) << figures.why_no_gait;
  EXPECT_NEAR(figures.gait->cycle_s, 2.0, 1e-9);
  EXPECT_EQ(figures.gait->RangeOf(0, 0), 1.0);
  const nlohmann::json json = FiguresJson(figures);
  EXPECT_TRUE(json["displacement"].is_null());
  EXPECT_TRUE(json["walk"].is_null());
  EXPECT_TRUE(json["energy"].is_null());
  EXPECT_FALSE(json["gait"].contains("forward_m"));
}

TEST_F(RunFiguresTest, WithoutACycleTheReasonIsTold) {
  LogMaker recorder = Recorder();
  for (int k = 0; k < 100; ++k) {
    recorder.TakeBodies(int64_t{k} * kTickUs, Whole({0, 1, 0}, {0, 1, 0}));
    recorder.TakeCommands(int64_t{k} * kTickUs, 0, {Target(0.3)});
  }
  const RunFigures figures = FiguresOf(recorder.log());
  EXPECT_EQ(FiguresJson(figures)["no_gait"], "the commands do not change");
  const auto lines = FigureLines(figures);
  EXPECT_EQ(lines.back(),
            std::pair(std::string("gait"), std::string("no cycle: the commands do not change")));
}

TEST_F(RunFiguresTest, AWheelToldToTurnOnByAngleIsWhereItWasAfterATurn) {
  model_.module_types[0].joints[0].type = model::JointType::kContinuous;
  LogMaker recorder = Recorder();
  for (int k = 0; k < 500; ++k) {
    // A third of a turn every half second, and no way back.
    const double target = (k / 25) * 2.0 * std::numbers::pi / 3.0;
    recorder.TakeCommands(int64_t{k} * kTickUs, 0, {Target(target)});
  }
  const RunFigures figures = FiguresOf(recorder.log());
  ASSERT_TRUE(figures.gait) << figures.why_no_gait;
  EXPECT_NEAR(figures.gait->cycle_s, 1.5, 1e-9);
}

TEST_F(RunFiguresTest, DamagedNumbersAreNoReasonToGrow) {
  LogMaker recorder = Recorder();
  recorder.TakeCommands(0, 0, {Target(0.3)});
  recorder.TakeCommands(std::numeric_limits<int64_t>::max(), 0, {Target(0.3)});
  recorder.TakeCommands(std::numeric_limits<int64_t>::min(), 0, {Target(0.3)});
  recorder.TakeCommands(kTickUs, 7, {Target(0.3), Target(0.4), Target(0.5)});
  recorder.TakeSensed(0, -1, {1, 2, 3}, {Mate(0, 99, 0)});
  recorder.TakeSensed(0, 1, {1, 2, 3}, {Mate(77, 99, 0)});
  recorder.TakeBodies(0, {Body(9, 3, {0, 1, 0})});
  const RobotMotion motion = MotionOf(recorder.log());
  EXPECT_LE(motion.joints[0].target.size(), 2u);
  EXPECT_TRUE(motion.track.empty());
}

TEST(TurnBetweenTest, IsAboutUpWhateverTheBodyDoesBesides) {
  RobotSample a, b;
  EXPECT_EQ(TurnBetween(a, b), 0.0);
  // From north to west, by 0.3 rad.
  b.q_WT = Eigen::AngleAxisd(0.3, Vector3d::UnitY());
  EXPECT_NEAR(TurnBetween(a, b), 0.3, 1e-12);
  // The same after it has rolled over about east, nearly upside down.
  b.q_WT = b.q_WT * Eigen::Quaterniond(Eigen::AngleAxisd(3.0, Vector3d::UnitZ()));
  EXPECT_NEAR(TurnBetween(a, b), 0.3, 1e-12);
  EXPECT_LE(std::abs(TurnBetween(b, a)), std::numbers::pi);
}

}  // namespace
}  // namespace morphbus::logger
