#pragma once
// The Bullet engine behind a World: private to sim/world*.cc.

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "sim/contact_pools.h"
#include "sim/engine_joint.h"
#include "sim/world.h"

namespace morphbus::sim {

/// Which bodies may collide. They carry their index as user index; the ground and obstacles have
/// -1, and collide with all bodies and not with each other.
class PairFilter : public btOverlapFilterCallback {
 public:
  /// `may_collide` is that of the RigidBodyModel, which outlives the engine.
  explicit PairFilter(const std::vector<std::vector<bool>>* may_collide)
      : may_collide_(may_collide) {}

  /// Asked by Bullet for each pair whose boxes overlap.
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    const int i = static_cast<const btCollisionObject*>(a->m_clientObject)->getUserIndex();
    const int j = static_cast<const btCollisionObject*>(b->m_clientObject)->getUserIndex();
    if (i < 0 || j < 0) return i != j;
    return (*may_collide_)[i][j];
  }

 private:
  const std::vector<std::vector<bool>>* may_collide_;
};

/// The link, by its number in its body, whose part touches; -1 for a body without parts.
int LinkOfPart(const btCollisionObject& object, int part);

/// Bullet's world, in which links and obstacles may have a friction of their own. A body has one
/// coefficient in Bullet, and may be of links with several: so those of contacts are set anew
/// between the search for them and their solution.
class FrictionWorld : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;

  /// From now on links have the frictions of `bodies`, if any has one of its own, and obstacles
  /// those of `obstacles`. Both outlive this.
  void SetFrictions(const std::vector<BodySpec>& bodies,
                    const std::vector<world::Obstacle>& obstacles, double ground_friction);

 protected:
  void solveConstraints(btContactSolverInfo& info) override;

 private:
  /// The coefficient of its own that the link, or the obstacle, on one side of a contact has.
  [[nodiscard]] std::optional<double> LinkFriction(const btCollisionObject& object, int part) const;
  [[nodiscard]] std::optional<double> ObstacleFriction(const btCollisionObject& object) const;

  /// Null where no link has a friction of its own: Bullet's products then are right already.
  const std::vector<BodySpec>* bodies_ = nullptr;
  const std::vector<world::Obstacle>* obstacles_ = nullptr;
};

/// The Bullet engine with all that is in it, in order of construction; Bullet wants the reverse for
/// destruction.
struct World::Engine {
  explicit Engine(const std::vector<std::vector<bool>>* may_collide)
      : configuration(ContactPools(may_collide->size())), filter(may_collide) {}
  ~Engine();

  /// Gravity, accuracy, and that pairs and the solver's sweep have a fixed order.
  void Configure(const WorldOptions& options);
  /// What the world consists of. The frictions are the square roots of the coefficients, because
  /// the engine multiplies those of the two that touch. An obstacle with a coefficient of its own
  /// gets what makes that of it in the product with the robot's.
  void AddGround(double friction);
  void AddObstacle(const world::Obstacle& obstacle, double ground_friction);
  /// The triangles of a mesh as a shape, kept in `surfaces`.
  std::unique_ptr<btCollisionShape> MakeSurface(const world::TriangleMesh& mesh);
  void AddBody(const BodySpec& spec, double friction);
  void AddJoint(const JointSpec& spec, double gain_per_s);
  /// The shape of a body: nothing, one hull, or a compound.
  btCollisionShape* MakeShape(const BodySpec& spec);
  /// Shapes live as long as the engine.
  btCollisionShape* Keep(std::unique_ptr<btCollisionShape> shape) {
    shapes.push_back(std::move(shape));
    return shapes.back().get();
  }

  /// Bullet's parts of a world; `dynamics` refers to all before it.
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  PairFilter filter;
  FrictionWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
  /// Triangles to which shapes refer.
  std::vector<std::unique_ptr<btTriangleMesh>> surfaces;
  /// The shapes of the ground, obstacles and bodies, which only refer to them.
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  /// Null in a world without ground.
  std::unique_ptr<btRigidBody> ground;
  /// By their numbers in WorldOptions::obstacles, and in the RigidBodyModel.
  std::vector<std::unique_ptr<btRigidBody>> obstacles;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<EngineJoint> joints;
  /// A force at a body's centre of mass (N, W), for so many steps more.
  struct PushForce {
    int body = 0;
    Eigen::Vector3d f_W;
    int steps = 0;
  };
  /// Those that last; several on one body add up.
  std::vector<PushForce> pushes;
};

}  // namespace morphbus::sim
