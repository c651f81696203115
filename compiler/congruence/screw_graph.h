#pragma once
// A robot as congruence sees it: a graph of bodies with a reference point and joints with a screw
// axis. All coordinates are in the robot frame R at the start values, so that a body's own frame,
// which is parallel to R then, needs no rotation.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

/// A largest set of links that connections and fixed joints hold together. T is its frame.
struct ScrewBody {
  std::vector<model::LinkRef> links;
  /// The reference point: mean of the links' origins (m).
  Eigen::Vector3d p_RoTo;
  /// Joints that touch it; one with both ends here stands once.
  std::vector<int> joints;
};

/// Any joint but a fixed one (fixed ones are inside bodies).
struct ScrewJoint {
  int module = 0;      ///< Index into Robot::modules.
  int joint = 0;       ///< Index into ModuleType::joints.
  bool slide = false;  ///< Is it prismatic? Else it turns.
  /// Limits (rad or m); infinite for continuous joints.
  double lower = 0.0;
  double upper = 0.0;
  double start = 0.0;   ///< Its value at the start (rad or m).
  bool locked = false;  ///< Do the loops at the start values keep it from moving?
  /// The bodies at its ends, which may be one.
  int body_a = 0;
  int body_b = 0;
  /// Its axis: a point on it (m) and a unit vector along it. +q turns (slides) A relative to B
  /// about (along) the axis, right-handed.
  Eigen::Vector3d p_RoJo;
  Eigen::Vector3d axis;

  /// Has it limits?
  [[nodiscard]] bool bounded() const;
  /// Is `body` at one of its ends?
  [[nodiscard]] bool Touches(int body) const { return body == body_a || body == body_b; }
  /// The body at the end that `body` is not at; `body` itself if it is at both.
  [[nodiscard]] int Other(int body) const { return body == body_a ? body_b : body_a; }
  /// The axis about which +q moves the other body relative to `body`.
  [[nodiscard]] Eigen::Vector3d AxisFrom(int body) const {
    return body == body_b ? axis : Eigen::Vector3d(-axis);
  }
};

/// The bodies and joints of one robot. Its vectors are in R at the start values; as congruence asks
/// for what holds at all joint values, only what is fixed in each body is ever compared.
struct ScrewGraph {
  const model::Model* model = nullptr;
  const model::Robot* robot = nullptr;
  /// Numbered as by model::BodiesOf.
  std::vector<ScrewBody> bodies;
  /// In order of module, then joint.
  std::vector<ScrewJoint> joints;
  /// [module][link].
  std::vector<std::vector<int>> body_of;
  /// [module][link], at the start values.
  std::vector<std::vector<model::Pose>> X_RL;
  /// False: which joints are locked is not known.
  bool locked_computed = true;
  /// Size of the largest module in use; never 0.
  double extent_m = 0.0;

  /// The body of the link that carries the robot frame.
  [[nodiscard]] int RootBody() const { return body_of[robot->root_module][robot->root_link]; }
  /// The vector from `body`'s reference point to the nearest point of the axis of `joint` (m), for
  /// a joint that turns.
  [[nodiscard]] Eigen::Vector3d FootFrom(int body, int joint) const;
  /// "m1.joint_1"
  [[nodiscard]] std::string JointName(int joint) const;
  /// "m3.active_block"
  [[nodiscard]] std::string LinkName(const model::LinkRef& link) const;
  /// "m3.active_block + m4.passive_block"; shortened if there are many.
  [[nodiscard]] std::string BodyName(int body) const;
};

/// The graph of `robot`. It keeps pointers: `model` and `robot` must outlive it.
ScrewGraph BuildScrewGraph(const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::congruence
