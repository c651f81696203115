#include "sim/engine_joint.h"

#include <cmath>
#include <numbers>

#include "sim/bullet_math.h"

namespace morphbus::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The mechanical stops lie this much beyond the limits that the servo keeps (rad and m).
constexpr double kStopSlack = 0.035;
constexpr double kStopSlackLinear = 1e-3;

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

// A hinge with its mechanical stops a little beyond the joint's limits.
std::unique_ptr<btHingeConstraint> MakeHinge(const JointSpec& spec, const EngineJoint& joint) {
  std::unique_ptr<btHingeConstraint> hinge;
  if (joint.motor.has_play()) {
    hinge = std::make_unique<OneWayHinge>(*joint.body_2, *joint.body_1, joint.X_B2J, joint.X_B1J,
                                          false);
  } else {
    hinge = std::make_unique<btHingeConstraint>(*joint.body_2, *joint.body_1, joint.X_B2J,
                                                joint.X_B1J, false);
  }
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
  std::unique_ptr<btSliderConstraint> slider;
  if (joint.motor.has_play()) {
    slider = std::make_unique<OneWaySlider>(*joint.body_1, *joint.body_2, joint.X_B1J, joint.X_B2J,
                                            true);
  } else {
    slider = std::make_unique<btSliderConstraint>(*joint.body_1, *joint.body_2, joint.X_B1J,
                                                  joint.X_B2J, true);
  }
  slider->setLowerAngLimit(0.0);
  slider->setUpperAngLimit(0.0);
  const bool has_stop = std::isfinite(spec.lower) && std::isfinite(spec.upper);
  slider->setLowerLinLimit(has_stop ? spec.lower - kStopSlackLinear : 1.0);
  slider->setUpperLinLimit(has_stop ? spec.upper + kStopSlackLinear : -1.0);
  return slider;
}

// Tells a motor with play which way it pushes in the coming step.
void SetPush(EngineJoint* joint, double sign) {
  if (joint->hinge) static_cast<OneWayHinge&>(*joint->hinge).set_push(sign);
  if (joint->slider) static_cast<OneWaySlider&>(*joint->slider).set_push(sign);
}

}  // namespace

EngineJoint MakeJoint(const JointSpec& spec, btRigidBody* body_1, btRigidBody* body_2,
                      double gain_per_s) {
  EngineJoint joint;
  joint.servo = Servo({spec.lower, spec.upper, spec.speed}, gain_per_s);
  // A joint inside one body has nothing to play with.
  joint.motor = MotorSide(body_1 == nullptr ? 0.0 : spec.backlash, spec.speed);
  if (body_1 == nullptr) return joint;
  joint.body_1 = body_1;
  joint.body_2 = body_2;
  // The joint's frame J is fixed in both bodies where they are now, at theta = 0.
  Pose X_WJ = Pose::Identity();
  X_WJ.linear() = FrameAround(spec.axis_W, Slides(spec));
  X_WJ.translation() = spec.p_WJ;
  joint.X_B1J = body_1->getWorldTransform().inverse() * ToBullet(X_WJ);
  joint.X_B2J = body_2->getWorldTransform().inverse() * ToBullet(X_WJ);
  if (Slides(spec)) {
    joint.slider = MakeSlider(spec, joint);
  } else {
    joint.hinge = MakeHinge(spec, joint);
  }
  // The engine fills it in at every step, and only if it was asked to.
  joint.feedback = std::make_unique<btJointFeedback>();
  ConstraintOf(joint)->setJointFeedback(joint.feedback.get());
  return joint;
}

btTypedConstraint* ConstraintOf(const EngineJoint& joint) {
  if (joint.slider) return joint.slider.get();
  return joint.hinge.get();
}

void DriveMotor(EngineJoint* joint, double effort, double dt_s) {
  if (joint->servo.limp()) effort = 0.0;
  JointState& state = joint->state;
  joint->step_s = dt_s;
  joint->asked = joint->servo.Step(state.motor, state.motor_rate, dt_s);
  double velocity = joint->asked;
  if (joint->motor.has_play()) {
    const MotorSide::Push push = joint->motor.PushOf(state.theta, state.rate, velocity, dt_s);
    velocity = push.velocity;
    SetPush(joint, push.sign);
  }
  if (joint->feedback) NoteMotorLine(joint);
  // A hinge's motor is limited by impulse, a slider's by force.
  if (joint->hinge) joint->hinge->enableAngularMotor(true, velocity, effort * dt_s);
  if (joint->slider) {
    joint->slider->setPoweredLinMotor(true);
    joint->slider->setTargetLinMotorVelocity(velocity);
    joint->slider->setMaxLinMotorForce(effort);
  }
}

void Measure(EngineJoint* joint) {
  if (joint->hinge) MeasureHinge(joint);
  if (joint->slider) MeasureSlider(joint);
  JointState& state = joint->state;
  if (joint->motor.has_play()) {
    joint->motor.Follow(state.theta, joint->asked, joint->step_s);
    state.motor = joint->motor.position();
    state.motor_rate = joint->motor.rate();
  } else {
    state.motor = state.theta;
    state.motor_rate = state.rate;
  }
  if (joint->feedback) joint->state.motor_effort = MotorEffort(*joint);
}

void PlaceMotor(EngineJoint* joint, double position) {
  if (!joint->motor.has_play()) return;
  joint->motor.set_position(position);
  joint->state.motor = position;
}

}  // namespace morphbus::sim
