#include "sim/world_engine.h"

#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "compiler/model/link_mass.h"
#include "sim/bullet_math.h"
#include "sim/link_physics.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

// Part of a joint's drift that the engine takes back in one step. With 0.4 the quadruped tilts by
// up to 6.5 degrees and its heading after five gait cycles depends on chance (2 to 14 degrees);
// with 0.8 and 30 iterations it tilts 2.3 and turns 1 to 6 for friction 0.7 to 1.0 (measured).
constexpr double kJointErrorReduction = 0.8;

// By so much Bullet's broad phase enlarges boxes (m). Its own 0.05 suits furniture: it makes nearly
// all links of a robot of 6.5 cm cubes neighbours of each other. Results do not depend on it.
constexpr double kBroadphaseMargin = 0.005;

// Bullet asks this before it looks at two parts of bodies: links of one module never collide.
bool PartsMayCollide(const btCollisionShape* a, const btCollisionShape* b) {
  return a->getUserIndex() < 0 || a->getUserIndex() != b->getUserIndex();
}

}  // namespace

int LinkOfPart(const btCollisionObject& object, int part) {
  const btCollisionShape* shape = object.getCollisionShape();
  if (shape->isCompound()) {
    const auto* compound = static_cast<const btCompoundShape*>(shape);
    if (part < 0 || part >= compound->getNumChildShapes()) return -1;
    shape = compound->getChildShape(part);
  }
  return shape->getUserIndex2();
}

void FrictionWorld::SetFrictions(const std::vector<BodySpec>& bodies,
                                 const std::vector<world::Obstacle>& obstacles,
                                 double ground_friction) {
  const bool any = std::ranges::any_of(bodies, [](const BodySpec& body) {
    return std::ranges::any_of(body.links,
                               [](const LinkSpec& link) { return link.friction.has_value(); });
  });
  bodies_ = any ? &bodies : nullptr;
  // Where the ground has no friction, obstacles have none either.
  obstacles_ = ground_friction > 0.0 ? &obstacles : nullptr;
}

std::optional<double> FrictionWorld::LinkFriction(const btCollisionObject& object, int part) const {
  const int body = object.getUserIndex();
  const int link = body < 0 ? -1 : LinkOfPart(object, part);
  return link < 0 ? std::nullopt : (*bodies_)[body].links[link].friction;
}

std::optional<double> FrictionWorld::ObstacleFriction(const btCollisionObject& object) const {
  // The ground has neither number.
  const int obstacle = object.getUserIndex() >= 0 ? -1 : object.getUserIndex2();
  return obstacle < 0 || obstacles_ == nullptr ? std::nullopt : (*obstacles_)[obstacle].friction;
}

void FrictionWorld::solveConstraints(btContactSolverInfo& info) {
  const int manifolds = bodies_ == nullptr ? 0 : getDispatcher()->getNumManifolds();
  for (int i = 0; i < manifolds; ++i) {
    btPersistentManifold& manifold = *getDispatcher()->getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      btManifoldPoint& point = manifold.getContactPoint(k);
      auto a = LinkFriction(*manifold.getBody0(), point.m_index0);
      auto b = LinkFriction(*manifold.getBody1(), point.m_index1);
      // What no link with a coefficient of its own touches is the engine's.
      if (!a && !b) continue;
      if (!a) a = ObstacleFriction(*manifold.getBody0());
      if (!b) b = ObstacleFriction(*manifold.getBody1());
      // Of two coefficients the geometric mean counts, as for Bullet; one alone counts as it is.
      if (a && b) {
        point.m_combinedFriction = std::sqrt(*a * *b);
      } else if (a || b) {
        point.m_combinedFriction = a ? *a : *b;
      }
    }
  }
  btDiscreteDynamicsWorld::solveConstraints(info);
}

// Bullet's world refers to bodies and constraints that are not its own: they are taken out before
// they go.
World::Engine::~Engine() {
  for (EngineJoint& joint : joints) {
    if (joint.hinge) dynamics.removeConstraint(joint.hinge.get());
    if (joint.slider) dynamics.removeConstraint(joint.slider.get());
  }
  for (const std::unique_ptr<btRigidBody>& body : bodies) dynamics.removeRigidBody(body.get());
  for (const std::unique_ptr<btRigidBody>& obstacle : obstacles) {
    dynamics.removeRigidBody(obstacle.get());
  }
  if (ground) dynamics.removeRigidBody(ground.get());
}

void World::Engine::Configure(const WorldOptions& options) {
  // The margin and the callbacks for compound shapes are global in Bullet; every world of this
  // program has the same ones.
  static std::once_flag set;
  std::call_once(set, [] {
    gDbvtMargin = kBroadphaseMargin;
    gCompoundChildShapePairCallback = PartsMayCollide;
    gCompoundCompoundChildShapePairCallback = PartsMayCollide;
  });
  broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
  dynamics.setGravity(btVector3(0.0, options.gravity ? -model::kGravity : 0.0, 0.0));
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

// Triangles are thick by their margin, on both sides.
std::unique_ptr<btCollisionShape> World::Engine::MakeSurface(const world::TriangleMesh& mesh) {
  surfaces.push_back(std::make_unique<btTriangleMesh>());
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    surfaces.back()->addTriangle(ToBullet(mesh.points[triangle[0]]),
                                 ToBullet(mesh.points[triangle[1]]),
                                 ToBullet(mesh.points[triangle[2]]));
  }
  auto shape = std::make_unique<btBvhTriangleMeshShape>(surfaces.back().get(), true);
  shape->setMargin(kHullShrink);
  return shape;
}

// Obstacles come to meet the smaller links as the ground does.
void World::Engine::AddObstacle(const world::Obstacle& obstacle, double ground_friction) {
  const Vector3d& size = obstacle.size;
  std::unique_ptr<btCollisionShape> shape;
  // Links are smaller for the engine by kHullShrink, and the ground is higher by that: obstacles
  // are larger, so that what touches in the model touches here.
  switch (obstacle.shape) {
    case world::Shape::kBox:
      shape = std::make_unique<btBoxShape>(
          ToBullet(Vector3d(0.5 * size + Vector3d::Constant(kHullShrink))));
      break;
    case world::Shape::kCylinder:
      shape = std::make_unique<btCylinderShapeZ>(
          btVector3(size.x() + kHullShrink, size.x() + kHullShrink, 0.5 * size.y() + kHullShrink));
      break;
    case world::Shape::kSphere:
      shape = std::make_unique<btSphereShape>(size.x() + kHullShrink);
      break;
    case world::Shape::kPlane:
      shape = std::make_unique<btStaticPlaneShape>(btVector3(0.0, 0.0, 1.0), kHullShrink);
      shape->setMargin(0.0);
      break;
    case world::Shape::kMesh:
      shape = MakeSurface(*obstacle.mesh);
      break;
  }
  auto body = std::make_unique<btRigidBody>(0.0, nullptr, Keep(std::move(shape)));
  body->setWorldTransform(ToBullet(obstacle.X_WO));
  // The engine multiplies the coefficients of the two that touch, and the robot's is the ground's.
  const bool own = obstacle.friction && ground_friction > 0.0;
  body->setFriction(own ? *obstacle.friction / ground_friction : ground_friction);
  body->setUserIndex(-1);
  // By this number FindOverlaps names the obstacle.
  body->setUserIndex2(static_cast<int>(obstacles.size()));
  dynamics.addRigidBody(body.get());
  obstacles.push_back(std::move(body));
}

// A compound is of the hulls of its links' parts. Corners are in B already, so that parts need no
// pose.
btCollisionShape* World::Engine::MakeShape(const BodySpec& spec) {
  std::vector<btCollisionShape*> parts;
  for (size_t l = 0; l < spec.links.size(); ++l) {
    const LinkSpec& link = spec.links[l];
    for (const std::vector<Vector3d>& part : link.parts_B) {
      auto hull = std::make_unique<btConvexHullShape>();
      hull->setMargin(kCollisionMargin);
      for (const Vector3d& corner : part) hull->addPoint(ToBullet(corner), false);
      hull->recalcLocalAabb();
      // The module's number, by which PartsMayCollide and rays pass over its own links.
      hull->setUserIndex(link.group);
      // By this number, the link's in its body, Touches tells whose part a contact is of.
      hull->setUserIndex2(static_cast<int>(l));
      parts.push_back(Keep(std::move(hull)));
    }
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

void World::Engine::AddJoint(const JointSpec& spec, double gain_per_s) {
  const bool inside = spec.body_1 == spec.body_2;
  joints.push_back(MakeJoint(spec, inside ? nullptr : bodies[spec.body_1].get(),
                             inside ? nullptr : bodies[spec.body_2].get(), gain_per_s));
  if (!inside) dynamics.addConstraint(ConstraintOf(joints.back()), true);
}

}  // namespace morphbus::sim
