#pragma once
// The physics of one robot on level ground: Bullet rigid bodies, hinges and sliders, stepped at a
// fixed rate, bit for bit repeatable. A fresh engine for every run.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "compiler/world/obstacle.h"
#include "sim/rigid_body_model.h"
#include "sim/servo.h"

namespace morphbus::sim {

/// What a world is made with; all of it enters the world's hash.
struct WorldOptions {
  /// Coulomb coefficient of every contact in which neither a link nor an obstacle has its own.
  double friction = 0.8;
  /// Whether there is a level ground at y = 0.
  bool ground = true;
  /// Whether 9.81 m/s^2 pull downwards, along -y.
  bool gravity = true;
  /// Sim time of one Step, seconds.
  double physics_step_s = 1e-3;
  /// Iterations of Bullet's solver a step, at least 20: fewer make joints soft.
  int solver_iterations = 30;
  /// The velocity that servos ask for per error (1/s), 60 or more.
  double servo_gain_per_s = 60;
  /// What stands in the world beside the robot.
  std::vector<world::Obstacle> obstacles = {};
};

/// Pose and velocities of one body; body frame B, see sim/rigid_body_model.h.
struct BodyState {
  Pose X_WB = Pose::Identity();
  /// Velocity of the centre of mass, in W (m/s).
  Eigen::Vector3d v_WBo_W = Eigen::Vector3d::Zero();
  /// Angular velocity, in W (rad/s).
  Eigen::Vector3d w_WB_W = Eigen::Vector3d::Zero();
};

/// One joint now, in canonical angles (sim/rigid_body_model.h).
struct JointState {
  /// From the true relative pose of the bodies, rad or m; counted on over full turns.
  double theta = 0.0;
  /// Its rate, from the true velocities, rad/s or m/s.
  double rate = 0.0;
  /// What the motor exerted in the last step on body_2, N m or N.
  double motor_effort = 0.0;
  /// The motor's side of the joint and its rate, which the joint's sensor measures: theta and its
  /// rate, off by up to half of the play where there is any.
  double motor = 0.0;
  double motor_rate = 0.0;
};

/// A robot in a Bullet engine of its own.
///
/// The engine is fed in canonical order, so that congruent robots pose it the same problem, and is
/// set to be deterministic: two worlds built alike and given the same commands run alike to the
/// last bit.
class World {
 public:
  /// Builds the engine for `rigid_bodies`, all at rest. Indices of bodies and joints below are
  /// those of `rigid_bodies`; one that is out of range is a bug of the caller.
  World(const RigidBodyModel& rigid_bodies, const WorldOptions& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// One physics step: servos, pushes, the engine, then the joints are measured. Nothing once the
  /// world is lost.
  void Step();

  /// Whether a body got so far or so fast that nothing can be computed any more: the engine would
  /// not survive another step.
  [[nodiscard]] bool lost() const { return lost_; }

  /// Commands to a joint's servo, by canonical joint index and in canonical angles.
  void Command(int joint, const ServoCommand& command);

  /// A force on a body at its centre of mass, for the next `steps` steps (N, W).
  void Push(int body, const Eigen::Vector3d& f_W, int steps);

  /// The body now.
  [[nodiscard]] BodyState body(int index) const;
  /// Puts a body where and as fast as `state` says, before the first step; a rebuilt world goes on
  /// from the old one's states in this way.
  void set_body(int index, const BodyState& state);

  /// The joint now, as it was measured after the last step.
  [[nodiscard]] JointState joint(int index) const;

  /// Where the joint's servo wants it, in canonical angles (rad or m).
  [[nodiscard]] double set_point(int joint) const;
  /// Sets that, and where the motor's side of the joint is, for a world that goes on where another
  /// one was.
  void SetServo(int joint, double set_point, double motor);

  /// How far from `p_WS` a ray along the unit vector `d_W` first meets something, m; at most
  /// `range_m`, which also stands for nothing. Links of `module` are not seen. Links are smaller
  /// here by kHullShrink, and the ground is higher by that.
  [[nodiscard]] double RayDistance(const Eigen::Vector3d& p_WS, const Eigen::Vector3d& d_W,
                                   double range_m, int module) const;

  /// Where something touches a link now, and the unit direction from the link to what touches it.
  struct Touch {
    Eigen::Vector3d p_WT;
    Eigen::Vector3d outward_W;
  };
  /// All touches of a link, from the ground, obstacles and links of other modules; what is docked
  /// to it is no touch.
  [[nodiscard]] std::vector<Touch> Touches(LinkRef link) const;

  /// Adds to the forces on links, `f_W[module][link]`, what the ground and obstacles exerted on
  /// them in the last step, friction included (N, W). Forces between links of the robot are left
  /// out: they cancel in every sum over the robot, and hulls that are drawn in touch elsewhere than
  /// links do.
  void AddContactForces(std::vector<std::vector<Eigen::Vector3d>>* f_W) const;

  /// Where a link of the robot lies in an obstacle.
  struct Overlap {
    LinkRef link;
    int obstacle = 0;  ///< Number in WorldOptions::obstacles.
    double depth_m = 0.0;
    /// The unit direction in which the link gets out by that depth.
    Eigen::Vector3d outward_W;
  };
  /// Overlaps of links with obstacles by more than `depth_m`, the deepest of each pair, in order of
  /// obstacles, then depth. The engine looks for contacts for this and remembers them: the world
  /// cannot be stepped afterwards as a fresh one would be.
  [[nodiscard]] std::vector<Overlap> FindOverlaps(double depth_m);
  /// The box round an obstacle, and that round the whole robot, as they are now (W, m).
  [[nodiscard]] Eigen::AlignedBox3d ObstacleBox(int obstacle) const;
  [[nodiscard]] Eigen::AlignedBox3d RobotBox() const;

  /// What the world was made of.
  [[nodiscard]] const RigidBodyModel& rigid_bodies() const { return rigid_bodies_; }
  [[nodiscard]] const WorldOptions& options() const { return options_; }

  /// Hash of all that entered the engine: equal worlds give equal runs. 64 bits, as 16 hex digits.
  [[nodiscard]] std::string hash() const;

 private:
  friend struct WorldContacts;  ///< By which tests see what touches.
  struct Engine;
  RigidBodyModel rigid_bodies_;
  WorldOptions options_;
  std::unique_ptr<Engine> engine_;
  bool lost_ = false;
};

}  // namespace morphbus::sim
