#pragma once
// M-TRAN, the two quadrupeds of the paper's Figs. 8 and 9, and their gait without a program:
// targets of the joints over time, by what the joints are for.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::sim::test {

/// models/mtran.m3l, compiled once: the module type MTRAN, its connection and the robots
/// "quadruped" and "equivalent_quadruped". Unit 0.0325 m, links 0.18, 0.18, 0.06 kg, 1.9 N m, pi
/// rad/s.
std::shared_ptr<const model::Model> MtranModel();

/// The legs' parts by what they are for; names of modules and indices of joints of one robot.
enum Leg { kFrontLeft, kFrontRight, kBackLeft, kBackRight, kNumLegs };
enum Part { kUpperJoint, kHip, kKnee, kAnkle, kNumParts };

struct FunctionalJoint {
  int module = 0;
  int joint = 0;
  double sign = 1.0;  ///< Raw value = sign * value under the paper's conventions (setJointAxis).
};
using Quadruped = std::array<std::array<FunctionalJoint, kNumParts>, kNumLegs>;

/// Who plays what in the robot: known answers of the paper's roles; signs from where each labelled
/// link (bar; foot for the ankle) and its axis really are in the robot frame.
Quadruped AssignParts(const model::Model& model, const model::Robot& robot);

/// Values of all functional joints (rad, paper's conventions), [leg][part].
using Posture = std::array<std::array<double, kNumParts>, kNumLegs>;

/// Targets at time t (s): flat until 0.5, standing until 2.5, then the gait of Fig. 10 over and
/// over (kGaitCycle each, the first starting at kGaitStart).
Posture GaitTargets(double t);
inline constexpr double kGaitStart = 2.5;
inline constexpr double kGaitCycle = 7.0;

}  // namespace morphbus::sim::test
