#include "compiler/congruence/first_mapping.h"

#include <algorithm>

#include "compiler/congruence/counter.h"
#include "compiler/congruence/symmetries.h"

namespace morphbus::congruence {
namespace {

/// So many mappings are made at most to find the first by name.
constexpr int kMaxMade = 64;

/// Makes mappings, each from where one body goes.
class Maker {
 public:
  Maker(const Assembly& a, const Assembly& b, const Classes& classes, Steps& steps)
      : matched_(a, b, classes),
        cut_{CutIntoPieces(a, matched_.length_tolerance()),
             CutIntoPieces(b, matched_.length_tolerance())},
        counter_(matched_, cut_, steps),
        steps_(steps) {}

  std::optional<Mapping> From(int body, const Place& place) {
    if (steps_.gave_up() || !counter_.Make(body, place)) return std::nullopt;
    Mapping mapping = matched_.ToMapping();
    counter_.Clear();
    return mapping;
  }

  std::optional<Mapping> InFrame() {
    const Assembly& a = matched_.a();
    const Assembly& b = matched_.b();
    const int root = a.body_of[a.robot->root_module][a.robot->root_link];
    const int root_b = b.body_of[b.robot->root_module][b.robot->root_link];
    const Eigen::Vector3d moved = a.bodies[root].p_RoTo - b.bodies[root_b].p_RoTo;
    if (moved.norm() > matched_.length_tolerance()) return std::nullopt;
    return From(root, {root_b, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()});
  }

  std::optional<Mapping> Any() {
    const int seed = SeedBody(matched_.classes(), cut_.a);
    if (seed < 0) return std::nullopt;
    for (const Place& place : PlacesOf(matched_, cut_.a, seed)) {
      if (std::optional<Mapping> mapping = From(seed, place)) return mapping;
    }
    return std::nullopt;
  }

  /// Of the mappings that there are, one with the first name for the first module.
  std::optional<Mapping> ByName() {
    const int body = BodyOfFirstModule();
    if (body < 0) return std::nullopt;
    std::vector<Place> places = PlacesOf(matched_, cut_.a, body);
    std::stable_sort(places.begin(), places.end(), [&](const Place& x, const Place& y) {
      return NameAt(body, x) < NameAt(body, y);
    });
    std::optional<Mapping> best;
    std::string name;
    int made = 0;
    for (const Place& place : places) {
      // Places of one name are tried against each other; the next name only if all take the module
      // apart.
      if (best && best->module_to[0] >= 0 && NameAt(body, place) != name) break;
      std::optional<Mapping> mapping = From(body, place);
      if (!mapping) continue;
      name = NameAt(body, place);
      if (!best || Before(*matched_.b().robot, *mapping, *best)) best = std::move(mapping);
      if (++made == kMaxMade) break;
    }
    return best;
  }

 private:
  /// One that fixes where it goes, and has a joint of the module.
  [[nodiscard]] int BodyOfFirstModule() const {
    for (const AssemblyJoint& j : matched_.a().joints) {
      if (j.module != 0) continue;
      for (const int body : {j.body_b, j.body_a}) {
        if (!cut_.a.loose[body]) return body;
      }
    }
    return -1;
  }

  /// Of the module that the first module goes to.
  [[nodiscard]] std::string NameAt(int body, const Place& place) const {
    const Assembly& a = matched_.a();
    const Assembly& b = matched_.b();
    std::string name;
    for (const int joint : a.bodies[body].joints) {
      if (a.joints[joint].module != 0) continue;
      const Eigen::Vector3d foot = place.R * a.FootFrom(body, joint);
      const Eigen::Vector3d axis = place.R * a.joints[joint].axis;
      for (const int to : b.bodies[place.image].joints) {
        if (!matched_.MayCorrespond(joint, to)) continue;
        const bool there =
            (b.FootFrom(place.image, to) - foot).norm() <= matched_.length_tolerance() &&
            axis.cross(b.joints[to].axis).norm() <= kGeometryTolerance;
        const std::string& other = b.robot->modules[b.joints[to].module].name;
        if ((there || a.joints[joint].slide) && (name.empty() || other < name)) name = other;
      }
      break;
    }
    return name;
  }

  Correspondence matched_;
  Cut cut_;
  Counter counter_;
  Steps& steps_;
};

}  // namespace

bool Before(const model::Robot& b, const Mapping& x, const Mapping& y) {
  if (x.keeps_frame != y.keeps_frame) return x.keeps_frame;
  for (size_t m = 0; m < x.module_to.size(); ++m) {
    const int to_x = x.module_to[m];
    const int to_y = y.module_to[m];
    if (to_x == to_y) continue;
    if (to_x < 0 || to_y < 0) return to_x >= 0;
    return b.modules[to_x].name < b.modules[to_y].name;
  }
  for (size_t j = 0; j < x.joints.size(); ++j) {
    if (x.joints[j].to != y.joints[j].to) return x.joints[j].to < y.joints[j].to;
    if (x.joints[j].sign != y.joints[j].sign) return x.joints[j].sign > y.joints[j].sign;
  }
  return false;
}

std::optional<Mapping> MappingInFrame(const Assembly& a, const Assembly& b, const Classes& classes,
                                      Steps& steps) {
  return Maker(a, b, classes, steps).InFrame();
}

std::optional<Mapping> FirstMapping(const Assembly& a, const Assembly& b, const Classes& classes,
                                    Steps& steps) {
  Maker maker(a, b, classes, steps);
  std::optional<Mapping> mapping = maker.InFrame();
  if (mapping) return mapping;
  mapping = maker.Any();
  if (!mapping) return std::nullopt;
  std::optional<Mapping> by_name = maker.ByName();
  return by_name ? by_name : mapping;
}

}  // namespace morphbus::congruence
