#include "sim/world.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "bridge/wire/stream_hash.h"
#include "compiler/model/link_mass.h"
#include "sim/bullet_math.h"
#include "sim/world_engine.h"

namespace morphbus::sim {

using Eigen::Vector3d;

namespace {

// Beyond this (m, m/s and rad/s) the engine's squares and products lose all meaning, and its search
// for the nearest points of two shapes reads outside its tables.
constexpr double kOutOfReach = 1e9;

// Whether the engine can still compute with the body; what is not a number fails the comparison.
bool IsInReach(const btRigidBody& body) {
  const double sum = body.getWorldTransform().getOrigin().length2() +
                     body.getWorldTransform().getBasis().getRow(0).length2() +
                     body.getLinearVelocity().length2() + body.getAngularVelocity().length2();
  return sum < kOutOfReach * kOutOfReach;
}

}  // namespace

World::World(const RigidBodyModel& rigid_bodies, const WorldOptions& options)
    : rigid_bodies_(rigid_bodies),
      options_(options),
      engine_(std::make_unique<Engine>(&rigid_bodies_.may_collide)) {
  // The engine multiplies the coefficients of the two that touch.
  const double friction = std::sqrt(std::max(0.0, options_.friction));
  // Always in this order, since the engine's results depend on it: the ground, obstacles as the
  // file has them, bodies and joints in their canonical order.
  engine_->Configure(options_);
  if (options_.ground) engine_->AddGround(friction);
  for (const world::Obstacle& obstacle : options_.obstacles) {
    engine_->AddObstacle(obstacle, friction);
  }
  for (const BodySpec& body : rigid_bodies_.bodies) engine_->AddBody(body, friction);
  engine_->dynamics.SetFrictions(rigid_bodies_.bodies, options_.obstacles, friction);
  for (const JointSpec& joint : rigid_bodies_.joints) {
    engine_->AddJoint(joint, options_.servo_gain_per_s);
  }
}

World::~World() = default;

void World::Step() {
  if (lost_) return;
  const double dt = options_.physics_step_s;
  // The servos ask their motors for velocities, with the joint's effort as the most they may exert.
  for (size_t i = 0; i < engine_->joints.size(); ++i) {
    DriveMotor(&engine_->joints[i], rigid_bodies_.joints[i].effort, dt);
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
  lost_ = !std::all_of(engine_->bodies.begin(), engine_->bodies.end(),
                       [](const auto& body) { return IsInReach(*body); });
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

void World::SetServo(int joint, double set_point, double motor) {
  engine_->joints[joint].servo.set_set_point(set_point);
  PlaceMotor(&engine_->joints[joint], motor);
}

std::string World::hash() const {
  uint64_t hash = 0;
  // Adding 0.0 makes 0 of -0, whose bits differ though the engine computes alike with both. The
  // factor is 2^64 divided by the golden ratio, as in Knuth's multiplicative hashing.
  const auto mix = [&hash](double number) {
    hash = hash * 0x9E3779B97F4A7C15ULL + std::bit_cast<uint64_t>(number + 0.0);
  };
  // The options first, mixed one by one, then the bodies and joints with that as the seed.
  for (const double number :
       {options_.friction, options_.ground ? 1.0 : 0.0, options_.gravity ? model::kGravity : 0.0,
        options_.physics_step_s, static_cast<double>(options_.solver_iterations),
        options_.servo_gain_per_s}) {
    mix(number);
  }
  // A world without obstacles keeps the hash that it had before there were any.
  for (const world::Obstacle& obstacle : options_.obstacles) {
    mix(static_cast<double>(obstacle.shape));
    for (const double number : obstacle.X_WO.matrix().reshaped()) mix(number);
    for (const double number : obstacle.size) mix(number);
    // -1 stands for the ground's friction, which no obstacle can have itself.
    mix(obstacle.friction.value_or(-1.0));
    if (!obstacle.mesh) continue;
    for (const Vector3d& p : obstacle.mesh->points) {
      for (const double number : p) mix(number);
    }
    for (const std::array<int, 3>& triangle : obstacle.mesh->triangles) {
      for (const int corner : triangle) mix(corner);
    }
  }
  return bridge::HexText(HashRigidBodyModel(rigid_bodies_, hash));
}

}  // namespace morphbus::sim
