#include "sim/world.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "compiler/base/check.h"
#include "sim/link_physics.h"

namespace morphbus::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGravity = 9.81;  // m/s^2

// The mechanical stops lie this much beyond the limits that the servo keeps (rad and m).
constexpr double kStopSlack = 0.035;
constexpr double kStopSlackLinear = 1e-3;

// Part of a joint's drift that the engine takes back in one step. With 0.4 the quadruped tilts by
// up to 6.5 degrees and its heading after five gait cycles depends on chance (2 to 14 degrees);
// with 0.8 and 30 iterations it tilts 2.3 and turns 1 to 6 for friction 0.7 to 1.0 (measured).
constexpr double kJointErrorReduction = 0.8;

// By so much Bullet's broad phase enlarges boxes (m). Its own 0.05 suits furniture: it makes nearly
// all links of a robot of 6.5 cm cubes neighbours of each other. Results do not depend on it.
constexpr double kBroadphaseMargin = 0.005;

// Vectors, rotations and poses between Eigen and Bullet; both are in double precision, so nothing
// is lost.
btVector3 ToBullet(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d FromBullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

btMatrix3x3 ToBullet(const Matrix3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
Matrix3d FromBullet(const btMatrix3x3& R) {
  Matrix3d out;
  for (int row = 0; row < 3; ++row) out.row(row) = FromBullet(R.getRow(row)).transpose();
  return out;
}

btTransform ToBullet(const Pose& X) {
  return btTransform(ToBullet(Matrix3d(X.linear())), ToBullet(Vector3d(X.translation())));
}

// Bullet asks this before it looks at two parts of bodies: links of one module never collide.
bool PartsMayCollide(const btCollisionShape* a, const btCollisionShape* b) {
  return a->getUserIndex() < 0 || a->getUserIndex() != b->getUserIndex();
}

// Bodies carry their index as user index, the ground -1.
class PairFilter : public btOverlapFilterCallback {
 public:
  explicit PairFilter(const std::vector<std::vector<bool>>* may_collide)
      : may_collide_(may_collide) {}

  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    const int i = static_cast<const btCollisionObject*>(a->m_clientObject)->getUserIndex();
    const int j = static_cast<const btCollisionObject*>(b->m_clientObject)->getUserIndex();
    if (i < 0 || j < 0) return i != j;
    return (*may_collide_)[i][j];
  }

 private:
  const std::vector<std::vector<bool>>* may_collide_;
};

// Two unit vectors that make `axis` a right-handed frame; first column `axis` itself for sliders.
Matrix3d FrameAround(const Vector3d& axis, bool axis_is_x) {
  // The axis of W that is furthest from `axis` gives the second direction, so that none is near
  // zero.
  int least = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(axis(k)) < std::abs(axis(least))) least = k;
  }
  const Vector3d u = axis.cross(Vector3d::Unit(least)).normalized();
  Matrix3d frame;
  if (axis_is_x) {
    frame << axis, u, axis.cross(u);
  } else {
    frame << u, axis.cross(u), axis;
  }
  return frame;
}

bool Slides(const JointSpec& joint) { return joint.type == model::JointType::kPrismatic; }

// One joint in the engine. Bullet's A is body 2, so that its angles and velocities are theta's.
struct EngineJoint {
  btRigidBody* body_1 = nullptr;
  btRigidBody* body_2 = nullptr;
  btTransform X_B1J;
  btTransform X_B2J;
  std::unique_ptr<btHingeConstraint> hinge;
  std::unique_ptr<btSliderConstraint> slider;
  std::unique_ptr<btJointFeedback> feedback;
  btVector3 motor_axis_W{0, 0, 0};
  btVector3 motor_arm_W{0, 0, 0};  ///< From body 2's centre of mass to the axis.
  Servo servo{{}, 0.0};
  JointState state;
};

// Notes the line about which the coming step's motor will act: the mean of the two bodies' ideas of
// the axis, weighted as the engine does. About any other line shocks would show as motor torque.
void NoteMotorLine(EngineJoint* joint) {
  // A slider's motor pushes along body 1's idea of the axis; Bullet's slider has it so.
  const btMatrix3x3& R_WB1 = joint->body_1->getWorldTransform().getBasis();
  const btMatrix3x3& R_WB2 = joint->body_2->getWorldTransform().getBasis();
  if (joint->slider) {
    joint->motor_axis_W = R_WB1 * joint->X_B1J.getBasis().getColumn(0);
    return;
  }
  joint->motor_axis_W =
      (R_WB2 * joint->X_B2J.getBasis().getColumn(2) * joint->body_1->getInvMass() +
       R_WB1 * joint->X_B1J.getBasis().getColumn(2) * joint->body_2->getInvMass())
          .normalized();
  joint->motor_arm_W = R_WB2 * joint->X_B2J.getOrigin();
}

// What the motor exerted on body 2 in the last step about or along its line: the engine reports all
// that the joint exerted, of which the part along the axis is the motor's (N m or N).
double MotorEffort(const EngineJoint& joint) {
  const btJointFeedback& applied = *joint.feedback;
  if (joint.slider) return applied.m_appliedForceBodyB.dot(joint.motor_axis_W);
  return joint.motor_axis_W.dot(applied.m_appliedTorqueBodyA -
                                joint.motor_arm_W.cross(applied.m_appliedForceBodyA));
}

// The true angle and rate of a hinge, from the two bodies' poses and velocities.
void MeasureHinge(EngineJoint* joint) {
  const btMatrix3x3 R_WJ1 = joint->body_1->getWorldTransform().getBasis() * joint->X_B1J.getBasis();
  const btVector3 x2_W =
      joint->body_2->getWorldTransform().getBasis() * joint->X_B2J.getBasis().getColumn(0);
  // Frame J's x axis on body 2, seen in J on body 1, shows the angle.
  const double angle = std::atan2(x2_W.dot(R_WJ1.getColumn(1)), x2_W.dot(R_WJ1.getColumn(0)));
  // The angle counts on over full turns: the step is the short way round.
  const double step = std::remainder(angle - joint->state.theta, 2.0 * std::numbers::pi);
  joint->state.theta += step;
  const btVector3 axis_W = R_WJ1.getColumn(2);
  joint->state.rate =
      axis_W.dot(joint->body_2->getAngularVelocity() - joint->body_1->getAngularVelocity());
}

// The true way and rate of a slider: of J's origin on body 2, along the axis of J on body 1.
void MeasureSlider(EngineJoint* joint) {
  const btTransform X_WJ1 = joint->body_1->getWorldTransform() * joint->X_B1J;
  const btVector3 p_WJ2 = joint->body_2->getWorldTransform() * joint->X_B2J.getOrigin();
  const btVector3 axis_W = X_WJ1.getBasis().getColumn(0);
  joint->state.theta = axis_W.dot(p_WJ2 - X_WJ1.getOrigin());
  // Both bodies' velocities at the same point, so that turning as a whole counts for nothing.
  const btVector3 r1 = p_WJ2 - joint->body_1->getCenterOfMassPosition();
  const btVector3 r2 = p_WJ2 - joint->body_2->getCenterOfMassPosition();
  joint->state.rate = axis_W.dot(joint->body_2->getVelocityInLocalPoint(r2) -
                                 joint->body_1->getVelocityInLocalPoint(r1));
}

// A joint inside one body has neither constraint nor feedback and keeps reading 0.
void Measure(EngineJoint* joint) {
  if (joint->hinge) MeasureHinge(joint);
  if (joint->slider) MeasureSlider(joint);
  if (joint->feedback) joint->state.motor_effort = MotorEffort(*joint);
}

// A hinge with its mechanical stops a little beyond the joint's limits.
std::unique_ptr<btHingeConstraint> MakeHinge(const JointSpec& spec, const EngineJoint& joint) {
  auto hinge = std::make_unique<btHingeConstraint>(*joint.body_2, *joint.body_1, joint.X_B2J,
                                                   joint.X_B1J, false);
  const double low = spec.lower - kStopSlack;
  const double high = spec.upper + kStopSlack;
  // The engine knows angles within half a turn only; wider joints have no mechanical stop.
  const bool has_stop = low > -std::numbers::pi && high < std::numbers::pi;
  // Bullet takes a lower limit above the upper one for no limit.
  hinge->setLimit(has_stop ? low : 1.0, has_stop ? high : -1.0);
  return hinge;
}

// A slider that cannot turn, with stops likewise.
std::unique_ptr<btSliderConstraint> MakeSlider(const JointSpec& spec, const EngineJoint& joint) {
  auto slider = std::make_unique<btSliderConstraint>(*joint.body_1, *joint.body_2, joint.X_B1J,
                                                     joint.X_B2J, true);
  slider->setLowerAngLimit(0.0);
  slider->setUpperAngLimit(0.0);
  const bool has_stop = std::isfinite(spec.lower) && std::isfinite(spec.upper);
  slider->setLowerLinLimit(has_stop ? spec.lower - kStopSlackLinear : 1.0);
  slider->setUpperLinLimit(has_stop ? spec.upper + kStopSlackLinear : -1.0);
  return slider;
}

}  // namespace

// Members in order of construction; Bullet wants the reverse for destruction.
struct World::Engine {
  explicit Engine(const std::vector<std::vector<bool>>* may_collide) : filter(may_collide) {}
  ~Engine();

  void Configure(const WorldOptions& options);
  void AddGround(double friction);
  void AddBody(const BodySpec& spec, double friction);
  void AddJoint(const JointSpec& spec, double gain_per_s);
  btCollisionShape* MakeShape(const BodySpec& spec);
  btCollisionShape* Keep(std::unique_ptr<btCollisionShape> shape) {
    shapes.push_back(std::move(shape));
    return shapes.back().get();
  }

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  PairFilter filter;
  btDiscreteDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::unique_ptr<btRigidBody> ground;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<EngineJoint> joints;
  struct PushForce {
    int body = 0;
    Vector3d f_W;
    int steps = 0;
  };
  std::vector<PushForce> pushes;
};

// Bullet's world refers to bodies and constraints that are not its own: they are taken out before
// they go.
World::Engine::~Engine() {
  for (EngineJoint& joint : joints) {
    if (joint.hinge) dynamics.removeConstraint(joint.hinge.get());
    if (joint.slider) dynamics.removeConstraint(joint.slider.get());
  }
  for (const std::unique_ptr<btRigidBody>& body : bodies) dynamics.removeRigidBody(body.get());
  if (ground) dynamics.removeRigidBody(ground.get());
}

void World::Engine::Configure(const WorldOptions& options) {
  // The margin and the callbacks for compound shapes are global in Bullet; every world of this
  // program sets the same ones.
  gDbvtMargin = kBroadphaseMargin;
  gCompoundChildShapePairCallback = PartsMayCollide;
  gCompoundCompoundChildShapePairCallback = PartsMayCollide;
  broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
  dynamics.setGravity(btVector3(0.0, options.gravity ? -kGravity : 0.0, 0.0));
  // Pairs in a fixed order and all bodies in one island: the solver's sweep must not depend on
  // chance.
  dynamics.getDispatchInfo().m_deterministicOverlappingPairs = true;
  dynamics.getSimulationIslandManager()->setSplitIslands(false);
  // The accuracy of contacts and joints.
  btContactSolverInfo& info = dynamics.getSolverInfo();
  info.m_numIterations = options.solver_iterations;
  // One friction row a contact, along the sliding velocity: with two rows the directions are those
  // of the world's axes at rest, and the robot turns while it stands up.
  info.m_solverMode = SOLVER_USE_WARMSTARTING;
  info.m_erp = kJointErrorReduction;
}

void World::Engine::AddGround(double friction) {
  // Shapes are smaller than links on every side; the ground comes up to meet them, so that the
  // links themselves stand on y = 0.
  auto plane = std::make_unique<btStaticPlaneShape>(btVector3(0.0, 1.0, 0.0), kHullShrink);
  plane->setMargin(0.0);
  ground = std::make_unique<btRigidBody>(0.0, nullptr, Keep(std::move(plane)));
  ground->setFriction(friction);
  ground->setUserIndex(-1);
  dynamics.addRigidBody(ground.get());
}

// The shape of a body: nothing, one hull, or a compound of a hull a link. Corners are in B already,
// so that parts need no pose.
btCollisionShape* World::Engine::MakeShape(const BodySpec& spec) {
  std::vector<btCollisionShape*> parts;
  for (const LinkSpec& link : spec.links) {
    if (link.hull_B.empty()) continue;
    auto hull = std::make_unique<btConvexHullShape>();
    hull->setMargin(kCollisionMargin);
    for (const Vector3d& corner : link.hull_B) hull->addPoint(ToBullet(corner), false);
    hull->recalcLocalAabb();
    // PartsMayCollide asks for this.
    hull->setUserIndex(link.group);
    parts.push_back(Keep(std::move(hull)));
  }
  // Bullet wants a shape for every body, and a compound only where there is something to put
  // together.
  if (parts.empty()) return Keep(std::make_unique<btEmptyShape>());
  if (parts.size() == 1) return parts.front();
  auto compound = std::make_unique<btCompoundShape>(true, static_cast<int>(parts.size()));
  compound->setMargin(kCollisionMargin);
  for (btCollisionShape* part : parts) {
    compound->addChildShape(btTransform::getIdentity(), part);
  }
  return Keep(std::move(compound));
}

// One body at its start pose. It never falls asleep: a robot that stands still is still held by its
// servos.
void World::Engine::AddBody(const BodySpec& spec, double friction) {
  btRigidBody::btRigidBodyConstructionInfo info(spec.mass_kg, nullptr, MakeShape(spec),
                                                ToBullet(spec.inertia_B));
  info.m_startWorldTransform = ToBullet(spec.X_WB);
  info.m_friction = friction;
  auto body = std::make_unique<btRigidBody>(info);
  body->setActivationState(DISABLE_DEACTIVATION);
  body->setUserIndex(static_cast<int>(bodies.size()));
  dynamics.addRigidBody(body.get());
  bodies.push_back(std::move(body));
}

// One joint with its servo. A joint inside one body gets a servo only, whose set-point moves for
// nothing.
void World::Engine::AddJoint(const JointSpec& spec, double gain_per_s) {
  EngineJoint joint;
  const ServoLimits limits{spec.lower, spec.upper, spec.speed};
  joint.servo = Servo(limits, gain_per_s);
  if (spec.body_1 != spec.body_2) {
    joint.body_1 = bodies[spec.body_1].get();
    joint.body_2 = bodies[spec.body_2].get();
    // The joint's frame J is fixed in both bodies where they are now, at theta = 0.
    Pose X_WJ = Pose::Identity();
    X_WJ.linear() = FrameAround(spec.axis_W, Slides(spec));
    X_WJ.translation() = spec.p_WJ;
    joint.X_B1J = joint.body_1->getWorldTransform().inverse() * ToBullet(X_WJ);
    joint.X_B2J = joint.body_2->getWorldTransform().inverse() * ToBullet(X_WJ);
    // Bullet's z axis is a hinge's, its x axis a slider's (FrameAround).
    btTypedConstraint* constraint = nullptr;
    if (Slides(spec)) {
      joint.slider = MakeSlider(spec, joint);
      constraint = joint.slider.get();
    } else {
      joint.hinge = MakeHinge(spec, joint);
      constraint = joint.hinge.get();
    }
    // The engine writes what the joint exerts here, for MotorEffort.
    joint.feedback = std::make_unique<btJointFeedback>();
    constraint->setJointFeedback(joint.feedback.get());
    dynamics.addConstraint(constraint, true);
  }
  joints.push_back(std::move(joint));
}

World::World(const RigidBodyModel& rigid_bodies, const WorldOptions& options)
    : rigid_bodies_(rigid_bodies),
      options_(options),
      engine_(std::make_unique<Engine>(&rigid_bodies_.may_collide)) {
  // The engine multiplies the coefficients of the two that touch.
  const double friction = std::sqrt(std::max(0.0, options_.friction));
  engine_->Configure(options_);
  if (options_.ground) engine_->AddGround(friction);
  for (const BodySpec& body : rigid_bodies_.bodies) engine_->AddBody(body, friction);
  for (const JointSpec& joint : rigid_bodies_.joints) {
    engine_->AddJoint(joint, options_.servo_gain_per_s);
  }
}

World::~World() = default;

void World::Step() {
  const double dt = options_.physics_step_s;
  // The servos ask their motors for velocities, with the joint's effort as the most they may exert.
  // A hinge's motor is limited by impulse, a slider's by force.
  for (size_t i = 0; i < engine_->joints.size(); ++i) {
    EngineJoint& joint = engine_->joints[i];
    const double effort = rigid_bodies_.joints[i].effort;
    const double velocity = joint.servo.Step(joint.state.theta, joint.state.rate, dt);
    if (joint.feedback) NoteMotorLine(&joint);
    if (joint.hinge) joint.hinge->enableAngularMotor(true, velocity, effort * dt);
    if (joint.slider) {
      joint.slider->setPoweredLinMotor(true);
      joint.slider->setTargetLinMotorVelocity(velocity);
      joint.slider->setMaxLinMotorForce(effort);
    }
  }
  // Pushes from outside, as long as they last.
  for (Engine::PushForce& push : engine_->pushes) {
    engine_->bodies[push.body]->applyCentralForce(ToBullet(push.f_W));
    --push.steps;
  }
  std::erase_if(engine_->pushes, [](const Engine::PushForce& push) { return push.steps <= 0; });
  // Exactly one step of dt, without Bullet's own interpolation; then the angles are read from the
  // poses.
  engine_->dynamics.stepSimulation(dt, 0);
  for (EngineJoint& joint : engine_->joints) Measure(&joint);
}

void World::Command(int joint, const ServoCommand& command) {
  engine_->joints[joint].servo.Command(command);
}

void World::Push(int body, const Vector3d& f_W, int steps) {
  if (steps > 0) engine_->pushes.push_back({body, f_W, steps});
}

BodyState World::body(int index) const {
  const btRigidBody& body = *engine_->bodies[index];
  BodyState state;
  state.X_WB.linear() = FromBullet(body.getWorldTransform().getBasis());
  state.X_WB.translation() = FromBullet(body.getWorldTransform().getOrigin());
  state.v_WBo_W = FromBullet(body.getLinearVelocity());
  state.w_WB_W = FromBullet(body.getAngularVelocity());
  return state;
}

void World::set_body(int index, const BodyState& state) {
  btRigidBody& body = *engine_->bodies[index];
  body.setCenterOfMassTransform(ToBullet(state.X_WB));
  body.setLinearVelocity(ToBullet(state.v_WBo_W));
  body.setAngularVelocity(ToBullet(state.w_WB_W));
}

JointState World::joint(int index) const { return engine_->joints[index].state; }

double World::set_point(int joint) const { return engine_->joints[joint].servo.set_point(); }

void World::set_set_point(int joint, double theta) {
  engine_->joints[joint].servo.set_set_point(theta);
}

std::vector<World::Contact> World::contacts() const {
  std::vector<Contact> contacts;
  // A manifold holds the contact points of one pair; distances below 0 are depths.
  for (int i = 0; i < engine_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *engine_->dispatcher.getManifoldByIndexInternal(i);
    double depth = -1.0;
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      depth = std::max(depth, -static_cast<double>(manifold.getContactPoint(k).getDistance()));
    }
    if (depth < 0.0) continue;
    const int a = manifold.getBody0()->getUserIndex();
    const int b = manifold.getBody1()->getUserIndex();
    contacts.push_back({std::min(a, b), std::max(a, b), depth});
  }
  return contacts;
}

std::string World::hash() const {
  uint64_t hash = 0;
  // The options first, mixed one by one, then the bodies and joints with that as the seed.
  const double numbers[] = {options_.friction,
                            options_.ground ? 1.0 : 0.0,
                            options_.gravity ? kGravity : 0.0,
                            options_.physics_step_s,
                            static_cast<double>(options_.solver_iterations),
                            options_.servo_gain_per_s};
  for (const double number : numbers) {
    hash = hash * 0x9E3779B97F4A7C15ULL + std::bit_cast<uint64_t>(number + 0.0);
  }
  hash = HashRigidBodyModel(rigid_bodies_, hash);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

}  // namespace morphbus::sim
