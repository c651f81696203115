#pragma once
// The physics of one robot on level ground: Bullet rigid bodies, hinges and sliders, stepped at a
// fixed rate, bit for bit repeatable. A fresh engine for every run.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/bodies.h"
#include "sim/servo.h"

namespace morphbus::sim {

struct WorldOptions {
  double friction = 0.8;  ///< Coulomb coefficient of every contact.
  bool ground = true;     ///< A level ground at y = 0.
  bool gravity = true;    ///< 9.81 m/s^2 downwards.
  double physics_step_s = 1e-3;
  int solver_iterations = 30;    ///< At least 20 (fewer make joints soft).
  double servo_gain_per_s = 60;  ///< Servo velocity per error; 60 or more.
};

/// Position, and rates, of one body; body frame B, see sim/bodies.h.
struct BodyState {
  Pose X_WB = Pose::Identity();
  Eigen::Vector3d v_WBo_W = Eigen::Vector3d::Zero();  ///< m/s, of the centre of mass.
  Eigen::Vector3d w_WB_W = Eigen::Vector3d::Zero();   ///< rad/s.
};

/// In canonical angles (sim/bodies.h), rad or m.
struct JointState {
  double theta = 0.0;  ///< From the true relative pose; counted on over full turns.
  double rate = 0.0;
  double motor_effort = 0.0;  ///< What the motor exerted in the last step on body_2, N m or N.
};

class World {
 public:
  /// Builds the engine for `assembly`, all at rest.
  World(const Assembly& assembly, const WorldOptions& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// One physics step.
  void Step();

  /// Commands to a joint's servo, by canonical joint index and in canonical angles.
  void Command(int joint, const ServoCommand& command);

  /// A force on a body at its centre of mass, for the next `steps` steps (N, W).
  void Push(int body, const Eigen::Vector3d& f_W, int steps);

  [[nodiscard]] BodyState body(int index) const;
  void set_body(int index, const BodyState& state);  ///< Before the first step only.
  [[nodiscard]] JointState joint(int index) const;
  [[nodiscard]] double set_point(int joint) const;
  void set_set_point(int joint, double theta);

  /// Contacts between bodies (-1 stands for the ground) that touch now; for tests and reports.
  struct Contact {
    int body_1 = 0;
    int body_2 = 0;
    double depth_m = 0.0;
  };
  [[nodiscard]] std::vector<Contact> contacts() const;

  [[nodiscard]] const Assembly& assembly() const { return assembly_; }
  [[nodiscard]] const WorldOptions& options() const { return options_; }

  /// Hash of all that entered the engine: equal worlds give equal runs. 64 bits, as 16 hex digits.
  [[nodiscard]] std::string hash() const;

 private:
  struct Engine;
  Assembly assembly_;
  WorldOptions options_;
  std::unique_ptr<Engine> engine_;
};

}  // namespace morphbus::sim
