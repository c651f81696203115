#include "compiler/congruence/places.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// What of a joint is fixed in one of its bodies, whatever the joint's value.
struct FixedInBody {
  Vector3d axis;
  /// Square to the axis: from the body's reference point to the axis or, for a slide, which has no
  /// place, to the other body's reference point (m).
  Vector3d out;
};

FixedInBody FixedPart(const ScrewGraph& graph, int body, int joint) {
  const ScrewJoint& j = graph.joints[joint];
  return {j.AxisFrom(body),
          j.slide ? OffsetAcrossSlide(graph, body, joint) : graph.FootFrom(body, joint)};
}

/// Adds a place that is not known yet.
void Add(std::vector<Place>& places, const Place& place) {
  constexpr double kSame = 10.0 * kGeometryTolerance;
  const bool known = std::any_of(places.begin(), places.end(),
                                 [&](const Place& p) { return SamePlace(p, place, kSame); });
  if (!known) places.push_back(place);
}

/// Adds the places that take `axis` to `axis_to` and the axis of joint `second` to that of any
/// joint it may correspond to, where the two lie to each other as there.
void AddByTwoAxes(const Correspondence& matched, int body, int image, const Vector3d& axis,
                  const Vector3d& axis_to, int second, std::vector<Place>& places) {
  // Both ways round, as far as the angle between the two axes allows it.
  const Vector3d axis_2 = matched.a().joints[second].AxisFrom(body);
  for (const int to_2 : matched.b().bodies[image].joints) {
    if (!matched.MayCorrespond(second, to_2)) continue;
    for (const double sign : {1.0, -1.0}) {
      const Vector3d axis_2_to = sign * matched.b().joints[to_2].AxisFrom(image);
      if (std::abs(axis.dot(axis_2) - axis_to.dot(axis_2_to)) > kGeometryTolerance) continue;
      Add(places, {image, RotationFrom(axis, axis_2, axis_to, axis_2_to)});
    }
  }
}

}  // namespace

bool SamePlace(const Place& x, const Place& y, double tolerance) {
  if (x.image != y.image) return false;
  return x.free_axis.isZero() ? (x.R - y.R).norm() <= tolerance
                              : (x.free_axis - y.free_axis).norm() <= tolerance;
}

int SeedBody(const Classes& classes, const Decomposition& a) {
  // How many bodies each class has in a and in b.
  std::map<uint64_t, std::pair<int, int>> members;
  for (const uint64_t c : classes.bodies[0]) ++members[c].first;
  for (const uint64_t c : classes.bodies[1]) ++members[c].second;

  // The first body of the least score; one that is coaxial scores higher than any that is not.
  int best = -1;
  std::pair<bool, int> least;
  for (size_t b = 0; b < classes.bodies[0].size(); ++b) {
    const auto& [in_a, in_b] = members[classes.bodies[0][b]];
    const std::pair<bool, int> score(a.coaxial[b], std::max(in_a, in_b));
    if (in_b == 0 || (best >= 0 && score >= least)) continue;
    best = static_cast<int>(b);
    least = score;
  }
  return best;
}

std::vector<Place> PlacesOn(const Correspondence& matched, const Decomposition& pieces, int body,
                            int image) {
  const ScrewGraph& a = matched.a();
  const ScrewGraph& b = matched.b();
  const double tolerance = matched.length_tolerance();
  const std::vector<int>& joints = a.bodies[body].joints;
  // A body alone looks alike however it is turned.
  if (joints.empty()) return {{image, Matrix3d::Identity()}};

  // One joint that reaches out from the reference point determines the rotation; else two axes do.
  const auto reaches_out = [&](int joint) {
    return FixedPart(a, body, joint).out.norm() > tolerance;
  };
  auto first = std::find_if(joints.begin(), joints.end(), reaches_out);
  const bool one_determines = first != joints.end();
  if (!one_determines) first = joints.begin();
  const FixedInBody fixed = FixedPart(a, body, *first);
  const auto second = std::find_if(joints.begin(), joints.end(), [&](int joint) {
    return a.joints[joint].axis.cross(fixed.axis).norm() > kGeometryTolerance;
  });

  // That joint may go to each one of the image that lies as far out, either way round.
  std::vector<Place> places;
  for (const int to : b.bodies[image].joints) {
    if (!matched.MayCorrespond(*first, to)) continue;
    const FixedInBody fixed_to = FixedPart(b, image, to);
    if (std::abs(fixed.out.norm() - fixed_to.out.norm()) > tolerance) continue;
    for (const double sign : {1.0, -1.0}) {
      const Vector3d axis_to = sign * fixed_to.axis;
      if (one_determines) {
        Add(places, {image, RotationFrom(fixed.axis, fixed.out, axis_to, fixed_to.out)});
      } else if (pieces.coaxial[body]) {
        const auto R = Eigen::Quaterniond::FromTwoVectors(fixed.axis, axis_to).toRotationMatrix();
        Add(places, {image, R, axis_to});
      } else {
        AddByTwoAxes(matched, body, image, fixed.axis, axis_to, *second, places);
      }
    }
  }
  return places;
}

std::vector<Place> PlacesOf(const Correspondence& matched, const Decomposition& a, int body) {
  // Bodies of another class cannot be images.
  std::vector<Place> places;
  const Classes& classes = matched.classes();
  for (size_t image = 0; image < classes.bodies[1].size(); ++image) {
    if (classes.bodies[1][image] != classes.bodies[0][body]) continue;
    for (Place& place : PlacesOn(matched, a, body, static_cast<int>(image))) {
      places.push_back(std::move(place));
    }
  }
  return places;
}

Place HomeOf(const Correspondence& matched, const Decomposition& a, int body) {
  Place home{body, Matrix3d::Identity()};
  const std::vector<int>& joints = matched.a().bodies[body].joints;
  if (a.coaxial[body] && !joints.empty()) {
    home.free_axis = matched.a().joints[joints[0]].AxisFrom(body);
  }
  return home;
}

}  // namespace morphbus::congruence
