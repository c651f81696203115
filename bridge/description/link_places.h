#pragma once
// Where the links of a robot are in the bodies that WORLD tells of: which links are rigid with each
// other, by fixed joints and by what connectors sense.

#include <Eigen/Geometry>
#include <morphbus/docked_connector_t.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::bridge {

/// A rigid pose with its rotation as the wire has it, so that what needs no computation keeps every
/// bit.
struct LinkPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

/// The pose of C in A, of those of B in A and of C in B.
LinkPose operator*(const LinkPose& X_AB, const LinkPose& X_BC);
/// The pose of A in B, of that of B in A.
LinkPose Inverse(const LinkPose& X_AB);
/// The same pose, its rotation normalized.
LinkPose ToLinkPose(const model::Pose& X);
/// The pose that a message holds, to the bit; its rotation may be off length 1 by rounding.
template <class PoseMessage>
LinkPose LinkPoseIn(const PoseMessage& message) {
  const auto* p = message.position_m;
  const auto* q = message.orientation_wxyz;
  return {{p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}};
}

/// Whether a number, of a message perhaps, is one of a list of so many.
inline bool IsIndex(int i, size_t size) { return i >= 0 && static_cast<size_t>(i) < size; }

/// The same pose, as one of the two types.
template <class Pose>
Pose PoseAs(const model::Pose& X);
template <>
inline LinkPose PoseAs(const model::Pose& X) {
  return ToLinkPose(X);
}
template <>
inline model::Pose PoseAs(const model::Pose& X) {
  return X;
}

/// Where a link is: in which body, and where in that body's frame B, which is the frame of the link
/// that stands for the body.
template <class Pose>
struct PlacedLink {
  int body = -1;  ///< Index into the list of bodies; -1 if none of them carries the link.
  Pose X_BL = PoseAs<Pose>(model::Pose::Identity());
};
using LinkPlace = PlacedLink<LinkPose>;

/// What the connectors of each module sense, by module.
using Dockings = std::vector<std::vector<morphbus::docked_connector_t>>;

/// The dockings that a robot declares, as both sides sense them.
Dockings DeclaredDockings(const model::Model& model, const model::Robot& robot);

/// Whether a module senses the same at its connectors.
bool SameDocked(const std::vector<morphbus::docked_connector_t>& a,
                const std::vector<morphbus::docked_connector_t>& b);

/// The pose of a mate's frame in that of `module`, both at joint values 0, by the connection that
/// the entry names; none if the robot has no such mate or connection, as in a damaged message.
std::optional<model::Pose> DockedPose(const model::Model& model, const model::Robot& robot,
                                      int module, const morphbus::docked_connector_t& docked);

/// The place of every link, by module and link. `bodies` are modules and links that stand for
/// bodies, as in WORLD; those that the robot does not have are passed over, as are dockings of
/// unknown modules, connectors or connections: both may come from a damaged message. Of two bodies
/// that would carry a link the first one does. `Pose` is LinkPose or model::Pose.
template <class Pose>
std::vector<std::vector<PlacedLink<Pose>>> PlacesInBodies(
    const model::Model& model, const model::Robot& robot, const Dockings& dockings,
    const std::vector<std::pair<int, int>>& bodies);

}  // namespace morphbus::bridge
