#include "compiler/congruence/placements.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compiler/congruence/classes.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/partial_rotations.h"
#include "compiler/model/kinematic_graph.h"

namespace morphbus::congruence {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Bounds for types with many free turns and connectors.
constexpr size_t kMaxPlacements = 512;
constexpr size_t kMaxAngles = 64;

/// The angles (rad) by which the bodies of one free group can turn such that a connector comes to
/// lie where one of the image body lies; 0 among them.
std::vector<double> AnglesOf(const model::ModuleType& type, const std::vector<int>& body_of,
                             const Mapping& mapping, int group) {
  const double tolerance = kGeometryTolerance * model::ExtentOf(type);
  std::vector<double> angles = {0.0};
  for (const model::Connector& from : type.connectors) {
    const int body = body_of[from.link];
    if (mapping.free_group[body] != group) continue;
    // A turn about the axis takes one point to another if both lie as far along it and from it.
    const Vector3d& axis = mapping.free_axis[body];
    const Vector3d p = mapping.R[body] * from.p_MoCo_M;
    const Vector3d out = p - p.dot(axis) * axis;
    for (const model::Connector& to : type.connectors) {
      if (body_of[to.link] != mapping.body_to[body]) continue;
      const Vector3d& p_to = to.p_MoCo_M;
      const Vector3d out_to = p_to - p_to.dot(axis) * axis;
      if (std::abs((p - p_to).dot(axis)) > tolerance || out.norm() <= tolerance) continue;
      if (std::abs(out.norm() - out_to.norm()) > tolerance) continue;
      // The angle from `out` to `out_to` about the axis: both are square to it and of one length.
      const double angle = std::atan2(out.cross(out_to).dot(axis), out.dot(out_to));
      const bool known = std::any_of(angles.begin(), angles.end(), [&](double other) {
        return std::abs(std::remainder(angle - other, 2.0 * std::numbers::pi)) <= 1e-6;
      });
      if (!known && angles.size() < kMaxAngles) angles.push_back(angle);
    }
  }
  return angles;
}

/// The placement that a congruence of the module type with itself is, with free turns as it has
/// them.
Placement PlacementOf(const model::ModuleType& type, const std::vector<int>& body_of,
                      const Congruence& self, const Mapping& mapping) {
  Placement placement;
  placement.body_of = body_of;
  placement.body_to = mapping.body_to;
  placement.C = mapping.R;
  for (size_t j = 0; j < type.joints.size(); ++j) {
    // Joints that the comparison does not know, such as fixed ones, stay what they are.
    placement.joints.push_back({static_cast<int>(j), 1.0, 0.0});
  }
  for (size_t j = 0; j < self.joints_a.size(); ++j) {
    const JointImage& image = mapping.joints[j];
    placement.joints[self.joints_a[j].joint] = {self.joints_b[image.to].joint, image.sign,
                                                image.offset};
  }
  return placement;
}

/// Sets the offsets of joints without limits to what they are after bodies were turned; those of
/// the others stay.
void UpdateOffsets(const model::ModuleType& type, Placement& placement) {
  for (size_t j = 0; j < type.joints.size(); ++j) {
    const model::Joint& joint = type.joints[j];
    if (joint.type != model::JointType::kContinuous) continue;
    JointImage& image = placement.joints[j];
    const model::Joint& to = type.joints[image.to];
    const int body_a = placement.body_of[joint.link_a];
    const int body_b = placement.body_of[joint.link_b];
    // The joint's image may join the bodies the other way round, and then turns about the opposite
    // axis.
    const bool straight = placement.body_to[body_b] == placement.body_of[to.link_b];
    const Vector3d axis = straight ? to.axis : Vector3d(-to.axis);
    const double offset = AngleAbout(placement.C[body_b] * placement.C[body_a].transpose(), axis);
    image.offset = std::abs(offset) < 1e-9 ? 0.0 : offset;
  }
}

/// Entries that rounding left beside 0 or 1 become that, so that placed robots have exact poses.
void RemoveRounding(Placement& placement) {
  for (Matrix3d& C : placement.C) {
    C = C.unaryExpr(
        [](double v) { return std::abs(v - std::round(v)) < 1e-12 ? std::round(v) : v; });
  }
}

/// Wheels exchanged, or turned about their own axes, make no other connections: of placements that
/// differ only in bodies without connectors the first.
std::vector<Placement> DockingUnlike(const model::ModuleType& type,
                                     std::vector<Placement> placements) {
  std::vector<Placement> different;
  for (Placement& x : placements) {
    const bool known = std::any_of(different.begin(), different.end(), [&](const Placement& y) {
      return std::all_of(type.connectors.begin(), type.connectors.end(), [&](const auto& at) {
        const int body = x.body_of[at.link];
        return x.body_to[body] == y.body_to[body] && (x.C[body] - y.C[body]).norm() <= 1e-6;
      });
    });
    if (!known) different.push_back(std::move(x));
  }
  return different;
}

}  // namespace

std::vector<Placement> PlacementsOf(const model::Model& model, int type_index) {
  // A robot of one module, compared with itself.
  const model::ModuleType& type = model.module_types[type_index];
  model::Robot alone;
  alone.name = type.name;
  alone.modules.push_back({"m", type_index, std::vector<double>(type.joints.size(), 0.0)});
  const std::vector<int> body_of = model::BodiesOf(model, alone)[0];
  const Congruence self = Compare(model, alone, model, alone);

  std::vector<Placement> placements;
  for (const Mapping& mapping : self.mappings) {
    std::vector<Placement> turned = {PlacementOf(type, body_of, self, mapping)};
    // For each group of bodies that may turn freely, each of its angles with all that came before.
    std::vector<int> groups = mapping.free_group;
    std::sort(groups.begin(), groups.end());
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    for (const int group : groups) {
      if (group < 0) continue;
      std::vector<Placement> more;
      for (const double angle : AnglesOf(type, body_of, mapping, group)) {
        for (Placement placement : turned) {
          for (size_t b = 0; b < placement.C.size(); ++b) {
            if (mapping.free_group[b] != group) continue;
            placement.C[b] = Turn(mapping.free_axis[b], angle) * placement.C[b];
          }
          if (more.size() < kMaxPlacements) more.push_back(std::move(placement));
        }
      }
      turned = std::move(more);
    }
    // What the turns changed follows.
    for (Placement& placement : turned) {
      if (placements.size() == kMaxPlacements) break;
      UpdateOffsets(type, placement);
      RemoveRounding(placement);
      placements.push_back(std::move(placement));
    }
  }
  // The least changed first, as where a turn is free it is best left alone; the first mapping is
  // that which changes nothing.
  const auto changed = [](const Placement& placement) {
    return std::count_if(placement.joints.begin(), placement.joints.end(),
                         [](const auto& image) { return image.offset != 0.0; });
  };
  std::stable_sort(placements.begin(), placements.end(),
                   [&](const Placement& x, const Placement& y) { return changed(x) < changed(y); });
  return DockingUnlike(type, std::move(placements));
}

}  // namespace morphbus::congruence
