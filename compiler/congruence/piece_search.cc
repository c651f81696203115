#include "compiler/congruence/piece_search.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace morphbus::congruence {

using Eigen::Matrix3d;
using Eigen::Vector3d;

PieceSearch::PieceSearch(Correspondence& matched, const Cut& cut, Steps& steps, const Entry& entry)
    : matched_(matched),
      cut_(cut),
      steps_(steps),
      entry_(entry),
      start_(matched.mark()),
      first_(matched.order().size()) {}

int PieceSearch::BodyAt(size_t index) const {
  return index == 0 ? entry_.body : matched_.order()[first_ + index - 1];
}

std::vector<int> PieceSearch::NewBodies() const {
  return {matched_.order().begin() + static_cast<std::ptrdiff_t>(first_), matched_.order().end()};
}

void PieceSearch::Undo(const Mark& mark) {
  matched_.Undo(mark.matched);
  head_ = mark.head;
}

bool PieceSearch::Next() {
  bool going = !begun_ || TakeNext();
  begun_ = true;
  while (going) {
    Choice choice;
    choice.joint = NextJoint(&choice.body);
    choice.mark = {matched_.mark(), head_};
    if (choice.joint >= 0) {
      choice.options = OptionsFor(choice.body, choice.joint);
    } else {
      choice.body = NextOpenBody();
      if (choice.body < 0) return true;
      const int image = matched_.ImageOf(choice.body);
      for (const Place& place : PlacesOn(matched_, cut_.a, choice.body, image)) {
        choice.rotations.push_back(place.R);
      }
    }
    if (!choice.empty()) choices_.push_back(std::move(choice));
    going = TakeNext();
  }
  matched_.Undo(start_);
  return false;
}

/// Takes the next untried option of the latest choice; false if there is none any more.
bool PieceSearch::TakeNext() {
  while (!choices_.empty() && --steps_.left > 0) {
    Choice& choice = choices_.back();
    const Mark before = choice.mark;
    const int body = choice.body;
    const int joint = choice.joint;
    const size_t at = choice.next++;
    const Option option = joint >= 0 ? choice.options[at] : Option{-1, 1.0};
    const Matrix3d R = joint >= 0 ? Matrix3d::Identity() : choice.rotations[at];
    if (choice.empty()) choices_.pop_back();
    Undo(before);
    if (joint >= 0 ? matched_.Commit(body, joint, option) : matched_.R().AlignWhole(body, R)) {
      return true;
    }
    Undo(before);
  }
  choices_.clear();
  return false;
}

/// A joint of the piece that touches a matched body and is not matched; -1 if there is none.
int PieceSearch::NextJoint(int* body) {
  const std::vector<int>& own = cut_.a.joints[entry_.piece];
  for (; head_ < num_bodies(); ++head_) {
    *body = BodyAt(head_);
    const std::vector<int>& there = matched_.a().bodies[*body].joints;
    // The shorter list: a hub has many joints, most pieces few.
    for (const int joint : own.size() < there.size() ? own : there) {
      if (cut_.a.of_joint[joint] != entry_.piece || matched_.JointImageOf(joint) >= 0) continue;
      const AssemblyJoint& j = matched_.a().joints[joint];
      if (j.body_a == *body || j.body_b == *body) return joint;
    }
  }
  return -1;
}

std::vector<Option> PieceSearch::OptionsFor(int body, int joint) const {
  std::vector<Option> options;
  const int image = matched_.ImageOf(body);
  const std::vector<int>& own = cut_.b.joints[entry_.image];
  const std::vector<int>& there = matched_.b().bodies[image].joints;
  for (const int to : own.size() < there.size() ? own : there) {
    const AssemblyJoint& j = matched_.b().joints[to];
    if (cut_.b.of_joint[to] != entry_.image || (j.body_a != image && j.body_b != image)) continue;
    matched_.AddOptions(body, joint, to, options);
  }
  return options;
}

int PieceSearch::NextOpenBody() const {
  for (size_t i = 1; i < num_bodies(); ++i) {
    const int body = BodyAt(i);
    if (!cut_.a.loose[body] && !matched_.R().settled(body)) return body;
  }
  return -1;
}

namespace {

/// A joint of a body, by what of it is fixed in the body.
struct Held {
  Vector3d axis;
  Vector3d out;  ///< Square to the axis: the foot, or across to the other body.
};

Held HeldBy(const Assembly& assembly, int body, int joint) {
  const AssemblyJoint& j = assembly.joints[joint];
  return {j.AxisFrom(body),
          j.slide ? AcrossFrom(assembly, body, joint) : assembly.FootFrom(body, joint)};
}

/// Gathers places, none twice.
class PlaceList {
 public:
  explicit PlaceList(int image) : image_(image) {}

  void Add(const Matrix3d& R, const Vector3d& free_axis) {
    constexpr double kSame = 10.0 * kGeometryTolerance;
    const bool known = std::any_of(places_.begin(), places_.end(), [&](const Place& place) {
      return free_axis.isZero() ? (place.R - R).norm() <= kSame
                                : (place.free_axis - free_axis).norm() <= kSame;
    });
    if (!known) places_.push_back({image_, R, free_axis});
  }

  std::vector<Place> Take() { return std::move(places_); }

 private:
  int image_;
  std::vector<Place> places_;
};

/// The places that take `axis` to `axis_to` and the axis of joint `second` to that of any it may
/// correspond to, which lies alike.
void AddByTwoAxes(const Correspondence& matched, int body, int image, const Vector3d& axis,
                  const Vector3d& axis_to, int second, PlaceList& places) {
  const Vector3d axis_2 = matched.a().joints[second].AxisFrom(body);
  for (const int to_2 : matched.b().bodies[image].joints) {
    if (!matched.MayCorrespond(second, to_2)) continue;
    for (const double sign : {1.0, -1.0}) {
      const Vector3d axis_2_to = sign * matched.b().joints[to_2].AxisFrom(image);
      if (std::abs(axis.dot(axis_2) - axis_to.dot(axis_2_to)) > kGeometryTolerance) continue;
      places.Add(RotationFrom(axis, axis_2, axis_to, axis_2_to), Vector3d::Zero());
    }
  }
}

}  // namespace

std::vector<Place> PlacesOn(const Correspondence& matched, const Pieces& pieces, int body,
                            int image) {
  const Assembly& a = matched.a();
  const Assembly& b = matched.b();
  const double tolerance = matched.length_tolerance();
  const std::vector<int>& joints = a.bodies[body].joints;
  PlaceList places(image);
  if (joints.empty()) {
    places.Add(Matrix3d::Identity(), Vector3d::Zero());
    return places.Take();
  }
  // One joint that reaches out from the reference point says all; else two axes do.
  const auto reaches = [&](int joint) { return HeldBy(a, body, joint).out.norm() > tolerance; };
  auto first = std::find_if(joints.begin(), joints.end(), reaches);
  const bool one_says_all = first != joints.end();
  if (!one_says_all) first = joints.begin();
  const Held held = HeldBy(a, body, *first);
  const auto second = std::find_if(joints.begin(), joints.end(), [&](int joint) {
    return a.joints[joint].axis.cross(held.axis).norm() > kGeometryTolerance;
  });
  for (const int to : b.bodies[image].joints) {
    if (!matched.MayCorrespond(*first, to)) continue;
    const Held held_to = HeldBy(b, image, to);
    if (std::abs(held.out.norm() - held_to.out.norm()) > tolerance) continue;
    for (const double sign : {1.0, -1.0}) {
      const Vector3d axis_to = sign * held_to.axis;
      if (one_says_all) {
        places.Add(RotationFrom(held.axis, held.out, axis_to, held_to.out), Vector3d::Zero());
      } else if (pieces.loose[body]) {
        places.Add(Eigen::Quaterniond::FromTwoVectors(held.axis, axis_to).toRotationMatrix(),
                   axis_to);
      } else {
        AddByTwoAxes(matched, body, image, held.axis, axis_to, *second, places);
      }
    }
  }
  return places.Take();
}

}  // namespace morphbus::congruence
