#include "sim/arithmetic.h"

#include <BulletCollision/BroadphaseCollision/btSimpleBroadphase.h>
#include <btBulletDynamicsCommon.h>

#include <array>
#include <cmath>
#include <memory>

#include "bridge/wire/arithmetic_hash.h"
#include "bridge/wire/stream_hash.h"
#include "sim/contact_pools.h"

namespace morphbus::sim {
namespace {

using bridge::NumberHash;

/// The elementary functions that a run's numbers may come from, as they are bound in this program.
void AddElementaryFunctions(NumberHash* results) {
  // By their addresses: meant is what this program is linked with, and not what a compiler works
  // out in its place.
  using OfOne = double (*)(double);
  const std::array<OfOne, 20> of_one = {std::sin,   std::cos,   std::tan,   std::asin,  std::acos,
                                        std::atan,  std::sinh,  std::cosh,  std::tanh,  std::asinh,
                                        std::acosh, std::atanh, std::exp,   std::exp2,  std::expm1,
                                        std::log,   std::log2,  std::log10, std::log1p, std::cbrt};
  using OfTwo = double (*)(double, double);
  const std::array<OfTwo, 3> of_two = {std::atan2, std::pow, std::hypot};
  // Where a function is not defined it says so, which is one value more.
  // From where a function is next to its argument up to where the exponential overflows (exp(710)).
  for (const double x : {1e-9, 0.01, 0.3, -0.77, 0.999, 1.0, 1.7, -2.9, 31.4, 710.0}) {
    for (const OfOne function : of_one) results->Add(function(x));
    for (const double y : {0.6, -3.3}) {
      for (const OfTwo function : of_two) results->Add(function(x, y));
    }
  }
}

/// A world of a driven hinge between two bricks and of a third one that tumbles onto them, on level
/// ground. It uses Bullet as a World does, and nothing of what World adds.
class TestWorld {
 public:
  TestWorld() {
    dynamics_.setGravity(btVector3(0.0, -9.81, 0.0));
    dynamics_.getDispatchInfo().m_deterministicOverlappingPairs = true;
    dynamics_.getSolverInfo().m_numIterations = 20;
    AddBody(0.0, &ground_shape_, btTransform::getIdentity());
    // The first two bricks lie side by side, the third one comes down askew on their gap.
    const btQuaternion askew(btVector3(0.3, 0.5, 0.9).normalized(), 0.7);
    AddBody(0.4, &brick_, Place(btQuaternion::getIdentity(), -0.032));
    AddBody(0.3, &brick_, Place(btQuaternion::getIdentity(), 0.032));
    AddBody(0.2, &brick_, btTransform(askew, btVector3(0.004, 0.106, 0.003)));
    bodies_.back()->setLinearVelocity(btVector3(0.1, -0.7, 0.2));
    bodies_.back()->setAngularVelocity(btVector3(1.0, 2.0, -3.0));
    // The pivot lies in the middle of the gap between the two.
    const btVector3 pivot(0.032, 0.01, 0.0);
    hinge_ = std::make_unique<btHingeConstraint>(*bodies_[1], *bodies_[2], pivot,
                                                 pivot * btVector3(-1, 1, 1), btVector3(0, 0, 1),
                                                 btVector3(0, 0, 1));
    dynamics_.addConstraint(hinge_.get(), true);
  }
  ~TestWorld() {
    dynamics_.removeConstraint(hinge_.get());
    for (const auto& body : bodies_) dynamics_.removeRigidBody(body.get());
  }
  TestWorld(const TestWorld&) = delete;
  TestWorld& operator=(const TestWorld&) = delete;

  /// A hundred steps of a millisecond; adds where the bodies are and how they move.
  void Run(NumberHash* results) {
    for (int step = 0; step < 100; ++step) {
      // The motor's velocity swings, so that it both drives and brakes; its impulse is limited.
      hinge_->enableAngularMotor(true, 6.0 * std::sin(0.05 * step), 0.002);
      dynamics_.stepSimulation(1e-3, 0, 1e-3);
      // Ten states are enough: a difference in one step is in all steps after it.
      if (step % 10 == 9) AddState(results);
    }
  }

 private:
  static btTransform Place(const btQuaternion& turn, double north) {
    return btTransform(turn, btVector3(north, 0.0305, 0.0));
  }

  void AddBody(double mass, btCollisionShape* shape, const btTransform& place) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform = place;
    info.m_friction = 0.9;
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    // As in a World: a body that goes to sleep would depend on thresholds of its own.
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    dynamics_.addRigidBody(bodies_.back().get());
  }

  void AddState(NumberHash* results) const {
    for (const auto& body : bodies_) {
      const btTransform& place = body->getWorldTransform();
      // Of a rotation two rows: the third follows from them.
      for (const btVector3& v : {place.getOrigin(), place.getBasis()[0], place.getBasis()[1],
                                 body->getLinearVelocity(), body->getAngularVelocity()}) {
        for (int k = 0; k < 3; ++k) results->Add(v[k]);
      }
    }
    results->Add(hinge_->getHingeAngle());
  }

  /// A brick of 60 x 60 x 50 mm with margins of 1 mm.
  static btConvexHullShape MakeBrick() {
    btConvexHullShape brick;
    for (const double x : {-0.029, 0.029}) {
      for (const double y : {-0.029, 0.029}) {
        for (const double z : {-0.024, 0.024}) brick.addPoint(btVector3(x, y, z), false);
      }
    }
    brick.setMargin(0.001);
    brick.recalcLocalAabb();
    return brick;
  }

  /// More than the ground and the bricks.
  static constexpr int kMostBodies = 16;

  btDefaultCollisionConfiguration configuration_{ContactPools(kMostBodies)};
  btCollisionDispatcher dispatcher_{&configuration_};
  btSimpleBroadphase broadphase_{kMostBodies};
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld dynamics_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  btStaticPlaneShape ground_shape_{btVector3(0, 1, 0), 0.0};
  btConvexHullShape brick_ = MakeBrick();
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::unique_ptr<btHingeConstraint> hinge_;
};

std::string Fingerprint() {
  NumberHash results;
  results.Add(static_cast<int64_t>(bridge::ArithmeticHash()));
  AddElementaryFunctions(&results);
  TestWorld().Run(&results);
  return bridge::HexText(results.Digest());
}

}  // namespace

const std::string& ArithmeticFingerprint() {
  static const std::string fingerprint = Fingerprint();
  return fingerprint;
}

}  // namespace morphbus::sim
