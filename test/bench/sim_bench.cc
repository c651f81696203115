// What the simulator costs above Bullet: the quadruped of Fig. 9, standing still with all servos at
// work, through sim::World and as a bare Bullet loop over the same bodies, hinges and ground.

#include <benchmark/benchmark.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "sim/link_physics.h"
#include "sim/simulated_assembly.h"
#include "test/sim/mtran.h"

namespace morphbus::sim {
namespace {

Assembly BuildQuadruped() {
  const auto model = test::MakeMtranModel();
  const model::Robot& robot = model->robots[0];
  return BuildAssembly(*model, robot, PlaceOnGround(*model, robot), model::StartValues(robot));
}

btVector3 ToBullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

class BareWorld {
 public:
  explicit BareWorld(const Assembly& assembly) : filter_(assembly.may_collide) {
    broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
    dynamics_.setGravity({0, -9.81, 0});
    dynamics_.getSolverInfo().m_numIterations = WorldOptions().solver_iterations;
    ground_shape_ = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), kHullShrink);
    ground_ = std::make_unique<btRigidBody>(0.0, nullptr, ground_shape_.get());
    ground_->setUserIndex(-1);
    dynamics_.addRigidBody(ground_.get());
    for (const BodySpec& body : assembly.bodies) AddBody(body);
    for (const JointSpec& joint : assembly.joints) AddHinge(joint);
  }
  ~BareWorld() {
    for (const auto& hinge : hinges_) dynamics_.removeConstraint(hinge.get());
    for (const auto& body : bodies_) dynamics_.removeRigidBody(body.get());
    dynamics_.removeRigidBody(ground_.get());
  }

  void Step() { dynamics_.stepSimulation(1e-3, 0); }

 private:
  class Filter : public btOverlapFilterCallback {
   public:
    explicit Filter(const std::vector<std::vector<bool>>& may_collide)
        : may_collide_(may_collide) {}
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
      const int i = static_cast<const btCollisionObject*>(a->m_clientObject)->getUserIndex();
      const int j = static_cast<const btCollisionObject*>(b->m_clientObject)->getUserIndex();
      return i < 0 || j < 0 || may_collide_[static_cast<size_t>(i)][static_cast<size_t>(j)];
    }

   private:
    std::vector<std::vector<bool>> may_collide_;
  };

  void AddBody(const BodySpec& spec) {
    auto compound = std::make_unique<btCompoundShape>();
    for (const LinkSpec& link : spec.links) {
      auto hull = std::make_unique<btConvexHullShape>();
      hull->setMargin(kCollisionMargin);
      for (const Eigen::Vector3d& corner : link.hull_B) hull->addPoint(ToBullet(corner), false);
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
    btRigidBody& a = *bodies_[static_cast<size_t>(spec.body_2)];
    btRigidBody& b = *bodies_[static_cast<size_t>(spec.body_1)];
    hinges_.push_back(
        std::make_unique<btHingeConstraint>(a, b, ToBullet(spec.p_WJ) - a.getCenterOfMassPosition(),
                                            ToBullet(spec.p_WJ) - b.getCenterOfMassPosition(),
                                            ToBullet(spec.axis_W), ToBullet(spec.axis_W)));
    hinges_.back()->enableAngularMotor(true, 0.0, spec.effort * 1e-3);
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
};

constexpr int kStepsPerTick = 20;
constexpr int kSettlingSteps = 500;

void BareBulletTick(benchmark::State& state) {
  BareWorld world(BuildQuadruped());
  for (int step = 0; step < kSettlingSteps; ++step) world.Step();
  for (auto _ : state) {
    for (int step = 0; step < kStepsPerTick; ++step) world.Step();
  }
}
BENCHMARK(BareBulletTick)->Unit(benchmark::kMicrosecond);

void WorldTick(benchmark::State& state) {
  World world(BuildQuadruped(), WorldOptions());
  for (int step = 0; step < kSettlingSteps; ++step) world.Step();
  for (auto _ : state) {
    for (int step = 0; step < kStepsPerTick; ++step) world.Step();
  }
}
BENCHMARK(WorldTick)->Unit(benchmark::kMicrosecond);

// A whole tick as the lockstep sees it: sensors, truth, commands, 20 steps, over the gait.
void AssemblyTick(benchmark::State& state) {
  const auto model = test::MakeMtranModel();
  const auto assembly = std::move(*SimulatedAssembly::Create(model, "quadruped", {}));
  const test::Quadruped parts = test::AssignParts(*model, assembly->robot());
  std::vector<morphbus::module_sensors_t> sensors;
  std::vector<morphbus::body_pose_t> truth;
  double t = 0.0;
  for (auto _ : state) {
    assembly->Sense(&sensors);
    assembly->Truth(&truth);
    std::vector<morphbus::actuator_t> commands(9);
    for (size_t m = 0; m < commands.size(); ++m) {
      commands[m].module_id = static_cast<int16_t>(m);
      commands[m].joints.resize(2);
    }
    const test::Posture posture = test::GaitTargets(t);
    for (size_t leg = 0; leg < test::kNumLegs; ++leg) {
      for (size_t part = 0; part < test::kNumParts; ++part) {
        const test::FunctionalJoint& joint = parts[leg][part];
        commands[static_cast<size_t>(joint.module)].joints[static_cast<size_t>(joint.joint)] = {
            morphbus::joint_command_t::MODE_POSITION, joint.sign * posture[leg][part],
            std::numbers::pi};
      }
    }
    for (const morphbus::actuator_t& command : commands) assembly->Actuate(command);
    assembly->Advance();
    t += 0.02;
  }
}
BENCHMARK(AssemblyTick)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace morphbus::sim

BENCHMARK_MAIN();
