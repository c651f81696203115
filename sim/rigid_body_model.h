#pragma once
// Model to rigid bodies: the canonical description of a robot that the physics engine is fed from.
//
// Frames: W world (NUE, ground at y = 0), R robot frame, L link, B body. A body is a largest set of
// links held together by connections and fixed joints; its frame B has its origin in the centre of
// mass and is, at the start, parallel to W (and W to R), unless the body's inertia is not diagonal
// there: then B is the principal frame nearest to that.
//
// Congruent robots give the same numbers here, bit for bit, unless their links weigh more or less
// by chance: everything that depends on how modules are numbered or mounted is first taken to W,
// rounded (1 nm; inertia 1e-13 kg m^2) and sorted by place; only then is anything computed from it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/mass_spread.h"
#include "compiler/model/robot_model.h"
#include "sim/link_physics.h"

namespace morphbus::sim {

using model::LinkRef;
using model::Pose;

/// Poses of all links, X_WL[module][link].
using LinkPoseTable = std::vector<std::vector<Pose>>;

/// One link of a body.
struct LinkSpec {
  /// Which link of the robot it is. Numbers of modules differ between congruent robots, so this
  /// never enters the engine.
  LinkRef ref;
  /// Canonical number of its module; links of one group never collide with each other.
  int group = 0;
  double mass_kg = 0.0;
  /// Corners of its convex parts for the engine (m), sorted as parts are; none without a hull.
  std::vector<std::vector<Eigen::Vector3d>> parts_B;
  /// Its own Coulomb coefficient; absent: that of the world.
  std::optional<double> friction = {};
  // For reading poses out; these never enter the engine.
  Pose X_BL = Pose::Identity();
  Eigen::Vector3d p_BoLcm_B = Eigen::Vector3d::Zero();  ///< The link's own centre of mass (m).
};

/// One rigid body, as the engine gets it.
struct BodySpec {
  std::vector<LinkSpec> links;  ///< Sorted by place.
  double mass_kg = 0.0;
  Eigen::Vector3d inertia_B;     ///< Principal moments about Bo (kg m^2).
  Pose X_WB = Pose::Identity();  ///< At the start.
  int first_link = 0;            ///< Index in `links` of the first in (module, link) order.
};

/// A joint between two different bodies, or (body_1 == body_2) inside one, where it cannot move.
/// The canonical angle theta is that of body_2 relative to body_1 about `axis`, 0 at the start; the
/// module's own value is q = start + sign * theta.
struct JointSpec {
  int module = 0;
  /// Which joint of the robot it is, with `module`; neither enters the engine.
  int joint = 0;
  model::JointType type = model::JointType::kRevolute;
  int body_1 = 0;  ///< The lower index.
  int body_2 = 0;
  Eigen::Vector3d p_WJ;    ///< A point on the axis, W, at the start (m).
  Eigen::Vector3d axis_W;  ///< Unit; first component that is not zero is positive.
  double start = 0.0;      ///< rad or m.
  double sign = 1.0;       ///< +1 or -1.
  double lower = 0.0;      ///< Limits of theta (rad or m), infinite if there are none.
  double upper = 0.0;
  /// The greatest speed and effort that the joint's motor has.
  double speed = 0.0;   ///< rad/s or m/s.
  double effort = 0.0;  ///< N m or N.
  /// The play between motor and link, rad or m; and by how much later than it is told the motor
  /// acts (s), which whoever drives the joint sees to.
  double backlash = 0.0;
  double delay_s = 0.0;
};

/// A robot as rigid bodies and joints, in canonical order.
struct RigidBodyModel {
  std::vector<BodySpec> bodies;
  std::vector<JointSpec> joints;
  std::vector<std::vector<int>> body_of;       ///< body_of[module][link].
  std::vector<std::vector<int>> joint_of;      ///< joint_of[module][joint]; -1 for fixed joints.
  std::vector<std::vector<bool>> may_collide;  ///< May bodies i and j touch? Symmetric.
};

/// Start poses in the world: robot frame parallel to W with its origin above x = z = 0, the lowest
/// hull corner 0.5 mm above y = 0.
LinkPoseTable PlaceOnGround(const model::Model& model, const model::Robot& robot);

/// Bodies and joints of `robot` with its links at `X_WL`, whose joint values are
/// `q[module][joint]`; `physics` has mass, inertia and collision shape of its links. Bodies that
/// two joints with different axes hold against each other cannot move, and are one here too. Links
/// weigh `factors` times what `physics` says.
RigidBodyModel BuildRigidBodyModel(const model::Model& model, const model::Robot& robot,
                                   const LinkPhysicsTable& physics, const LinkPoseTable& X_WL,
                                   const model::JointValues& q,
                                   const model::MassFactors& factors = {});

/// Feeds all that the engine gets to know of `rigid_bodies` into a 64-bit hash (XXH64), with
/// `seed`.
uint64_t HashRigidBodyModel(const RigidBodyModel& rigid_bodies, uint64_t seed);

/// `x` on the 1 nm grid, never -0.
double RoundToNanometre(double x);

}  // namespace morphbus::sim
