#pragma once
// One joint of the robot in the engine: Bullet's hinge or slider, its motor's line, its servo.

#include <btBulletDynamicsCommon.h>

#include <memory>

#include "sim/backlash.h"
#include "sim/rigid_body_model.h"
#include "sim/servo.h"
#include "sim/world.h"

namespace morphbus::sim {

/// Bullet's A is body 2, so that its angles and velocities are theta's. A joint inside one body has
/// no constraint, and its servo's set-point moves for nothing.
struct EngineJoint {
  btRigidBody* body_1 = nullptr;
  btRigidBody* body_2 = nullptr;
  /// The joint's frame J on both bodies, the same at theta = 0: its z axis is a hinge's, its x axis
  /// a slider's.
  btTransform X_B1J;
  btTransform X_B2J;
  /// At most one of them.
  std::unique_ptr<btHingeConstraint> hinge;
  std::unique_ptr<btSliderConstraint> slider;
  /// The engine writes here what the joint exerts.
  std::unique_ptr<btJointFeedback> feedback;
  /// The line about which, or along which, the coming step's motor acts: its direction, and from
  /// body 2's centre of mass to it (m).
  btVector3 motor_axis_W{0, 0, 0};
  btVector3 motor_arm_W{0, 0, 0};
  Servo servo{{}, 0.0};
  /// Where the motor is that the servo drives; without play it is where the link is.
  MotorSide motor{0.0, 0.0};
  /// The velocity that the servo asked for in the coming step (rad/s or m/s), and its length (s).
  double asked = 0.0;
  double step_s = 0.0;
  JointState state;
};

/// The joint between two bodies as they lie now, at theta = 0. The bodies are null for a joint
/// inside one body. `gain_per_s` is WorldOptions::servo_gain_per_s.
EngineJoint MakeJoint(const JointSpec& spec, btRigidBody* body_1, btRigidBody* body_2,
                      double gain_per_s);

/// The joint's constraint; null for a joint inside one body.
btTypedConstraint* ConstraintOf(const EngineJoint& joint);

/// Lets the servo ask its motor for a velocity in the coming step of `dt_s`, with `effort` as the
/// most it may exert (N m or N).
void DriveMotor(EngineJoint* joint, double effort, double dt_s);

/// Measures the joint after a step. One inside one body keeps reading 0.
void Measure(EngineJoint* joint);

/// Puts the motor's side of a joint with play there, before the first step (rad or m).
void PlaceMotor(EngineJoint* joint, double position);

}  // namespace morphbus::sim
