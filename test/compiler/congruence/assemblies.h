#pragma once
// Assemblies to compare, and an independent check of a congruence by forward kinematics.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/congruence/congruence.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/robot_model.h"

namespace morphbus::test {

/// models/mtran.m3l.
const model::Model& MtranFile();

/// The same assembly: modules in another order and renamed, connections in another order and some
/// written from the other side, the frame on another link, turned and moved.
model::Robot Relabelled(const model::Model& model, const model::Robot& robot, uint64_t seed);

/// A random tree of `modules` modules of type 0, each connection a random option.
model::Robot RandomTree(const model::Model& model, int modules, uint64_t seed);

/// A joint that turns and a link that hangs on it.
struct Hung {
  int on = 0;               ///< Link 0, or that of an earlier joint (from 1 on).
  Eigen::Vector3d through;  ///< A point on the axis (m).
  Eigen::Vector3d axis;
  double upper = 1.0;  ///< Limits (rad).
  double lower = -1.0;
};

/// One module type of a link l0 and a link for each joint j1, j2, ...; all links have their origins
/// at the module's.
model::Model HungModel(const std::vector<Hung>& joints);

/// A robot of one module `m` of type 0, at 0.
model::Robot Alone(const model::Model& model, const std::string& name);

/// Pose in R of each body's frame at joint values q: carried by its first link, at the start values
/// parallel to R with its origin in the reference point.
std::vector<model::Pose> BodyPoses(const model::Model& model, const model::Robot& robot,
                                   const model::JointValues& q);

/// Puts random values on the joints of `a` (within limits; those of `still` stay at their start)
/// and the mapped ones on `b`, and expects each body's reference point and rotation, seen from body
/// 0, where the mapping says. Uses forward kinematics and the definition alone.
void ExpectSameMotion(const model::Model& model_a, const model::Robot& a,
                      const model::Model& model_b, const model::Robot& b,
                      const congruence::Congruence& congruence, const congruence::Mapping& mapping,
                      uint64_t seed, const std::vector<congruence::JointRef>& still = {});

}  // namespace morphbus::test
