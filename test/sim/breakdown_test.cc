#include "sim/breakdown.h"

#include <gtest/gtest.h>

#include <memory>

#include "sim/link_physics.h"
#include "test/sim/toy_robots.h"

namespace morphbus::sim {
namespace {

using Eigen::Vector3d;

/// A cube in a world of its own, which begins with this velocity (m/s) and turn rate (rad/s).
class MovingBox {
 public:
  MovingBox(const Vector3d& v_W, const Vector3d& w_W) : model_(test::MakeBox()) {
    world_ = std::make_unique<World>(
        BuildRigidBodyModel(*model_, robot(), ComputeLinkPhysics(*model_, robot()),
                            PlaceOnGround(*model_, robot()), model::StartValues(robot())),
        WorldOptions{.gravity = false});
    BodyState state = world_->body(0);
    state.v_WBo_W = v_W;
    state.w_WB_W = w_W;
    world_->set_body(0, state);
  }

  [[nodiscard]] const model::Robot& robot() const { return model_->robots[0]; }
  [[nodiscard]] World& world() { return *world_; }
  [[nodiscard]] std::string Why() const { return WhyBroken(*world_, *model_, robot()); }

 private:
  std::shared_ptr<const model::Model> model_;
  std::unique_ptr<World> world_;
};

TEST(Breakdown, AFastBodyIsStillSomewhere) {
  MovingBox box({0, 100, 0}, {0, 0, 100});
  for (int step = 0; step < 100; ++step) box.world().Step();
  EXPECT_FALSE(box.world().lost());
  EXPECT_EQ(box.Why(), "");
}

TEST(Breakdown, ABodyThatIsNowhereIsLostAndTheWorldStandsStill) {
  MovingBox box({0, 1e10, 0}, Vector3d::Zero());
  EXPECT_FALSE(box.world().lost()) << "only a step shows it";
  box.world().Step();
  EXPECT_TRUE(box.world().lost());
  EXPECT_EQ(box.Why(),
            "the simulation broke down: a body is nowhere; lessen the push, 'torque=' or the load "
            "that forces it");
  // Another step would be one into the engine's undefined behaviour.
  const Vector3d p_W = box.world().body(0).X_WB.translation();
  box.world().Step();
  EXPECT_EQ(Vector3d(box.world().body(0).X_WB.translation()), p_W);
  EXPECT_TRUE(box.world().lost());
}

}  // namespace
}  // namespace morphbus::sim
