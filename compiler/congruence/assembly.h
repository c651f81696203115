#pragma once
// A robot as congruence sees it: bodies with a reference point, joints with a screw axis. All in
// the robot frame at the start values, so that a body's own frame is parallel to it.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/loop_constraints.h"
#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

struct AssemblyBody {
  std::vector<model::LinkRef> links;
  Eigen::Vector3d p_RoTo;   ///< The reference point: mean of the links' origins (m).
  std::vector<int> joints;  ///< That touch the body; one with both ends here stands once.
};

/// Any joint but a fixed one (fixed ones are inside bodies).
struct AssemblyJoint {
  int module = 0;
  int joint = 0;
  bool slide = false;  ///< Prismatic; else it turns.
  double lower = 0.0;  ///< rad or m; infinite for continuous joints.
  double upper = 0.0;
  double start = 0.0;
  bool locked = false;  ///< Cannot move, by the loops at the start values.
  int body_a = 0;
  int body_b = 0;
  Eigen::Vector3d p_RoJo;  ///< A point on the axis (m).
  Eigen::Vector3d axis;    ///< Unit; +q turns (slides) A relative to B about (along) it.

  [[nodiscard]] bool bounded() const;
  [[nodiscard]] int Other(int body) const { return body == body_a ? body_b : body_a; }
  /// The axis about which +q moves the other body relative to `body`.
  [[nodiscard]] Eigen::Vector3d AxisFrom(int body) const {
    return body == body_b ? axis : Eigen::Vector3d(-axis);
  }
};

struct Assembly {
  const model::Model* model = nullptr;
  const model::Robot* robot = nullptr;
  std::vector<AssemblyBody> bodies;
  std::vector<AssemblyJoint> joints;           ///< Module then joint order.
  std::vector<std::vector<int>> body_of;       ///< [module][link].
  std::vector<std::vector<model::Pose>> X_RL;  ///< [module][link], start values.
  bool locked_computed = true;                 ///< False: which joints are locked is not known.
  double extent_m = 0.0;                       ///< Size of the largest module in use; never 0.

  /// From `body`'s reference point square to the axis of `joint` (m), for one that turns.
  [[nodiscard]] Eigen::Vector3d FootFrom(int body, int joint) const;
  /// "m1.joint_1"
  [[nodiscard]] std::string JointName(int joint) const;
  /// "m3.active_block + m4.passive_block"; shortened if there are many.
  [[nodiscard]] std::string BodyName(int body) const;
};

/// All joints, as the analysis of loops takes them.
std::vector<model::ScrewJoint> ScrewJointsOf(const Assembly& assembly);

/// `model` and `robot` must outlive what comes back.
Assembly Flatten(const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::congruence
