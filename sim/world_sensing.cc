// What rays and touching surfaces meet in a World.
#include <algorithm>
#include <tuple>

#include "sim/bullet_math.h"
#include "sim/link_physics.h"
#include "sim/world_engine.h"

namespace morphbus::sim {

using Eigen::Vector3d;

namespace {

// The nearest hit that is none of one module's links. Shapes carry the number of their module.
class NearestForeignHit : public btCollisionWorld::RayResultCallback {
 public:
  explicit NearestForeignHit(int group) : group_(group) {}

  btScalar addSingleResult(btCollisionWorld::LocalRayResult& hit, bool) override {
    // The return value says where the engine goes on looking: a link of one's own does not shorten
    // the ray.
    if (GroupOf(hit) == group_) return m_closestHitFraction;
    m_collisionObject = hit.m_collisionObject;
    m_closestHitFraction = hit.m_hitFraction;
    return hit.m_hitFraction;
  }

 private:
  // Parts of compounds are told by their number; what is no body of the robot has no module.
  static int GroupOf(const btCollisionWorld::LocalRayResult& hit) {
    if (hit.m_collisionObject->getUserIndex() < 0) return -1;
    const btCollisionShape* shape = hit.m_collisionObject->getCollisionShape();
    if (shape->isCompound()) {
      const auto* compound = static_cast<const btCompoundShape*>(shape);
      shape = compound->getChildShape(hit.m_localShapeInfo->m_triangleIndex);
    }
    return shape->getUserIndex();
  }

  int group_;
};

bool SameLink(const LinkRef& a, const LinkRef& b) {
  return a.module == b.module && a.link == b.link;
}

}  // namespace

double World::RayDistance(const Vector3d& p_WS, const Vector3d& d_W, double range_m,
                          int module) const {
  const std::vector<int>& bodies = rigid_bodies_.body_of[module];
  // The canonical number of the module stands at its links.
  int group = -1;
  for (const LinkSpec& link : rigid_bodies_.bodies[bodies.front()].links) {
    if (link.ref.module == module) group = link.group;
  }
  NearestForeignHit nearest(group);
  engine_->dynamics.rayTest(ToBullet(p_WS), ToBullet(Vector3d(p_WS + range_m * d_W)), nearest);
  return nearest.hasHit() ? nearest.m_closestHitFraction * range_m : range_m;
}

std::vector<World::Touch> World::Touches(LinkRef link) const {
  std::vector<Touch> touches;
  const int body = rigid_bodies_.body_of[link.module][link.link];
  for (int i = 0; i < engine_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *engine_->dispatcher.getManifoldByIndexInternal(i);
    // The body may be either of the two that touch.
    const bool is_0 = manifold.getBody0()->getUserIndex() == body;
    if (!is_0 && manifold.getBody1()->getUserIndex() != body) continue;
    const btCollisionObject& own = is_0 ? *manifold.getBody0() : *manifold.getBody1();
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      // Within the margins of both shapes things touch; farther they only come near.
      if (point.getDistance() > kCollisionMargin) continue;
      const int at = LinkOfPart(own, is_0 ? point.m_index0 : point.m_index1);
      // A body may have many links; only touches of this one's part count.
      if (at < 0 || !SameLink(rigid_bodies_.bodies[body].links[at].ref, link)) continue;
      // The engine's normal points from body 1 to body 0.
      const Vector3d normal = FromBullet(point.m_normalWorldOnB);
      const btVector3& p = is_0 ? point.getPositionWorldOnA() : point.getPositionWorldOnB();
      touches.push_back({FromBullet(p), is_0 ? Vector3d(-normal) : normal});
    }
  }
  return touches;
}

void World::AddContactForces(std::vector<std::vector<Vector3d>>* f_W) const {
  for (int i = 0; i < engine_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *engine_->dispatcher.getManifoldByIndexInternal(i);
    // One of the two is a body of the robot; the ground and obstacles have no number.
    const bool is_0 = manifold.getBody0()->getUserIndex() >= 0;
    const btCollisionObject& own = is_0 ? *manifold.getBody0() : *manifold.getBody1();
    const btCollisionObject& other = is_0 ? *manifold.getBody1() : *manifold.getBody0();
    if (other.getUserIndex() >= 0) continue;
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      const int at = LinkOfPart(own, is_0 ? point.m_index0 : point.m_index1);
      if (at < 0) continue;
      // The solver's impulses on body 0, along the normal and against the sliding; body 1 has the
      // opposite ones.
      const btVector3 impulse_W = point.m_appliedImpulse * point.m_normalWorldOnB +
                                  point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1;
      const LinkRef& link = rigid_bodies_.bodies[own.getUserIndex()].links[at].ref;
      (*f_W)[link.module][link.link] +=
          // An impulse (N s) over the step in which it acted is the mean force in it (N).
          (is_0 ? 1.0 : -1.0) / options_.physics_step_s * FromBullet(impulse_W);
    }
  }
}

std::vector<World::Overlap> World::FindOverlaps(double depth_m) {
  std::vector<Overlap> overlaps;
  // Contacts are looked for without a step of time.
  engine_->dynamics.performDiscreteCollisionDetection();
  for (int i = 0; i < engine_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *engine_->dispatcher.getManifoldByIndexInternal(i);
    // One of the two is a body of the robot, the other an obstacle, not the ground or a body.
    const bool is_0 = manifold.getBody0()->getUserIndex() >= 0;
    const btCollisionObject& own = is_0 ? *manifold.getBody0() : *manifold.getBody1();
    const btCollisionObject& other = is_0 ? *manifold.getBody1() : *manifold.getBody0();
    if (other.getUserIndex() >= 0 || other.getUserIndex2() < 0) continue;
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold.getContactPoint(k);
      const int at = LinkOfPart(own, is_0 ? point.m_index0 : point.m_index1);
      if (at < 0 || -point.getDistance() <= depth_m) continue;
      // The engine's normal points from body 1 to body 0.
      const Vector3d normal = FromBullet(point.m_normalWorldOnB);
      overlaps.push_back({rigid_bodies_.bodies[own.getUserIndex()].links[at].ref,
                          other.getUserIndex2(), -point.getDistance(),
                          is_0 ? normal : Vector3d(-normal)});
    }
  }
  // The deepest of each pair comes first and stays.
  std::sort(overlaps.begin(), overlaps.end(), [](const Overlap& a, const Overlap& b) {
    return std::tuple(a.obstacle, -a.depth_m, a.link.module, a.link.link) <
           std::tuple(b.obstacle, -b.depth_m, b.link.module, b.link.link);
  });
  std::vector<Overlap> deepest;
  for (const Overlap& overlap : overlaps) {
    if (std::none_of(deepest.begin(), deepest.end(), [&](const Overlap& known) {
          return known.obstacle == overlap.obstacle && SameLink(known.link, overlap.link);
        })) {
      deepest.push_back(overlap);
    }
  }
  return deepest;
}

namespace {

Eigen::AlignedBox3d BoxOf(const btRigidBody& body) {
  btVector3 low;
  btVector3 high;
  body.getAabb(low, high);
  return {FromBullet(low), FromBullet(high)};
}

}  // namespace

Eigen::AlignedBox3d World::ObstacleBox(int obstacle) const {
  return BoxOf(*engine_->obstacles[obstacle]);
}

Eigen::AlignedBox3d World::RobotBox() const {
  Eigen::AlignedBox3d box;
  for (const auto& body : engine_->bodies) box.extend(BoxOf(*body));
  return box;
}

}  // namespace morphbus::sim
