// What the simulator costs above Bullet: the quadruped of Fig. 9 stands up and walks, through
// sim::BulletRobot and as a bare Bullet loop over the same bodies, hinges, ground, engine
// settings and servo set-points.

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <benchmark/benchmark.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "sim/bullet_robot.h"
#include "sim/link_physics.h"
#include "test/sim/mtran.h"

namespace morphbus::sim {
namespace {

RigidBodyModel BuildQuadruped() {
  const auto model = test::MtranModel();
  const model::Robot& robot = model->robots[0];
  return BuildRigidBodyModel(*model, robot, ComputeLinkPhysics(*model, robot),
                             PlaceOnGround(*model, robot), model::StartValues(robot));
}

btVector3 ToBullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

class BareWorld {
 public:
  explicit BareWorld(const RigidBodyModel& rigid_bodies) : filter_(rigid_bodies.may_collide) {
    broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
    dynamics_.setGravity({0, -9.81, 0});
    dynamics_.getSolverInfo().m_numIterations = WorldOptions().solver_iterations;
    dynamics_.getSolverInfo().m_solverMode = SOLVER_USE_WARMSTARTING;
    dynamics_.getSolverInfo().m_erp = 0.8;
    dynamics_.getSimulationIslandManager()->setSplitIslands(false);
    ground_shape_ = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), kHullShrink);
    ground_ = std::make_unique<btRigidBody>(0.0, nullptr, ground_shape_.get());
    ground_->setUserIndex(-1);
    dynamics_.addRigidBody(ground_.get());
    for (const BodySpec& body : rigid_bodies.bodies) AddBody(body);
    for (const JointSpec& joint : rigid_bodies.joints) AddHinge(joint);
  }
  ~BareWorld() {
    for (const auto& hinge : hinges_) dynamics_.removeConstraint(hinge.get());
    for (const auto& body : bodies_) dynamics_.removeRigidBody(body.get());
    dynamics_.removeRigidBody(ground_.get());
  }

  /// One step of 1 ms; each motor turns towards its set-point, as a user would write it.
  void Step(const std::vector<double>& set_points) {
    for (size_t i = 0; i < hinges_.size(); ++i) {
      const double error = set_points[i] - starts_[i] - hinges_[i]->getHingeAngle();
      const double v = std::clamp(WorldOptions().servo_gain_per_s * error, -speeds_[i], speeds_[i]);
      hinges_[i]->enableAngularMotor(true, v, efforts_[i] * 1e-3);
    }
    dynamics_.stepSimulation(1e-3, 0);
  }

  [[nodiscard]] double north() const { return bodies_[0]->getCenterOfMassPosition().x(); }

 private:
  class Filter : public btOverlapFilterCallback {
   public:
    explicit Filter(const std::vector<std::vector<bool>>& may_collide)
        : may_collide_(may_collide) {}
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
      const int i = static_cast<const btCollisionObject*>(a->m_clientObject)->getUserIndex();
      const int j = static_cast<const btCollisionObject*>(b->m_clientObject)->getUserIndex();
      return i < 0 || j < 0 || may_collide_[i][j];
    }

   private:
    std::vector<std::vector<bool>> may_collide_;
  };

  void AddBody(const BodySpec& spec) {
    auto compound = std::make_unique<btCompoundShape>();
    for (const LinkSpec& link : spec.links) {
      auto hull = std::make_unique<btConvexHullShape>();
      hull->setMargin(kCollisionMargin);
      for (const Eigen::Vector3d& corner : link.parts_B.front()) {
        hull->addPoint(ToBullet(corner), false);
      }
      hull->recalcLocalAabb();
      compound->addChildShape(btTransform::getIdentity(), hull.get());
      hulls_.push_back(std::move(hull));
    }
    btRigidBody::btRigidBodyConstructionInfo info(spec.mass_kg, nullptr, compound.get(),
                                                  ToBullet(spec.inertia_B));
    info.m_startWorldTransform.setIdentity();
    info.m_startWorldTransform.setOrigin(ToBullet(spec.X_WB.translation()));
    info.m_friction = std::sqrt(0.8);
    compounds_.push_back(std::move(compound));
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    bodies_.back()->setUserIndex(static_cast<int>(bodies_.size()) - 1);
    dynamics_.addRigidBody(bodies_.back().get());
  }

  void AddHinge(const JointSpec& spec) {
    if (spec.body_1 == spec.body_2) return;
    btRigidBody& a = *bodies_[spec.body_2];
    btRigidBody& b = *bodies_[spec.body_1];
    hinges_.push_back(
        std::make_unique<btHingeConstraint>(a, b, ToBullet(spec.p_WJ) - a.getCenterOfMassPosition(),
                                            ToBullet(spec.p_WJ) - b.getCenterOfMassPosition(),
                                            ToBullet(spec.axis_W), ToBullet(spec.axis_W)));
    starts_.push_back(spec.start);
    speeds_.push_back(spec.speed);
    efforts_.push_back(spec.effort);
    dynamics_.addConstraint(hinges_.back().get(), true);
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  Filter filter_;
  btDiscreteDynamicsWorld dynamics_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::unique_ptr<btStaticPlaneShape> ground_shape_;
  std::unique_ptr<btRigidBody> ground_;
  std::vector<std::unique_ptr<btConvexHullShape>> hulls_;
  std::vector<std::unique_ptr<btCompoundShape>> compounds_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btHingeConstraint>> hinges_;
  std::vector<double> starts_, speeds_, efforts_;
};

constexpr int kStepsPerTick = 20;
constexpr int kTicks = 1925;  // 38.5 s: standing up and five gait cycles.

/// The quadruped with the gait's commands, a tick at a time, as the lockstep drives it.
class Walker {
 public:
  Walker()
      : model_(test::MtranModel()),
        bullet_robot_(std::move(*BulletRobot::Create(model_, "quadruped", {}))),
        parts_(test::AssignParts(*model_, bullet_robot_->robot())) {}

  void Tick() {
    bullet_robot_->Sense(&sensors_);
    bullet_robot_->Truth(&truth_);
    for (const morphbus::actuator_t& command : Commands()) bullet_robot_->Actuate(command);
    bullet_robot_->Advance();
    t_ += 0.02;
  }

  /// Of the joints that turn, in canonical order.
  [[nodiscard]] std::vector<double> SetPoints() const {
    std::vector<double> points;
    const RigidBodyModel& rigid_bodies = bullet_robot_->world().rigid_bodies();
    for (size_t i = 0; i < rigid_bodies.joints.size(); ++i) {
      if (rigid_bodies.joints[i].body_1 == rigid_bodies.joints[i].body_2) continue;
      points.push_back(bullet_robot_->world().set_point(static_cast<int>(i)));
    }
    return points;
  }

  [[nodiscard]] double north() const {
    return bullet_robot_->world().body(0).X_WB.translation().x();
  }

 private:
  [[nodiscard]] std::vector<morphbus::actuator_t> Commands() const {
    std::vector<morphbus::actuator_t> commands(9);
    for (size_t m = 0; m < commands.size(); ++m) {
      commands[m].module_id = static_cast<int16_t>(m);
      commands[m].joints.resize(2);
    }
    const test::Posture posture = test::GaitTargets(t_);
    for (size_t leg = 0; leg < test::kNumLegs; ++leg) {
      for (size_t part = 0; part < test::kNumParts; ++part) {
        const test::FunctionalJoint& joint = parts_[leg][part];
        commands[joint.module].joints[joint.joint] = {morphbus::joint_command_t::MODE_POSITION,
                                                      joint.sign * posture[leg][part],
                                                      std::numbers::pi};
      }
    }
    return commands;
  }

  std::shared_ptr<const model::Model> model_;
  std::unique_ptr<BulletRobot> bullet_robot_;
  test::Quadruped parts_;
  std::vector<morphbus::module_sensors_t> sensors_;
  std::vector<morphbus::body_pose_t> truth_;
  double t_ = 0.0;
};

/// [tick][joint].
std::vector<std::vector<double>> WalkSetPoints() {
  Walker walker;
  std::vector<std::vector<double>> points = {walker.SetPoints()};
  for (int tick = 0; tick < kTicks; ++tick) {
    walker.Tick();
    points.push_back(walker.SetPoints());
  }
  return points;
}

void BareBulletWalk(benchmark::State& state) {
  const std::vector<std::vector<double>> points = WalkSetPoints();
  double north = 0.0;
  for (auto _ : state) {
    BareWorld world(BuildQuadruped());
    std::vector<double> now = points[0];
    for (size_t tick = 0; tick < kTicks; ++tick) {
      for (int step = 1; step <= kStepsPerTick; ++step) {
        const double part = static_cast<double>(step) / kStepsPerTick;
        for (size_t i = 0; i < now.size(); ++i) {
          now[i] = points[tick][i] + part * (points[tick + 1][i] - points[tick][i]);
        }
        world.Step(now);
      }
    }
    north = world.north();
  }
  state.counters["north_m"] = north;  // That it walks: the same work, not a robot on its back.
}
BENCHMARK(BareBulletWalk)->Unit(benchmark::kMillisecond);

void AssemblyWalk(benchmark::State& state) {
  double north = 0.0;
  for (auto _ : state) {
    Walker walker;
    for (int tick = 0; tick < kTicks; ++tick) walker.Tick();
    north = walker.north();
  }
  state.counters["north_m"] = north;
}
BENCHMARK(AssemblyWalk)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace morphbus::sim

BENCHMARK_MAIN();
